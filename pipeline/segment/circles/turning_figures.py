"""The figures of a turning circle, read off a track: advance, transfer, diameters, and what is steady in the turn.

The track may be measured, integrated or predicted: nothing is found, smoothed or corrected here. Lengths are those of
the track's point, for the standards the ship's midships.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi

import numpy as np

from kempf.pipeline.channels.series import Float

#: Heading change from which what is steady can be read off at all, a whole turn less what a helmsman ends it early by,
#: and from which it is taken over a whole turn, rad: there what a wind does to one side it does to the other one too.
STEADY_FROM_RAD = 2.0 * pi - pi / 18.0
WHOLE_TURN_FROM_RAD = 3.0 * pi

#: Where the steady part of a circle of less than `WHOLE_TURN_FROM_RAD` begins, rad of heading change.
_SETTLED_RAD = 1.5 * pi


@dataclass(frozen=True)
class TurningFigures:
    """What is recorded of a turning circle; NaN where the record ends before it."""

    #: Along the approach, from the execute to a heading change of 90 deg.
    advance_m: float
    #: Across the approach, positive to the side of the turn, at a heading change of 90 deg.
    transfer_m: float
    #: Across the approach at a heading change of 180 deg.
    tactical_diameter_m: float
    #: Of the steady turn: twice its mean speed divided by its mean yaw rate.
    steady_diameter_m: float
    #: Mean of the steady turn, positive to starboard.
    steady_yaw_rate_deg_s: float
    #: Mean drift angle of the steady turn, positive where the bow points into the turn.
    steady_drift_deg: float
    #: By how much the speed of the steady turn lies below the one of the approach, percent of the latter.
    speed_loss_percent: float
    #: time_to_90_s, time_to_180_s: From the execute to heading changes of 90 and 180 deg.
    time_to_90_s: float
    time_to_180_s: float
    #: Heading change of the whole record, positive to starboard.
    heading_change_deg: float


def turning_figures(
    time_s: Float,
    north_m: Float,
    east_m: Float,
    heading_rad: Float,
    speed_m_s: Float,
    drift_rad: Float,
    execute_s: float,
) -> TurningFigures:
    """Read the figures of a turning circle off a track.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Instants, increasing, s. What lies before the execute is the approach: its mean heading and speed are what the
        figures are referred to.
    north_m, east_m : ndarray, shape (n,)
        Position, m.
    heading_rad : ndarray, shape (n,)
        Heading, unwrapped, rad.
    speed_m_s : ndarray, shape (n,)
        Speed along the track, ``sqrt(u**2 + v**2)``, m/s.
    drift_rad : ndarray, shape (n,)
        Heading minus course, ``atan2(-v, u)``, rad; NaN where it is not known.
    execute_s : float
        Instant at which the rudder starts to move, s; within the record.

    Returns
    -------
    TurningFigures
        The steady ones need a heading change of 350 deg. They are means over the last whole turn of a record of 540 deg
        and more, and from 270 deg on of a shorter one.

    Raises
    ------
    ValueError
        The arrays differ in length, hold fewer than two instants, or the execute lies outside them.

    References
    ----------
    IMO MSC.137(76), section 4.2, and MSC/Circ.1053; ISO 13643-2, turning circle; ITTC 7.5-04-02-01.

    Examples
    --------
    A point that turns at once, at 1 m/s on a radius of 10 m:

    >>> t = np.linspace(0.0, 63.0, 6301)
    >>> zero = np.zeros_like(t)
    >>> made = turning_figures(t, 10 * np.sin(t / 10), 10 - 10 * np.cos(t / 10), t / 10, 1.0 + zero, zero, 0.0)
    >>> round(made.advance_m, 3), round(made.transfer_m, 3), round(made.tactical_diameter_m, 3)
    (10.0, 10.0, 20.0)
    """
    columns = (north_m, east_m, heading_rad, speed_m_s, drift_rad)
    if time_s.ndim != 1 or time_s.size < 2 or any(column.shape != time_s.shape for column in columns):
        raise ValueError("a track has two instants at least, and a value of each column for each of them")
    if not time_s[0] <= execute_s <= time_s[-1]:
        raise ValueError(f"the execute at {execute_s} s lies outside the track, {time_s[0]} to {time_s[-1]} s")
    before, after = time_s <= execute_s, time_s >= execute_s
    course, approach_m_s = float(np.mean(heading_rad[before])), float(np.mean(speed_m_s[before]))
    side = 1.0 if heading_rad[-1] >= course else -1.0
    t, turned = time_s[after], side * (heading_rad[after] - course)
    north, east = (column[after] - np.interp(execute_s, time_s, column) for column in (north_m, east_m))
    along = north * np.cos(course) + east * np.sin(course)
    across = side * (east * np.cos(course) - north * np.sin(course))
    quarter, half = (_first_reaching(t, turned, angle) for angle in (pi / 2, pi))
    rate, speed, drift = _steady(t, turned, speed_m_s[after], drift_rad[after])
    return TurningFigures(
        advance_m=_at(quarter, t, along),
        transfer_m=_at(quarter, t, across),
        tactical_diameter_m=_at(half, t, across),
        steady_diameter_m=2.0 * speed / rate if rate > 0 else nan,
        steady_yaw_rate_deg_s=side * float(np.rad2deg(rate)),
        steady_drift_deg=side * float(np.rad2deg(drift)),
        speed_loss_percent=100.0 * (1.0 - speed / approach_m_s) if approach_m_s > 0 else nan,
        time_to_90_s=quarter - execute_s,
        time_to_180_s=half - execute_s,
        heading_change_deg=side * float(np.rad2deg(turned[-1])),
    )


def steady_span(time_s: Float, turned_rad: Float) -> tuple[float, float]:
    """Return from when to when a turn counts as steady.

    Parameters
    ----------
    time_s, turned_rad : ndarray, shape (n,)
        Instants from the execute on, s, and heading change, positive to the side of the turn, rad.

    Returns
    -------
    tuple of float
        The last whole turn of 540 deg and more, from 270 deg on of a shorter one, s; NaN for less than 350 deg.
    """
    last = int(np.argmax(turned_rad))
    reached = float(turned_rad[last])
    if not reached >= STEADY_FROM_RAD:
        return nan, nan
    begin = reached - 2.0 * pi if reached >= WHOLE_TURN_FROM_RAD else _SETTLED_RAD
    return _first_reaching(time_s, turned_rad, begin), float(time_s[last])


def _first_reaching(time_s: Float, turned: Float, angle: float) -> float:
    """Return when the heading has changed by an angle for the first time, s; NaN where it does not."""
    there = np.flatnonzero(turned >= angle)
    if not there.size:
        return nan
    k = int(there[0])
    if k == 0:
        return float(time_s[0])
    share = (angle - turned[k - 1]) / (turned[k] - turned[k - 1])
    return float(time_s[k - 1] + share * (time_s[k] - time_s[k - 1]))


def _steady(time_s: Float, turned: Float, speed: Float, drift: Float) -> tuple[float, float, float]:
    """Return yaw rate, rad/s, to the side of the turn, speed, m/s, and drift, rad, as means over the steady part."""
    start, end = steady_span(time_s, turned)
    if not end > start:
        return nan, nan, nan
    t = np.concatenate([[start], time_s[(time_s > start) & (time_s <= end)]])
    means = [float(np.trapezoid(np.interp(t, time_s, values), t) / (end - start)) for values in (speed, drift)]
    change = float(np.interp(end, time_s, turned) - np.interp(start, time_s, turned))
    return change / (end - start), means[0], means[1]


def _at(instant_s: float, time_s: Float, values: Float) -> float:
    return float(np.interp(instant_s, time_s, values)) if np.isfinite(instant_s) else nan
