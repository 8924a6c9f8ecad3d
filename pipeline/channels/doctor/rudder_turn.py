"""Rudder against the turn: a rudder to starboard turns her to starboard, after a while.

Nomoto's first-order equation, integrated over windows so that no rate has to be differenced twice.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.doctor.align import edges_of
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import Log, integral, turning
from kempf.pipeline.channels.doctor.outcome import SURE, Figure, Outcome, untestable, worst
from kempf.pipeline.channels.doctor.robust_regression import RobustLine, fit, quantile, reach
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import SECOND_NS, Float, Nanoseconds, Series

#: A rudder that moves less than this shows nothing, rad; one that moves less than the second while the ship swings so
#: many times farther is in another unit.
_LEAST_RUDDER, _FAINT_RUDDER, _SWING = np.deg2rad(1.0), np.deg2rad(2.0), 8.0
_LEAST_TURN = float(np.deg2rad(10.0))
#: What wind, propeller and trim ask of the rudder on a straight course, deg, and one standard deviation of it.
_NEUTRAL_DEG, _NEUTRAL_STD_DEG = 12.0, 3.0
#: The turn may answer so late, s, at most: the rudder's own shift that is tried.
_SHIFTS = np.arange(-30.0, 31.0, 1.0)
#: Shifts that a sound rudder shows: the turn answers at once or after some seconds, and does not foresee the rudder.
USUAL_S = (-8.0, 4.0)
_FAR_BETTER = 0.6
#: What the rudder must explain of the change of the rate beyond what the rate itself explains.
_EXPLAINS = 0.05
#: What it must explain to show when it was put over, and how well it shows that then, s.
_CLOCKED, _SHIFT_STD_S = 0.3, 1.0
_FEWEST = 16


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare each rudder channel with the turn, as the heading and as the yaw rate show it.

    Parameters
    ----------
    thorough : bool, optional
        False: only at shifts that a sound rudder shows, and with the yaw rate alone where there is one.

    Returns
    -------
    list of Outcome
        ``rudder_angle_heading``, ``rudder_angle_rate`` and the same with ``rudder_order``.

    References
    ----------
    Nomoto, Taguchi, Honda and Hirano (1957), "On the steering qualities of ships", International Shipbuilding
    Progress 4: T dr/dt + r = K delta, here r(t1) - r(t0) = -(turn)/T + (K/T) int delta + constant.
    """
    found = []
    for rudder in ("rudder_angle", "rudder_order"):
        if rudder not in log.series:
            continue
        for name, channels, turned in _turns(log, all_of_them=thorough):
            found += _compare(f"{rudder}_{name}", (rudder, *channels), log, turned, thorough=thorough)
    return found


def _turns(log: Log, *, all_of_them: bool) -> list[tuple[str, tuple[str, ...], tuple[Series, Series]]]:
    """Return what shows the turn: name, channels, the angle turned and the rate of turn."""
    found: list[tuple[str, tuple[str, ...], tuple[Series, Series]]] = []
    heading, rate = log.series.get("heading"), log.series.get("yaw_rate")
    if heading is not None and (all_of_them or rate is None) and len(turning(heading)) > 1:
        found.append(("heading", ("heading",), (heading, turning(heading))))
    if rate is not None:
        found.append(("rate", ("yaw_rate",), (integral(rate), rate)))
    return found


def _compare(
    name: str, channels: tuple[str, ...], log: Log, turned: tuple[Series, Series], *, thorough: bool
) -> list[Outcome]:
    rudder = log.series[channels[0]]
    angle, rate = turned
    moved, swung = reach(rudder.value), reach(angle.value)
    if moved < _FAINT_RUDDER and swung > max(_SWING * moved, 4.0 * _LEAST_TURN) and moved > 0.0:
        # no ship turns so far on so little rudder
        figure = Figure(
            "rudder angle range", np.rad2deg(moved), 0.1 * np.rad2deg(moved), np.rad2deg(_FAINT_RUDDER), 180.0, "deg"
        )
        words = f"the rudder moves by {figure.value:.2g} deg only, while she turns through {np.rad2deg(swung):.0f} deg"
        suspects = (Fault("unit", channels[:1], 180.0 / np.pi, "rad taken for deg"),)
        return [Outcome(name, channels, "disagree", words, (figure,), 1.0, suspects)]
    if moved < _LEAST_RUDDER or swung < _LEAST_TURN:
        return [untestable(name, channels, "the rudder was hardly used, or the ship hardly turned")]
    edges = edges_of(rudder, angle, rate, window_s=_window(rudder))
    if edges.size < _FEWEST:
        return [untestable(name, channels, "too short to determine the yaw response")]
    shifts = _SHIFTS if thorough else np.array([USUAL_S[0], 0.5 * (USUAL_S[0] + USUAL_S[1]), USUAL_S[1]])
    answered = _best(edges, rudder, angle, rate, _makes_way(log, edges), shifts)
    if answered is None:
        return [untestable(name, channels, "the channels hardly overlap in time")]
    found, shift, explains = answered
    answer = _judged(name, channels, found, explains)
    return [answer, _clock(f"{name}_clock", channels, found, shift, explains)] if thorough else [answer]


def _window(rudder: Series) -> float:
    """Return a window a fraction of the time between two rudder movements, s."""
    middle = 0.5 * (quantile(rudder.value, 0.05) + quantile(rudder.value, 0.95))
    side = np.sign(rudder.value - middle)
    crossings = np.flatnonzero(np.diff(side[side != 0]) != 0).size
    span = float(rudder.time_utc_ns[-1] - rudder.time_utc_ns[0]) / SECOND_NS
    return float(np.clip(min(span / max(crossings, 1) / 12.0, span / 80.0), 1.0, 10.0))


def _makes_way(log: Log, edges: Nanoseconds) -> NDArray[np.bool_]:
    """Return in which windows she makes so much way that the rudder acts, shape (n,); all where no speed is known."""
    for name in ("speed_through_water", "speed_over_ground"):
        speed = log.series.get(name)
        if speed is not None:
            at = np.abs(speed.at(edges, np.inf))
            slow = at < 0.5 * quantile(np.abs(speed.value), 0.9)
            return ~(slow[1:] | slow[:-1])
    return np.ones(max(edges.size - 1, 0), dtype=np.bool_)


def _table(edges: Nanoseconds, rudder: Series, angle: Series, rate: Series) -> tuple[Float, Float, Series]:
    smooth = _averaged(rate, float(np.median(np.diff(edges))) / SECOND_NS / 4.0)
    jump = np.diff(smooth.at(edges, max(gap_limit_s(smooth), 3.0)))
    turn = np.diff(angle.at(edges, gap_limit_s(angle)))
    return turn, jump, integral(rudder)


def _averaged(series: Series, over_s: float) -> Series:
    """Return running means over so long, at the middles; less noise where the rate is read quickly."""
    width = int(over_s / series.period_s) if series.period_s > 0 else 0
    if width < 2 or len(series) < 2 * width:
        return series
    total = np.concatenate([[0.0], np.cumsum(series.value)])
    mean = (total[width:] - total[:-width]) / width
    first, last = series.time_utc_ns[: mean.size], series.time_utc_ns[width - 1 : width - 1 + mean.size]
    return Series(first + (last - first) // 2, mean)


def _best(
    edges: Nanoseconds, rudder: Series, angle: Series, rate: Series, way: NDArray[np.bool_], shifts: Float
) -> tuple[RobustLine, float, float] | None:
    """Return the fit at the shift of the rudder that explains most, that shift (s) and what the rudder explains."""
    turn, jump, total = _table(edges, rudder, angle, rate)
    jump = np.where(way, jump, np.nan)
    long = np.diff(edges) / SECOND_NS
    gap = gap_limit_s(rudder)
    moved = edges[None, :] + np.rint(shifts * SECOND_NS).astype(np.int64)[:, None]
    put = np.diff(total.at(moved.reshape(-1), gap).reshape(moved.shape))
    without, *shifted = _mean_squares(np.concatenate([np.zeros((1, turn.size)), put]), turn, long, jump)
    if not 0.0 < without < np.inf:
        return None
    left = np.array(shifted)
    honest = (USUAL_S[0] <= shifts) & (USUAL_S[1] >= shifts)
    usual = float(np.min(left[honest]))
    # a shift that no gear and no hull makes has to be far better than one that they do
    k = int(np.argmin(left)) if np.min(left) < _FAR_BETTER * usual else int(np.argmin(np.where(honest, left, np.inf)))
    if not np.isfinite(left[k]):
        return None
    found = fit(np.column_stack([put[k], turn, long]), jump)
    return None if found is None else (found, float(shifts[k]), 1.0 - float(left[k]) / without)


def _mean_squares(put: Float, turn: Float, long: Float, observed: Float) -> Float:
    """Return the mean square that the fit with each row of ``put`` leaves over; infinite for too few windows.

    Parameters
    ----------
    put : ndarray, shape (n_fits, n)
    turn, long, observed : ndarray, shape (n,)
    """
    columns = np.stack([put, *np.broadcast_arrays(turn, long, put)[:2]], axis=2)
    good = np.isfinite(observed) & np.all(np.isfinite(columns), axis=2)
    count = np.count_nonzero(good, axis=1)
    A, y = np.where(good[..., None], columns, 0.0), np.where(good, observed, 0.0)
    A = A / np.maximum(np.sqrt(np.sum(A**2, axis=1, keepdims=True) / np.maximum(count, 1)[:, None, None]), 1e-300)
    turned = np.swapaxes(A, 1, 2)
    value = np.linalg.pinv(turned @ A, rcond=1e-10, hermitian=True) @ (turned @ y[..., None])
    left: Float = np.sum((y - (A @ value)[..., 0]) ** 2, axis=1) / np.maximum(count, 1)
    return np.where(count < _FEWEST, np.inf, left)


def _clock(name: str, channels: tuple[str, ...], found: RobustLine, shift: float, explains: float) -> Outcome:
    """Judge the shift of the rudder at which she answers best."""
    if explains < _CLOCKED or abs(found.value[0]) < SURE * found.std[0]:
        return untestable(name, channels, "the yaw response is too weak to determine the rudder's delay")
    figure = Figure("delay of the rudder channel behind the yaw response", shift, _SHIFT_STD_S, *USUAL_S, "s")
    when = "earlier" if shift > 0 else "later"
    words = f"the yaw response fits best with the rudder put over {abs(shift):.0f} s {when} than logged"
    middle = 0.5 * (USUAL_S[0] + USUAL_S[1])
    late, std, half = shift - middle, 0.5 * (USUAL_S[1] - USUAL_S[0]), "half the usual range"
    suspects = (
        Fault("latency", channels[:1], late, "late" if late > 0 else "early", std, spread=half),
        Fault("latency", channels[1:], -late, "early" if late > 0 else "late", std, spread=half),
    )
    return Outcome(name, channels, figure.state, words, (figure,), min(1.0 - explains, 1.0), suspects)


def _judged(name: str, channels: tuple[str, ...], found: RobustLine, explains: float) -> Outcome:
    answer, std = float(found.value[0]), float(found.std[0])
    if explains < _EXPLAINS or abs(answer) < SURE * std:
        why = "the yaw response to the rudder cannot be distinguished from other yaw motion"
        return untestable(name, channels, why)
    neutral = -float(found.value[2]) / answer
    neutral_std = float(np.hypot(found.std[2] / abs(answer), np.deg2rad(_NEUTRAL_STD_DEG)))
    figures = (
        Figure("yaw acceleration per rad of rudder", answer, std, 0.0, np.inf, "1/s^2"),
        Figure(
            "neutral rudder angle",
            np.rad2deg(neutral),
            np.rad2deg(neutral_std),
            -_NEUTRAL_DEG,
            _NEUTRAL_DEG,
            "deg",
        ),
    )
    words = (
        f"yaw acceleration per rad of rudder {answer:.2g} ± {std:.1g} 1/s^2; "
        f"neutral rudder angle {figures[1].value:.0f} ± {figures[1].std:.0f} deg (1 s.e.)"
    )
    sign = [Fault("sign", (one,)) for one in channels]
    if channels[1] == "heading":
        sign.append(Fault("offset", ("heading",), np.pi / 2, "counted anticlockwise from east", simplicity=2))
    suspects = (*sign, Fault("offset", channels[:1], -neutral, "zero elsewhere", neutral_std))
    state = "disagree" if answer < 0.0 else worst([figures[1].state, "agree"])
    return Outcome(name, channels, state, words, figures, min(1.0 - explains, 1.0), suspects)
