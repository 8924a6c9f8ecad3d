"""Rudder against the turn: a rudder to starboard turns her to starboard, after a while.

Nomoto's first-order equation, integrated over windows so that no rate has to be differenced twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.doctor import heading_rate
from kempf.pipeline.channels.doctor.align import edges_of
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import Log, integral, turning
from kempf.pipeline.channels.doctor.motion import does_not_move, speed_of, under_way
from kempf.pipeline.channels.doctor.outcome import STILL, SURE, CheckFigure, Outcome, untestable, worst
from kempf.pipeline.channels.doctor.robust_regression import RobustLine, fit, quantile, reach
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

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
#: A rudder that moves less than this does not move, rad.
_NO_RUDDER = 1e-3
#: She turns to both sides where her fast turns to the one, a few windows in a hundred left out, are this share of those
#: to the other.
_FAST, _BOTH_SIDES = 0.97, 0.2
#: Stretches of the log that each have to say what is held against the rudder, what the rudder must explain then, and by
#: how much the delays that they show may differ, s.
_STRETCHES, _PROVES, _SAME_S = 3, 0.15, 4.0


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
    outcomes = []
    for rudder in ("rudder_angle", "rudder_order"):
        if rudder not in log.series:
            continue
        turns = _turns(log, all_of_them=thorough)
        each = [
            _compare(f"{rudder}_{name}", (rudder, *how), log, turned, thorough=thorough) for name, how, turned in turns
        ]
        outcomes += _of_one_mind(log, each, thorough=thorough)
    return outcomes


def _of_one_mind(log: Log, each: list[list[Outcome]], *, thorough: bool) -> list[Outcome]:
    """Return the outcomes with heading and with yaw rate; what only one of the two holds against the rudder is nothing.

    Unless heading and yaw rate disagree themselves: then it is evidence which of them is wrong.
    """
    whole = [outcome for some in each for outcome in some]
    state = {outcome.check: outcome.state for outcome in whole}
    alone = {o.check for o in whole if o.state == "disagree" and state.get(_other(o.check)) == "agree"}
    if not alone:
        return whole
    between = {o.check: o.state for o in heading_rate.examine(log, thorough=thorough)}
    return [
        untestable(o.check, o.channels, f"{o.words}, but not by the other channel that shows the turn")
        if o.check in alone and between.get(f"heading_rate{'_clock' * o.check.endswith('_clock')}") != "disagree"
        else o
        for o in whole
    ]


def _other(check: str) -> str:
    """Return the name of the same check with the other channel that shows the turn."""
    there, here = ("_rate", "_heading") if "_heading" in check else ("_heading", "_rate")
    return check.replace(here, there)


def _turns(log: Log, *, all_of_them: bool) -> list[tuple[str, tuple[str, ...], tuple[Series, Series]]]:
    """Return what shows the turn: name, channels, the angle turned and the rate of turn."""
    turns: list[tuple[str, tuple[str, ...], tuple[Series, Series]]] = []
    heading, rate = log.series.get("heading"), log.series.get("yaw_rate")
    if heading is not None and (all_of_them or rate is None) and len(turning(heading)) > 1:
        turns.append(("heading", ("heading",), (heading, turning(heading))))
    if rate is not None:
        turns.append(("rate", ("yaw_rate",), (integral(rate), rate)))
    return turns


def _compare(
    name: str, channels: tuple[str, ...], log: Log, turned: tuple[Series, Series], *, thorough: bool
) -> list[Outcome]:
    rudder = log.series[channels[0]]
    windows = _testable(log, rudder, turned)
    if isinstance(windows, str):
        return [untestable(name, channels, windows)]
    shifts = _SHIFTS if thorough else np.array([USUAL_S[0], 0.5 * (USUAL_S[0] + USUAL_S[1]), USUAL_S[1]])
    answered = _best(windows, rudder, shifts)
    if answered is None:
        return [untestable(name, channels, "the channels hardly overlap in time")]
    if answered.ambiguous:
        return [untestable(name, channels, "a wrong sign and a delay of the rudder cannot be distinguished")]
    moved, swung = reach(rudder.value), reach(turned[0].value)
    if _is_faint(moved, swung):
        return [_faint(name, channels, answered, moved, swung)]
    answer = _judged(name, channels, answered)
    return [answer, _clock(f"{name}_clock", channels, answered)] if thorough else [answer]


def _testable(log: Log, rudder: Series, turned: tuple[Series, Series]) -> _Windows | str:
    """Return the windows in which rudder and turn are compared, or why they cannot be."""
    angle, rate = turned
    moved, swung = reach(rudder.value), reach(angle.value)
    edges = edges_of(rudder, angle, rate, window_s=_window(rudder))
    if does_not_move(log):
        return STILL
    if swung < _LEAST_TURN or moved < _NO_RUDDER or (moved < _LEAST_RUDDER and not _is_faint(moved, swung)):
        return "the rudder was hardly used, or the ship hardly turned"
    if edges.size < _FEWEST:
        return "too short to determine the yaw response"
    windows = _windows(edges, rudder, angle, rate, under_way(speed_of(log), edges))
    return _one_sided(windows) or windows


def _is_faint(moved: float, swung: float) -> bool:
    """Return whether a rudder moves so little that no ship could turn so far on it."""
    return moved < _FAINT_RUDDER and swung > max(_SWING * moved, 4.0 * _LEAST_TURN)


def _faint(name: str, channels: tuple[str, ...], answered: _Answer, moved: float, swung: float) -> Outcome:
    """Judge a rudder that hardly moves where she turns far: it is in another unit if she answers it all the same."""
    if answered.explains < _CLOCKED or abs(answered.fit.value[0]) < SURE * answered.fit.std[0]:
        return untestable(name, channels, "the rudder was hardly used, or the ship hardly turned")
    figure = CheckFigure(
        "rudder angle range", np.rad2deg(moved), 0.1 * np.rad2deg(moved), np.rad2deg(_FAINT_RUDDER), 180.0, "deg"
    )
    words = f"the rudder moves by {figure.value:.2g} deg only, while she turns through {np.rad2deg(swung):.0f} deg"
    suspects = (Fault("unit", channels[:1], 180.0 / np.pi, "rad taken for deg"),)
    return Outcome(name, channels, "disagree", words, (figure,), 1.0, suspects)


def _window(rudder: Series) -> float:
    """Return a window a fraction of the time between two rudder movements, s."""
    middle = 0.5 * (quantile(rudder.value, 0.05) + quantile(rudder.value, 0.95))
    side = np.sign(rudder.value - middle)
    crossings = np.flatnonzero(np.diff(side[side != 0]) != 0).size
    span = float(rudder.time_utc_ns[-1] - rudder.time_utc_ns[0]) / SECOND_NS
    return float(np.clip(min(span / max(crossings, 1) / 12.0, span / 80.0), 1.0, 10.0))


@dataclass(frozen=True, eq=False)
class _Windows:
    """What each window of a log shows; NaN where she is not under way or a channel has a gap."""

    #: Shape (n + 1,), UTC ns.
    edges: Nanoseconds
    #: turn, jump, long: Shape (n,). Angle turned, rad; change of the rate of turn, rad/s; duration, s.
    turn: Float
    jump: Float
    long: Float
    #: Shape (n,). Mean rudder angle, rad.
    rudder: Float


@dataclass(frozen=True, eq=False)
class _Answer:
    """How she answers the rudder, over all and in stretches of the log with as much rudder work each."""

    fit: RobustLine
    #: By how much the rudder is read earlier than logged, s, and what it explains of the change of the rate then.
    shift_s: float
    explains: float
    #: What was fitted, for its stretches: the windows, the rudder at each shift, shape (n_shifts, n), the shifts, s.
    windows: _Windows
    put: Float
    shifts: Float
    #: Correlation of rudder and rate of turn, at the same time.
    together: float
    #: Whether a rudder of the other sign at a shift that no gear makes does far better than any at a usual one.
    ambiguous: bool


def _windows(edges: Nanoseconds, rudder: Series, angle: Series, rate: Series, way: NDArray[np.bool_]) -> _Windows:
    smooth = _averaged(rate, float(np.median(np.diff(edges))) / SECOND_NS / 4.0)
    jump = np.diff(smooth.at(edges, max(gap_limit_s(smooth), 3.0)))
    turn = np.diff(angle.at(edges, gap_limit_s(angle)))
    long = np.diff(edges) / SECOND_NS
    held = np.diff(integral(rudder).at(edges, gap_limit_s(rudder))) / long
    known = way & np.isfinite(jump) & np.isfinite(turn) & np.isfinite(held)
    none = np.where(known, 0.0, np.nan)
    return _Windows(edges, turn + none, jump + none, long, held + none)


def _one_sided(windows: _Windows) -> str:
    """Return why turns to one side only, or hardly any, test nothing; empty where she turns to both."""
    known = np.isfinite(windows.turn)
    if np.count_nonzero(known) < _FEWEST:
        return "too short under way to determine the yaw response"
    turn = windows.turn[known]
    fast = np.array([max(quantile(side * turn / windows.long[known], _FAST), 0.0) for side in (1.0, -1.0)])
    far = np.array([float(np.sum(np.maximum(side * turn, 0.0))) for side in (1.0, -1.0)])
    if np.max(far) < _LEAST_TURN:
        return "the rudder was hardly used, or the ship hardly turned"
    if np.min(far) < _LEAST_TURN or np.min(fast) < _BOTH_SIDES * np.max(fast):
        return "she turns to one side only: not testable"
    return ""


def _averaged(series: Series, over_s: float) -> Series:
    """Return running means over so long, at the middles; less noise where the rate is read quickly."""
    width = int(over_s / series.period_s) if series.period_s > 0 else 0
    if width < 2 or len(series) < 2 * width:
        return series
    total = np.concatenate([[0.0], np.cumsum(series.value)])
    mean = (total[width:] - total[:-width]) / width
    first, last = series.time_utc_ns[: mean.size], series.time_utc_ns[width - 1 : width - 1 + mean.size]
    return Series(first + (last - first) // 2, mean)


def _best(windows: _Windows, rudder: Series, shifts: Float) -> _Answer | None:
    """Return the fit at the shift of the rudder that explains most; None where too little is known."""
    gap, total = gap_limit_s(rudder), integral(rudder)
    moved = windows.edges[None, :] + np.rint(shifts * SECOND_NS).astype(np.int64)[:, None]
    put = np.diff(total.at(moved.reshape(-1), gap).reshape(moved.shape))
    none = np.zeros((1, windows.turn.size))
    whole = _left(np.concatenate([none, put]), windows, np.isfinite(windows.jump))
    if not 0.0 < whole[0] < np.inf:
        return None
    k = _chosen(whole[1:], shifts)
    if not np.isfinite(whole[1 + k]):
        return None
    line = _fitted(windows, put[k], np.isfinite(windows.jump))
    near = _chosen(whole[1:], shifts, far_better=0.0)
    usual = line if near == k else _fitted(windows, put[near], np.isfinite(windows.jump))
    if line is None or usual is None:
        return None
    known = np.isfinite(windows.jump)
    rate = windows.turn[known] / windows.long[known]
    together = float(np.corrcoef(windows.rudder[known], rate)[0, 1]) if np.ptp(windows.rudder[known]) > 0.0 else 0.0
    explains = 1.0 - float(whole[1 + k] / whole[0])
    ambiguous = bool(line.value[0] * usual.value[0] < 0.0)
    return _Answer(line, float(shifts[k]), explains, windows, put, shifts, together, ambiguous)


def _chosen(left: Float, shifts: Float, far_better: float = _FAR_BETTER) -> int:
    """Return the place of the shift that leaves least over; one that no gear and no hull makes has to be far better."""
    usual = (USUAL_S[0] <= shifts) & (USUAL_S[1] >= shifts)
    if np.min(left) < far_better * float(np.min(left[usual])):
        return int(np.argmin(left))
    return int(np.argmin(np.where(usual, left, np.inf)))


def _fitted(windows: _Windows, put: Float, of: NDArray[np.bool_]) -> RobustLine | None:
    return fit(np.column_stack([put, windows.turn, windows.long])[of], windows.jump[of])


def _left(put: Float, windows: _Windows, of: NDArray[np.bool_]) -> Float:
    return _mean_squares(put[:, of], windows.turn[of], windows.long[of], windows.jump[of])


def _parts(windows: _Windows) -> list[NDArray[np.bool_]]:
    """Return stretches of the log, one after the other, in each of which the rudder worked as much, each shape (n,)."""
    known = np.isfinite(windows.rudder)
    work = np.where(known, (windows.rudder - np.mean(windows.rudder[known])) ** 2, 0.0)
    share = np.cumsum(work) / max(float(np.sum(work)), 1e-300)
    stretch = np.minimum(np.floor(share * _STRETCHES), _STRETCHES - 1)
    return [known & (stretch == k) for k in range(_STRETCHES)]


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


def _clock(name: str, channels: tuple[str, ...], answered: _Answer) -> Outcome:
    """Judge the shift of the rudder at which she answers best."""
    line, shift = answered.fit, answered.shift_s
    if answered.explains < _CLOCKED or abs(line.value[0]) < SURE * line.std[0]:
        return untestable(name, channels, "the yaw response is too weak to determine the rudder's delay")
    figure = CheckFigure("delay of the rudder channel behind the yaw response", shift, _SHIFT_STD_S, *USUAL_S, "s")
    when = "earlier" if shift > 0 else "later"
    words = f"the yaw response fits best with the rudder put over {abs(shift):.0f} s {when} than logged"
    if figure.state == "disagree" and not _same_shift(answered):
        return untestable(name, channels, f"{words}, but not in every stretch of the log")
    middle = 0.5 * (USUAL_S[0] + USUAL_S[1])
    late, std, half = shift - middle, 0.5 * (USUAL_S[1] - USUAL_S[0]), "half the usual range"
    suspects = (
        Fault("latency", channels[:1], late, "late" if late > 0 else "early", std, spread=half),
        Fault("latency", channels[1:], -late, "early" if late > 0 else "late", std, spread=half),
    )
    return Outcome(name, channels, figure.state, words, (figure,), min(1.0 - answered.explains, 1.0), suspects)


def _same_shift(answered: _Answer) -> bool:
    """Return whether she answers best at this shift in each stretch of the log."""
    left = [_left(answered.put, answered.windows, part) for part in _parts(answered.windows)]
    return all(abs(answered.shifts[_chosen(rest, answered.shifts)] - answered.shift_s) <= _SAME_S for rest in left)


def _judged(name: str, channels: tuple[str, ...], answered: _Answer) -> Outcome:
    line = answered.fit
    answer, std = float(line.value[0]), float(line.std[0])
    if answered.explains < _EXPLAINS or abs(answer) < SURE * std:
        why = "the yaw response to the rudder cannot be distinguished from other yaw motion"
        return untestable(name, channels, why)
    neutral = -float(line.value[2]) / answer
    neutral_std = float(np.hypot(line.std[2] / abs(answer), np.deg2rad(_NEUTRAL_STD_DEG)))
    figures = (
        CheckFigure("yaw acceleration per rad of rudder", answer, std, 0.0, np.inf, "1/s^2"),
        CheckFigure(
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
    state = "disagree" if answer < 0.0 else worst([figures[1].state, "agree"])
    if state == "disagree" and not _repeated(answered, neutral):
        return untestable(name, channels, f"{words}, but not in every stretch of the log")
    sign = [Fault("sign", (channel,)) for channel in channels]
    if channels[1] == "heading":
        sign.append(Fault("offset", ("heading",), np.pi / 2, "counted anticlockwise from east", simplicity=2))
    suspects = (*sign, Fault("offset", channels[:1], -neutral, "zero elsewhere", neutral_std))
    return Outcome(name, channels, state, words, figures, min(1.0 - answered.explains, 1.0), suspects)


def _repeated(answered: _Answer, neutral: float) -> bool:
    """Return whether each stretch of the log by itself says what all of it says against the rudder.

    A standard error is right where the model is; where it is not, as in one long turn, or where wind and waves turn
    her, only repetition is proof. Of a wrong sign the plain correlation of rudder and rate of turn has to say the same.
    """
    sense = np.sign(answered.fit.value[0])
    if sense < 0.0 and (answered.together > 0.0 or answered.explains < _PROVES):
        return False
    sure = 0
    put = answered.put[int(np.argmin(np.abs(answered.shifts - answered.shift_s)))]
    for part in _parts(answered.windows):
        line = _fitted(answered.windows, put, part)
        if line is None:
            continue
        answer, std = float(line.value[0]), float(line.std[0])
        if sense * answer < -std:
            return False
        if sense * answer < 2.0 * std:
            continue
        own = -float(line.value[2]) / answer
        if sense > 0.0 and not (abs(own) > np.deg2rad(_NEUTRAL_DEG) and own * neutral > 0.0):
            return False
        sure += 1
    return sure >= _STRETCHES - 1
