"""Whether the instruments of a segment contradict each other: units, signs, a channel that stands still.

Several instruments see one motion: the heading is the yaw rate's integral, the course follows the heading, the track is
the integral of the velocity. Thresholds lie far from what noise, drift and a stream do; what a stream might do
is said, not refused. A channel that is not needed is left out, one that is needed makes the segment unusable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.lateral_speed import LateralSpeed
from kempf.pipeline.channels.series import SECOND_NS, Float, Series
from kempf.pipeline.estimate.record.checks import swing
from kempf.pipeline.estimate.record.slopes import Slope, integral_at, slope, windows
from kempf.schemas.errors import DataRejected

#: slopes of the yaw rate's integral on the heading that are no mistake
_ALIKE = (0.8, 1.25)
#: how near a known factor a slope must be to be told for it
_NEAR = 0.12
#: what a factor of the yaw rate means: the unit that the log has, and the one that was taken for it
_RATE_UNITS = {
    180.0 / np.pi: "deg/s",
    np.pi / 180.0: "rad/s",
    60.0: "deg/min",
    1.0 / 60.0: "deg/s",
    60.0 * 180.0 / np.pi: "deg/min",
    np.pi / 180.0 / 60.0: "rad/s",
}
#: the same for a speed
_SPEED_UNITS = {3600.0 / 1852.0: "kn", 1852.0 / 3600.0: "m/s", 3.6: "km/h", 1.0 / 3.6: "m/s"}
_SPEED_NEAR = 0.08
#: no stream is faster, m/s: what two speeds differ by beyond this is a mistake
_FASTEST_STREAM_M_S = 2.5
#: a channel stands still when it repeats itself so long while the ship turns so far
_STILL_S, _STILL_READINGS, _STILL_TURN_RAD = 10.0, 10, float(np.deg2rad(5.0))
#: a heading that swings less than this while the ship swings five times as far is dead
_DEAD_RAD = float(np.deg2rad(1.0))
#: median angles between course and heading: beyond the first it is said, beyond the second the segment is refused
_CRAB_RAD, _LOST_RAD = float(np.deg2rad(30.0)), float(np.deg2rad(45.0))
#: shortest way, m, over which fixes tell a speed, and radius of the earth, m
_SHORTEST_WAY_M, _EARTH_M = 30.0, 6.371e6
_PROFILE = "in the vessel profile (a log that describes itself, such as NMEA, is mended where it is made)"


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels of one segment that are compared; None where the log lacks one. SI, angles unwrapped."""

    heading: Series
    course: Series
    ground_speed: Series
    yaw_rate: Series | None
    water_speed: Series | None
    latitude: Series | None
    longitude: Series | None


def check_agreement(channels: Channels, lateral: LateralSpeed) -> tuple[Series | None, tuple[str, ...]]:
    """Compare the instruments of a segment.

    Parameters
    ----------
    channels : Channels
    lateral : LateralSpeed
        Of the same segment.

    Returns
    -------
    yaw_rate : Series or None
        The yaw rate where it can be used.
    warnings : tuple of str

    Raises
    ------
    DataRejected
        ``heading_stuck``, ``heading_unit``, ``heading_sign``, ``yaw_rate_unit``, ``yaw_rate_sign``,
        ``course_not_along_heading``, ``speed_unit``.
    """
    yaw_rate, warnings = _checked_rate(channels)
    _check_still_heading(channels.heading, yaw_rate, channels.course)
    warnings += _check_course(lateral)
    # the speed over ground first: the log is compared with it
    warnings += _check_track(channels)
    warnings += _check_water_speed(channels, lateral)
    return yaw_rate, tuple(warnings)


def _check_still_heading(heading: Series, rate: Series | None, course: Series) -> None:
    """Hold the heading against what else tells how far the ship turns: the yaw rate's integral, else the course."""
    turn, name, shows = course, "the course", 3.0 * _STILL_TURN_RAD
    if rate is not None:
        steps = np.nan_to_num(integral_at(rate, rate.time_utc_ns))
        turn = Series(rate.time_utc_ns, np.concatenate([[0.0], np.cumsum(steps)]))
        name, shows = "the yaw rate's integral", _STILL_TURN_RAD
    own, other = swing(heading.value), swing(turn.value)
    both = slope(*_changes(heading, turn))
    if own < _DEAD_RAD and other > 5.0 * _DEAD_RAD and (both is None or not both.together):
        raise _still(own, float(np.ptp(heading.time_utc_ns)) / SECOND_NS, name, other, int(heading.time_utc_ns[0]))
    first, last = _longest_repeat(heading)
    start, end = int(heading.time_utc_ns[first]), int(heading.time_utc_ns[last])
    meanwhile = turn.between(start, end).value
    turned = swing(meanwhile) if meanwhile.size else 0.0
    if (end - start) / SECOND_NS >= _STILL_S and last - first >= _STILL_READINGS and turned > shows:
        raise _still(0.0, (end - start) / SECOND_NS, name, turned, start)


def _still(changed_rad: float, duration_s: float, name: str, turned_rad: float, start_ns: int) -> DataRejected:
    return DataRejected(
        "heading_stuck",
        f"The heading changes by {np.rad2deg(changed_rad):.2g} deg in {duration_s:.0f} s, in which {name} changes by "
        f"{np.rad2deg(turned_rad):.0f} deg: the compass stands still.",
        "Identification needs a working heading: repair the compass or map another one, and repeat the manoeuvre; "
        "where it stands still for a while only, identify the part before or after.",
        {"from_utc_ns": start_ns, "duration_s": duration_s, "turned_rad": turned_rad},
    )


def _longest_repeat(series: Series) -> tuple[int, int]:
    """Return the first and last index of the longest run of equal readings."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(series.value) != 0.0) + 1, [len(series)]])
    lengths = series.time_utc_ns[edges[1:] - 1] - series.time_utc_ns[edges[:-1]]
    longest = int(np.argmax(lengths))
    return int(edges[longest]), int(edges[longest + 1]) - 1


def _changes(one: Series, other: Series) -> tuple[Float, Float]:
    edges = windows(one, other)
    x, y = (np.diff(each.at(edges, gap_limit_s(each))) for each in (one, other))
    return x, y


def _checked_rate(channels: Channels) -> tuple[Series | None, list[str]]:
    """Hold the yaw rate against the heading."""
    rate, heading = channels.yaw_rate, channels.heading
    if rate is None:
        return None, []
    first, last = _longest_repeat(rate)
    start, end = int(rate.time_utc_ns[first]), int(rate.time_utc_ns[last])
    meanwhile = heading.between(start, end)
    if (end - start) / SECOND_NS >= _STILL_S and last - first >= _STILL_READINGS and len(meanwhile):
        # a steady turn repeats its rate, and the heading goes with it
        missed = swing(meanwhile.value - rate.value[first] * meanwhile.seconds_since(start))
        if missed > _STILL_TURN_RAD:
            said = f"the yaw rate stands still for {(end - start) / SECOND_NS:.0f} s while the heading turns"
            return None, [f"{said}: the channel is left out, the yaw rate is estimated through the heading"]
    edges = windows(heading, rate)
    found = slope(np.diff(heading.at(edges, gap_limit_s(heading))), integral_at(rate, edges))
    if found is None:
        return rate, []
    if not found.together:
        return rate, ["yaw rate and heading hardly go together: one of them is wrong, or both are mostly noise"]
    if _ALIKE[0] <= found.value <= _ALIKE[1]:
        return rate, []
    _refuse_rate(found, slope(*_changes(heading, channels.course)))
    return rate, [f"the yaw rate adds up to {found.value:.2f} of what the heading turns: one of the two is mis-scaled"]


def _refuse_rate(rate: Slope, course: Slope | None) -> None:
    """Refuse a slope of the rate's integral on the heading that a wrong unit or sign explains."""
    unit = _nearest(abs(rate.value), _RATE_UNITS, _NEAR)
    if unit is None and not -_ALIKE[1] <= rate.value <= -_ALIKE[0]:
        return
    # the course turns with the ship too: where it contradicts the heading as the rate does, the heading is wrong
    backwards = course is not None and course.together and course.value < 0.0
    heading_small = unit is not None and rate.value > 20.0 and course is not None and course.value > 10.0
    found = f"The yaw rate adds up to {rate.value:.3g} times what the heading turns, expected is 1"
    details = {"slope": rate.value, "course_slope": None if course is None else course.value}
    if heading_small:
        raise DataRejected(
            "heading_unit",
            f"{found}; the course turns so much more than the heading too: radians were taken for degrees.",
            f"Write `unit: rad` for heading {_PROFILE}.",
            details,
        )
    if unit is not None:
        turned = ", and `positive: port`" if rate.value < 0.0 else ""
        raise DataRejected(
            "yaw_rate_unit",
            f"{found}: the log counts it in {unit}.",
            f"Write `unit: {unit}`{turned} for yaw_rate {_PROFILE}.",
            details,
        )
    wrong = "heading" if backwards else "yaw_rate"
    raise DataRejected(
        "heading_sign" if backwards else "yaw_rate_sign",
        f"{found}: the sign of {wrong} is wrong.",
        f"Write `positive: port` for {wrong} {_PROFILE}.",
        details,
    )


def _nearest(value: float, known: dict[float, str], near: float) -> str | None:
    """Return what the known factor nearest to a value means; None where it is farther than a share off."""
    if value <= 0.0:
        return None
    factor = min(known, key=lambda one: abs(np.log(value / one)))
    return known[factor] if abs(np.log(value / factor)) < np.log1p(near) else None


def _check_course(lateral: LateralSpeed) -> list[str]:
    """Hold the course against the heading: a ship goes where her bow points, give or take drift and stream."""
    drift = np.abs(lateral.drift_rad[np.isfinite(lateral.drift_rad)])
    usual = float(np.median(drift)) if drift.size else 0.0
    shown = f"the course over ground lies {np.rad2deg(usual):.0f} deg off the heading in the median"
    if usual > _LOST_RAD:
        raise DataRejected(
            "course_not_along_heading",
            f"{shown.capitalize()}; a ship under way ahead stays within {np.rad2deg(_LOST_RAD):.0f}.",
            f"Check unit, sign and offset of heading and course_over_ground {_PROFILE}, and whether she went astern; "
            "in a stream as fast as the ship, repeat at higher speed.",
            {"median_angle_rad": usual},
        )
    if usual > _CRAB_RAD:
        return [f"{shown}: a strong stream, or a heading or course that is turned"]
    return []


def _check_track(channels: Channels) -> list[str]:
    """Hold the speed over ground against the way between the fixes."""
    latitude, longitude = channels.latitude, channels.longitude
    speed, course = channels.ground_speed, channels.course
    if latitude is None or longitude is None:
        return []
    along = speed.at(course.time_utc_ns, gap_limit_s(speed))
    known = np.isfinite(along)
    time, along, direction = course.time_utc_ns[known], along[known], course.value[known]
    if time.size < 2:
        return []
    way = float(np.median(along)) * float(time[-1] - time[0]) / SECOND_NS
    velocity = [Series(time, along * np.cos(direction)), Series(time, along * np.sin(direction))]
    edges = windows(latitude, longitude, *velocity, most=int(min(60.0, way / _SHORTEST_WAY_M)))
    if edges.size == 0:
        return []
    told = np.hypot(*(integral_at(one, edges) for one in velocity))
    north, east = (_EARTH_M * np.diff(one.at(edges, gap_limit_s(one))) for one in (latitude, longitude))
    sailed = np.hypot(north, east * np.cos(float(np.median(latitude.value))))
    both = np.isfinite(told) & np.isfinite(sailed) & (sailed > 0.0)
    if not both.any():
        return []
    ratio = float(np.median(told[both] / sailed[both]))
    unit = _nearest(ratio, _SPEED_UNITS, _SPEED_NEAR)
    if unit is not None:
        raise DataRejected(
            "speed_unit",
            f"The speed over ground adds up to {ratio:.2f} times the way between the fixes: the log counts it in "
            f"{unit}.",
            f"Write `unit: {unit}` for speed_over_ground {_PROFILE}.",
            {"ratio": ratio},
        )
    if not _ALIKE[0] <= ratio <= _ALIKE[1]:
        return [f"the speed over ground adds up to {ratio:.2f} times the way between the fixes"]
    return []


def _check_water_speed(channels: Channels, lateral: LateralSpeed) -> list[str]:
    """Hold the log against the speed over ground along the bow; what differs should be a stream."""
    log = channels.water_speed
    forward = lateral.forward_m_s[np.isfinite(lateral.forward_m_s)]
    if log is None or forward.size == 0:
        return []
    water, ground = float(np.median(log.value)), float(np.median(forward))
    if not (water > 0.0 and ground > 0.0):
        return []
    unit = _nearest(water / ground, _SPEED_UNITS, _SPEED_NEAR)
    if abs(water - ground) > _FASTEST_STREAM_M_S and unit is not None:
        raise DataRejected(
            "speed_unit",
            f"The speed through the water is {water:.2f} m/s where the ship makes {ground:.2f} m/s over ground, "
            f"{water / ground:.2f} times as much, more than a stream explains: one of the two is in {unit}.",
            f"Write `unit: {unit}` for speed_through_water {_PROFILE}; if its unit is right, look at that of "
            "speed_over_ground.",
            {"through_water_m_s": water, "over_ground_m_s": ground},
        )
    if abs(water - ground) > _FASTEST_STREAM_M_S or unit is not None:
        reason = f"in {unit}, or " if unit is not None else ""
        return [
            f"the log reads {water:.2f} m/s where the ship makes {ground:.2f} m/s over ground: one of them is {reason}"
            "wrong, or the stream is strong"
        ]
    return []
