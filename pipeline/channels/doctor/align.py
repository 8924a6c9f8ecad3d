"""Two channels that should show one motion: how much of it, how late, and by a clock how much faster.

Increments over windows are compared, one of them read later by a lag that may grow over the log.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.doctor.robust_regression import RobustLine, fit
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: Lag that is looked for on either side, s.
LONGEST_S = 60.0
#: Parts of the log that may lag differently, and windows that each must have.
_PARTS, _FEWEST, _WINDOWS = 12, 8, 600
#: What is left over of one common lag, above which a lag that grows is looked for, and how much better that must be.
_COMMON, _BETTER = 0.15, 0.8
#: The same where the slope's sign turns with the lag: half a period of a zigzag later the other sign does almost as
#: well.
_FAR_BETTER = 0.5
#: No clock that ran at all runs faster or slower than this, s/s; growths that are tried.
_FASTEST, _GROWTHS = 0.02, 41
_ROUNDS = 12
#: Beyond a quarter of a turn in one window, what is left of a direction without its whole turns is ambiguous, rad.
_QUARTER = 0.5 * np.pi


@dataclass(frozen=True)
class Alignment:
    """How one channel goes with another."""

    #: slope, slope_std: Change of the second for a change of 1 in the first.
    slope: float
    slope_std: float
    #: lag_s, lag_std_s: How much later the second shows it, in the middle of the log, s.
    lag_s: float
    lag_std_s: float
    #: rate, rate_std: By how much the lag grows in a second: how much faster the second one's clock runs, s/s.
    rate: float
    rate_std: float
    #: Size of what does not go together over the size of the second's changes.
    left_over: float
    #: The same over the size of its changes about their mean: in a steady turn only noise is left of these.
    varying: float
    #: whole, whole_std: The slope by the changes as they are, a steady turn included, which a bias of a rate falsifies.
    whole: float
    whole_std: float
    #: How far the first turns in all, rad.
    turned: float
    #: Size of what this lag leaves over that a lag between the bounds of sound clocks would leave; 1 for the same.
    explains: float


def edges_of(*series: Series, window_s: float = 0.0) -> Nanoseconds:
    """Return the edges of equal windows over what some series have in common, shape (n + 1,).

    Parameters
    ----------
    window_s : float, optional
        Shortest window, s; never shorter than five periods of the slowest, nor more than six hundred of them.
    """
    start = max(int(channel.time_utc_ns[0]) for channel in series)
    end = min(int(channel.time_utc_ns[-1]) for channel in series)
    span = (end - start) / SECOND_NS
    window = max(window_s, span / _WINDOWS, *(5.0 * channel.period_s for channel in series))
    count = int(span / window) if end > start else 0
    return np.linspace(0, max(end - start, 0), count + 1).astype(np.int64) + start


def align(
    first: Series,
    second: Series,
    usual_s: tuple[float, float] = (-1.0, 1.0),
    *,
    circle: bool = False,
    longest_s: float = LONGEST_S,
) -> Alignment | None:
    """Compare two running totals, such as the heading and the integral of the yaw rate.

    Parameters
    ----------
    usual_s : (float, float), optional
        Lags that sound clocks may show, s.
    circle : bool, optional
        Whether the second is a direction, whose changes are right but for whole turns: one that was interpolated across
        north loses a turn.
    longest_s : float, optional
        Lag that is looked for on either side, s; 0 for none, which takes a moment only.

    Returns
    -------
    Alignment or None
        None where they have too little in common to compare, or no lag is the best.
    """
    if min(len(first), len(second)) < _FEWEST:
        return None
    edges = edges_of(first, second)
    if edges.size < 2 * _FEWEST:
        return None
    x = np.diff(first.at(edges, gap_limit_s(first)))
    if circle:
        x = np.where(np.abs(x) < _QUARTER, x, np.nan)
    if not longest_s:
        return _refined(x, second, edges, (0.0, 0.0), (1.0, 1.0), circle=circle, rounds=1)
    step = max(0.5 * second.period_s, 0.5)
    span = float(edges[-1] - edges[0]) / SECOND_NS
    longest = min(longest_s, span / 8.0)
    lags = np.arange(-np.floor(longest / step), np.floor(longest / step) + 1) * step
    sums = _sums(x, second, edges, lags, circle=circle)
    common = _left_over(np.sum(sums, axis=0))
    honest = (lags >= usual_s[0] - step) & (lags <= usual_s[1] + step)
    usual = float(np.min(common[honest])) if honest.any() else 1.0
    best = (float(lags[int(np.argmin(common))]), 0.0, float(np.min(common)))
    if honest.any():
        near = int(np.flatnonzero(honest)[np.argmin(common[honest])])
        together = np.sum(sums, axis=0)
        turned = _sense(together[int(np.argmin(common))]) != _sense(together[near])
        if best[2] > (_FAR_BETTER if turned else _BETTER) * usual:
            best = (float(lags[near]), 0.0, usual)
    if best[2] > _COMMON:
        grown = _growing(sums, lags, span)
        if grown[2] < _BETTER * best[2]:
            best = grown
    refined = _refined(x, second, edges, (best[0], best[1]), (best[2], usual), circle=circle, rounds=_ROUNDS)
    # beyond the lags that were looked at, a refinement has lost its way
    return None if refined is None or abs(refined.lag_s) > longest + 3.0 * step + abs(best[1]) * span else refined


def _read_later(edges: Nanoseconds, lag: float, rate: float) -> Nanoseconds:
    middle = int(edges[0] + (edges[-1] - edges[0]) // 2)
    later = lag * SECOND_NS + rate * (edges - middle).astype(np.float64)
    return edges + np.rint(later).astype(np.int64)


def _changes(second: Series, edges: Nanoseconds, *, circle: bool) -> Float:
    """Return the changes between edges of shape (..., n + 1), shape (..., n); NaN across gaps."""
    change: Float = np.diff(second.at(edges.reshape(-1), gap_limit_s(second)).reshape(edges.shape))
    return np.mod(change + np.pi, 2.0 * np.pi) - np.pi if circle else change


def _sums(x: Float, second: Series, edges: Nanoseconds, lags: Float, *, circle: bool) -> Float:
    """Return the sums that a straight fit of each part at each lag needs, shape (parts, lags, 6)."""
    parts = min(_PARTS, max(x.size // _FEWEST, 1))
    cuts = np.linspace(0, x.size, parts + 1).astype(int)[:-1]
    sums = np.zeros((parts, lags.size, 6))
    # all lags in one go: the search among the readings costs more than the sums
    later = edges[None, :] + np.rint(lags * SECOND_NS).astype(np.int64)[:, None]
    for k, y in enumerate(_changes(second, later, circle=circle)):
        good = np.isfinite(x) & np.isfinite(y)
        a, b = np.where(good, x, 0.0), np.where(good, y, 0.0)
        table = np.column_stack([good.astype(np.float64), a, b, a * a, a * b, b * b])
        sums[:, k] = np.add.reduceat(table, cuts, axis=0)
    return sums


def _left_over(sums: Float) -> Float:
    """Return the share of the second's changes that no slope explains, from sums of shape (..., 6)."""
    n, a, b, aa, ab, bb = np.moveaxis(sums, -1, 0)
    n = np.maximum(n, 1.0)
    xx, xy, yy = aa - a * a / n, ab - a * b / n, bb - b * b / n
    explained = np.divide(xy * xy, xx * yy, out=np.zeros_like(xy), where=(xx > 0.0) & (yy > 0.0))
    # where half of the windows fell out, what is left says little
    thin = n < 0.5 * np.max(n)
    return np.where(thin, 1.0, np.sqrt(np.clip(1.0 - explained, 0.0, 1.0)))


def _sense(sums: Float) -> bool:
    """Return whether the second rises with the first, from sums of shape (6,)."""
    n, a, b, _, ab, _ = sums
    return bool(ab - a * b / max(n, 1.0) > 0.0)


def _growing(sums: Float, lags: Float, span_s: float) -> tuple[float, float, float]:
    """Return the lag in the middle of the log, its growth and what they leave over: the least that any leave."""
    parts, count, _ = sums.shape
    best = (0.0, 0.0, np.inf)
    if parts < 3:
        return best
    along = (np.arange(parts) + 0.5) / parts - 0.5
    start = np.arange(count)
    step = float(lags[1] - lags[0])
    most = min(_FASTEST * span_s / step, float(count - 1))
    for drift in np.linspace(-most, most, _GROWTHS):
        places = start[:, None] + np.rint(drift * along)[None, :].astype(int)
        inside = np.all((places >= 0) & (places < count), axis=1)
        if not inside.any():
            continue
        left = _left_over(np.sum(sums[np.arange(parts)[None, :], places[inside]], axis=1))
        k = int(np.argmin(left))
        if left[k] < best[2]:
            best = (float(lags[start[inside][k]]), float(drift * step / span_s), float(left[k]))
    return best


def _refined(
    x: Float,
    second: Series,
    edges: Nanoseconds,
    guess: tuple[float, float],
    left: tuple[float, float],
    *,
    circle: bool,
    rounds: int,
) -> Alignment | None:
    """Improve lag and growth by Gauss and Newton's steps; their standard errors are those of the last one."""
    lag, rate = guess
    gap = gap_limit_s(second)
    step = round(max(second.period_s, 0.5) * SECOND_NS)
    long = np.diff(edges) / SECOND_NS
    middle = edges[:-1] + np.diff(edges) // 2
    along = (middle - middle[middle.size // 2]) / SECOND_NS
    line: RobustLine | None = None
    for _ in range(rounds):
        last = (lag, rate)
        at = _read_later(edges, lag, rate)
        y = _changes(second, at, circle=circle)
        slope = (second.at(at + step, gap) - second.at(at - step, gap)) / (2.0 * step / SECOND_NS)
        later = np.diff(slope)
        line = fit(np.column_stack([x, long, later, later * along]), y)
        if line is None:
            return None
        lag -= float(np.clip(line.value[2], -3.0, 3.0))
        rate = float(np.clip(rate - line.value[3], -_FASTEST, _FASTEST))
        if abs(lag - last[0]) < 0.1 * line.std[2] and abs(rate - last[1]) < 0.1 * line.std[3]:
            break
    assert line is not None
    return Alignment(
        float(line.value[0]), float(line.std[0]), lag, float(line.std[2]), rate, float(line.std[3]),
        line.left_over, *_as_it_is(x, y, long, line), min(left[0], line.left_over) / max(left[1], 1e-12),
    )  # fmt: skip


def _as_it_is(x: Float, y: Float, long: Float, line: RobustLine) -> tuple[float, float, float, float]:
    """Return what a fit leaves over of the changes about their mean, and slope and extent of the whole changes."""
    known = np.isfinite(x) & np.isfinite(y)
    steady = fit(long[:, None], y)
    whole = fit(x[:, None], y)
    assert steady is not None
    assert whole is not None
    varying = min(line.left_over / max(steady.left_over, 1e-12), 1.0)
    return varying, float(whole.value[0]), float(whole.std[0]), abs(float(np.sum(x[known])))
