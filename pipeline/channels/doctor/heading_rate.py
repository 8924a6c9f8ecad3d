"""Heading against yaw rate: the one is the integral of the other, and both show it at one instant."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.align import LONGEST_S, Alignment, align, edges_of
from kempf.pipeline.channels.doctor.clocks import clock_figures, clock_outcome
from kempf.pipeline.channels.doctor.faults import BOW_AND_COURSE, UNITS, Fault, unit_faults
from kempf.pipeline.channels.doctor.log import Log, integral
from kempf.pipeline.channels.doctor.motion import does_not_move
from kempf.pipeline.channels.doctor.outcome import STILL, SURE, CheckFigure, Outcome, untestable
from kempf.pipeline.channels.doctor.robust_regression import reach
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS

#: Slopes that are no fault: rate-of-turn indicators are allowed 5 % (IMO A.526(13)), and the filters of many do worse.
SLOPES = (0.8, 1.25)
#: A ship that has turned through less than this shows nothing, rad.
_LEAST_TURN = float(np.deg2rad(6.0))
#: What is left over of two motions that go together.
_TOGETHER = 0.6
#: A steady turn shows a slope from so far on, rad, and the bias of a rate gyro that may lie in it, rad/s.
_STEADY_TURN, _BIAS_RAD_S = 1.5, float(np.deg2rad(0.05))
#: A ship that swings to and fro turns so many times faster than that bias, and as fast as in the window before.
_SWINGING, _SMOOTHLY = 4.0, 0.5
#: Correlation of both rates of turn, below which the one does not follow the other, whatever its scale and bias. Parts
#: of measured runs that swing have 0.75 and more.
_FOLLOWS = 0.5
_CHANNELS = ("heading", "yaw_rate")


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare the changes of the heading with the integral of the yaw rate, and the clocks of both.

    Returns
    -------
    list of Outcome
        ``heading_rate`` and ``heading_rate_clock``; empty without both channels.

    References
    ----------
    IMO resolution A.526(13) (1983): performance standards for rate-of-turn indicators.
    """
    if not log.has(_CHANNELS):
        return []
    heading, turned = log.series["heading"], integral(log.series["yaw_rate"])
    late = 1.0 + heading.period_s + turned.period_s
    names = ("heading_rate", "heading_rate_clock") if thorough else ("heading_rate",)
    if does_not_move(log):
        return [untestable(name, _CHANNELS, STILL) for name in names]
    if max(reach(heading.value), reach(turned.value)) < _LEAST_TURN:
        return [untestable(name, _CHANNELS, "the ship hardly turned") for name in names]
    alignment = align(heading, turned, (-late, late), longest_s=LONGEST_S if thorough else 0.0)
    if alignment is None or reach(heading.value) == 0.0:
        # of a compass that repeats itself the check of standstills decides
        return [untestable(name, _CHANNELS, "the heading is constant, or the two hardly overlap") for name in names]
    span = float(heading.time_utc_ns[-1] - heading.time_utc_ns[0]) / SECOND_NS
    return [
        _turning(alignment, span, another=_of_another_ship(heading, turned)),
        *([_clocks(log, alignment, (-late, late))] if thorough else []),
    ]


def _of_another_ship(heading: Series, turned: Series) -> bool:
    """Return whether a ship turns to and fro by more than noise and a gyro's bias, and the yaw rate does not follow.

    A robust slope takes the few windows of one turn among many straight ones for gross errors; a correlation is made of
    the turn.
    """
    edges = edges_of(heading, turned)
    rate, shown = (
        np.diff(angle.at(edges, gap_limit_s(angle))) / (np.diff(edges) / SECOND_NS) for angle in (heading, turned)
    )
    both = np.isfinite(rate[1:]) & np.isfinite(rate[:-1])
    if not both.any():
        return False
    away = rate - np.nanmean(rate)
    size = float(np.nanmean(away**2))
    # the noise of a heading turns round from window to window, the ship does not
    smooth = float(np.mean(away[1:][both] * away[:-1][both]))
    if np.sqrt(size) <= _SWINGING * _BIAS_RAD_S or smooth <= _SMOOTHLY * size:
        return False
    known = np.isfinite(rate) & np.isfinite(shown)
    if not known.any():
        return False
    x, y = (rates[known] - np.mean(rates[known]) for rates in (rate, shown))
    return bool(np.sum(x * y) < _FOLLOWS * np.sqrt(np.sum(x**2) * np.sum(y**2)) or not np.any(y))


def _turning(alignment: Alignment, span_s: float, *, another: bool) -> Outcome:
    slope, std = alignment.slope, alignment.slope_std
    if alignment.varying > _TOGETHER and not another:
        # of a steady turn the changes about the mean are noise: the turn itself is compared, and a bias allowed for
        if alignment.turned < _STEADY_TURN:
            return untestable("heading_rate", _CHANNELS, "the two motions are not correlated")
        slope, std = alignment.whole, float(np.hypot(alignment.whole_std, _BIAS_RAD_S * span_s / alignment.turned))
    figure = CheckFigure("integrated yaw rate over change of heading", slope, std, *SLOPES)
    words = f"the integrated yaw rate is {slope:.3g} ± {std:.2g} (1 s.e.) times the change of heading"
    suspects = [
        Fault("sign", ("yaw_rate",)),
        Fault("sign", ("heading",)),
        Fault("offset", ("heading",), np.pi / 2, "counted anticlockwise from east", simplicity=2),
        *unit_faults(("yaw_rate",), "rad/s"),
        *(Fault("unit", ("yaw_rate",), -factor, f"{name}, with the wrong sign", simplicity=2)
          for name, factor in UNITS["rad/s"].items()),
        *unit_faults(("heading",), "rad"),
    ]  # fmt: skip
    if abs(slope) > 4.0 * std and alignment.left_over < 0.5:
        suspects.append(Fault("scale", ("yaw_rate",), 1.0 / slope, "scale", std, simplicity=3))
    state = figure.state
    if alignment.left_over > _TOGETHER and figure.outside < 1.5 * SURE:
        state = "untestable"  # a slope through noise
    # a factor of 57.3 is distinguished from one of 60 by the slope it leaves
    left = min(alignment.left_over + abs(float(np.log(max(abs(slope), 1e-3)))), 1.0)
    return Outcome("heading_rate", _CHANNELS, state, words, (figure,), left, tuple(suspects))


def _clocks(log: Log, alignment: Alignment, usual_s: tuple[float, float]) -> Outcome:
    figures = clock_figures(alignment, usual_s, log.series["heading"])
    also = (BOW_AND_COURSE,) if log.has(BOW_AND_COURSE.channels) else ()
    return clock_outcome("heading_rate_clock", (("heading",), ("yaw_rate",)), alignment, figures, also)
