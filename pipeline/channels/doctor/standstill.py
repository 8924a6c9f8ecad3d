"""A heading or yaw rate that repeats one reading while the ship turns, a log while her speed over ground changes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import Log, integral
from kempf.pipeline.channels.doctor.motion import does_not_move, stream_std
from kempf.pipeline.channels.doctor.outcome import STILL, CheckFigure, Outcome, untestable
from kempf.pipeline.channels.doctor.robust_regression import quantile, reach
from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.units import SECOND_NS

#: A channel stands still when it repeats itself so long, in so many readings, while the ship turns so far.
_LEAST_S, _LEAST_READINGS, _TURN_DEG = 10.0, 10, 5.0
_TURN_RAD = float(np.deg2rad(_TURN_DEG))
#: The course also swings with drift and stream: it has to turn so many times as far.
_COURSE = 3.0
#: No rate gyro has a larger bias, rad/s: its integral turns no farther than that by itself.
_BIAS_RAD_S = float(np.deg2rad(0.05))
#: Of many times at which a coarse channel repeats itself, the longest are looked at.
_MOST = 50
#: A heading that swings less than this in the whole log while the ship swings five times as far is noise.
_DEAD_RAD, _UNLIKE = float(np.deg2rad(1.0)), 0.5
#: A log that repeats itself for so long is looked at, s; the speed over ground is compared in means over so long, s,
#: and so much of it may change without the log, as a share of it, one standard error of that, in streams' deviations.
_LOG_S, _MEAN_S, _CHANGE, _CHANGE_STD, _STREAMS = 60.0, 10.0, 0.1, 0.02, 2.0
#: A log shows nothing below this share of the speed over ground; it is a fine one with steps below that one, and may
#: then not stand still while she turns farther than so many degrees.
_NOTHING, _FINE, _LOG_TURN_DEG = 0.02, 0.002, 20.0


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Find the times at which heading, yaw rate or the speed through the water stand still.

    Returns
    -------
    list of Outcome
        ``heading_standstill``, compared with the yaw rate, else with the course; ``yaw_rate_standstill``;
        ``speed_through_water_standstill``, compared with the speed over ground.
    """
    return [*_of_turning(log), *_of_water_speed(log)]


def _of_turning(log: Log) -> list[Outcome]:
    heading, rate, velocity = log.series.get("heading"), log.series.get("yaw_rate"), log.velocity("course")
    if heading is None or (rate is None and velocity is None):
        return []
    if does_not_move(log):
        others = [("yaw_rate", "heading")] if rate is not None else []
        pairs = [("heading", "yaw_rate" if rate is not None else "course_over_ground"), *others]
        return [untestable(f"{channel}_standstill", (channel, reference), STILL) for channel, reference in pairs]
    way = None if velocity is None else Series(velocity.time_utc_ns, velocity.under_way.astype(np.float64))
    if rate is None:
        assert velocity is not None
        course = Series(velocity.time_utc_ns, velocity.direction)
        standstill = _heading_turns(heading, course, way, _COURSE * _TURN_RAD)
        return [_judged("heading", "course_over_ground", standstill, reach(course.value))]
    turn = integral(rate)
    return [
        _judged("heading", "yaw_rate", _heading_turns(heading, turn, way, _TURN_RAD, _BIAS_RAD_S), reach(turn.value)),
        _judged("yaw_rate", "heading", _rate_turns(rate, heading, way), reach(heading.value)),
    ]


def _judged(channel: str, reference: str, standstill: tuple[Series, float] | None, in_all: float) -> Outcome:
    name, channels = f"{channel}_standstill", (channel, reference)
    if standstill is None and in_all < 2.0 * _TURN_RAD:
        return untestable(name, channels, "the ship hardly turned")
    turned = 0.0 if standstill is None else standstill[1]
    figure = CheckFigure("turn while the channel is constant", float(np.rad2deg(turned)), 0.1, 0.0, _TURN_DEG, "deg")
    if standstill is None:
        # that a reading moves says nothing of its zero or its sense
        words = f"{channel} is never constant while the ship turns"
        return Outcome(name, channels, "agree", words, (figure,), alone=True)
    start, end = int(standstill[0].time_utc_ns[0]), int(standstill[0].time_utc_ns[-1])
    words = (
        f"{channel} is constant for {(end - start) / SECOND_NS:.0f} s, during which the ship turns by "
        f"{figure.value:.0f} deg according to {reference}"
    )
    fault = Fault("stuck", (channel,), (end - start) / SECOND_NS, start_utc_ns=start)
    return Outcome(name, channels, "disagree", words, (figure,), 1.0, (fault,))


def _of_water_speed(log: Log) -> list[Outcome]:
    water, ground = log.series.get("speed_through_water"), log.series.get("speed_over_ground")
    if water is None or ground is None:
        return []
    name, channels = "speed_through_water_standstill", ("speed_through_water", "speed_over_ground")
    if does_not_move(log):
        return [untestable(name, channels, STILL)]
    found = [(still, *missed) for still in _repeats(water, None) if (missed := _missed(log, still, ground)) is not None]
    worst = max(found, key=lambda one: one[1].outside, default=None)
    if worst is None or worst[1].state != "disagree":
        words = "speed_through_water is never constant while the ship's speed changes"
        return [Outcome(name, channels, "agree", words, alone=True)]
    still, figure, meanwhile = worst
    start, end = int(still.time_utc_ns[0]), int(still.time_utc_ns[-1])
    long = (end - start) / SECOND_NS
    words = f"speed_through_water is constant, {still.value[0]:.3g} m/s, for {long:.0f} s, during which {meanwhile}"
    fault = Fault("stuck", ("speed_through_water",), long, start_utc_ns=start)
    return [Outcome(name, channels, "disagree", words, (figure,), 1.0, (fault,))]


def _missed(log: Log, still: Series, ground: Series) -> tuple[CheckFigure, str] | None:
    """Return what the speed over ground does beyond a stream while a log repeats itself, and that in words."""
    start, end = int(still.time_utc_ns[0]), int(still.time_utc_ns[-1])
    speed = _means(ground.between(start, end))
    if speed.size < 2 or end - start <= _LOG_S * SECOND_NS:
        return None
    usual = float(np.median(speed))
    stream = _STREAMS * stream_std(log, quantile(np.abs(ground.value), 0.9))
    if abs(float(still.value[0])) < _NOTHING * usual:
        figure = CheckFigure(
            "speed over ground while the log shows none", usual, _CHANGE_STD * usual, 0.0, 2.0 * stream, "m/s"
        )
        return figure, f"the speed over ground is {usual:.3g} m/s"
    heading = log.series["heading"].between(start, end).value if "heading" in log.series else np.zeros(0)
    swing = reach(heading) if heading.size else 1.0
    steps = np.abs(np.diff(log.series["speed_through_water"].value))
    rounding = float(np.min(steps[steps > 0.0], initial=usual))
    if rounding < _FINE * usual and heading.size:
        # a turn costs speed, and no log that shows a thousandth of it misses that
        turn = CheckFigure("turn while the log is constant", float(np.rad2deg(swing)), 1.0, 0.0, _LOG_TURN_DEG, "deg")
        return turn, f"the ship turns by {turn.value:.0f} deg"
    allowed = rounding + _CHANGE * usual + stream * min(swing, 2.0)
    change = float(np.ptp(speed))
    figure = CheckFigure(
        "change of speed over ground while the log is constant", change, _CHANGE_STD * usual, 0.0, allowed, "m/s"
    )
    return figure, f"the speed over ground changes by {change:.3g} m/s"


def _means(series: Series) -> Float:
    """Return means of a series over `_MEAN_S` each."""
    if not len(series):
        return series.value
    which = np.floor(series.seconds_since(int(series.time_utc_ns[0])) / _MEAN_S).astype(np.int64)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(which) > 0]))
    means: Float = np.add.reduceat(series.value, starts) / np.diff(np.append(starts, which.size))
    return means


def _repeats(series: Series, way: Series | None) -> Iterator[Series]:
    """Yield the times under way at which a channel repeats one reading, the longest first."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(series.value) != 0.0) + 1, [len(series)]])
    first, last = edges[:-1], edges[1:] - 1
    long = series.time_utc_ns[last] - series.time_utc_ns[first]
    enough = np.flatnonzero((long >= _LEAST_S * SECOND_NS) & (last - first >= _LEAST_READINGS))
    for k in enough[np.argsort(-long[enough], kind="stable")][:_MOST]:
        start, end = int(series.time_utc_ns[first[k]]), int(series.time_utc_ns[last[k]])
        under_way = None if way is None else way.between(start, end).value
        if under_way is None or not under_way.size or float(np.mean(under_way)) > 0.5:
            yield series.between(start, end)


def _heading_turns(
    heading: Series, turn: Series, way: Series | None, least: float, bias_rad_s: float = 0.0
) -> tuple[Series, float] | None:
    """Return the longest standstill of a heading and how far the ship turns in it, rad; None where there is none."""
    if reach(heading.value) < _DEAD_RAD and len(turn) > _LEAST_READINGS and _turned(turn, bias_rad_s) > 5.0 * _DEAD_RAD:
        along = np.interp(heading.time_utc_ns, turn.time_utc_ns, turn.value)
        if np.ptp(heading.value) == 0.0 or abs(float(np.corrcoef(along, heading.value)[0, 1])) < _UNLIKE:
            return heading, _turned(turn, bias_rad_s)
    for still in _repeats(heading, way):
        meanwhile = turn.between(int(still.time_utc_ns[0]), int(still.time_utc_ns[-1]))
        if len(meanwhile) > 2 and (turned := _turned(meanwhile, bias_rad_s)) > least:
            return still, turned
    return None


def _turned(turn: Series, bias_rad_s: float) -> float:
    """Return how far a direction turns beyond what a bias of its rate makes of it, rad."""
    seconds = turn.seconds_since(int(turn.time_utc_ns[0]))
    straight = np.polynomial.polynomial.polyfit(seconds, turn.value, 1)
    bent = reach(turn.value - np.polynomial.polynomial.polyval(seconds, straight)) if bias_rad_s else 0.0
    return max(bent, reach(turn.value) - bias_rad_s * float(seconds[-1]))


def _rate_turns(rate: Series, heading: Series, way: Series | None) -> tuple[Series, float] | None:
    """Return the longest standstill of a yaw rate and how far the heading departs from its integral, rad."""
    steps = np.abs(np.diff(rate.value))
    rounding = float(np.min(steps[steps > 0.0], initial=np.inf))
    for still in _repeats(rate, way):
        start, end = int(still.time_utc_ns[0]), int(still.time_utc_ns[-1])
        meanwhile = heading.between(start, end)
        if len(meanwhile) < 2:
            continue
        # a steady turn repeats its rate, and the heading turns with it; a coarse rate is right within a step
        missed = reach(meanwhile.value - still.value[0] * meanwhile.seconds_since(start))
        missed -= rounding * (end - start) / SECOND_NS if np.isfinite(rounding) else 0.0
        if missed > _TURN_RAD:
            return still, missed
    return None
