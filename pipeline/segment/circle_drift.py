"""The drift of a turning circle: how far the ship is set between two passages of one heading, turn after turn.

A uniform current sets her so, and a steady wind. A current sets her in the approach too, by as much; a wind, which she
meets there at full speed, hardly does: only a drift that the approach shows as well is one of the water.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi, sqrt

import numpy as np

from kempf.pipeline.segment.turn_track import TurnTrack

#: Heading change from which on passages are compared, and the one a record must reach, rad: the last pair of passages
#: lies 360 deg apart, and 60 deg of pairs are needed to see how far they agree.
_FROM_RAD = pi
SHORTEST_RAD = _FROM_RAD + 2.0 * pi + pi / 3

#: Largest difference between the set of the approach and the one of the circle, as a share of the latter, and the
#: standard error of a heading over it, rad: both are allowed for.
_APART_SHARE, _HEADING_STD_RAD = 1.0 / 3.0, float(np.deg2rad(0.5))

_STEP_RAD = float(np.deg2rad(2.0))


@dataclass(frozen=True)
class CircleDrift:
    """A uniform stream and its standard error a component."""

    #: north_m_s, east_m_s: Where it sets, m/s.
    north_m_s: float
    east_m_s: float
    #: Standard error of either, m/s.
    std_m_s: float


def circle_drift(track: TurnTrack, execute_s: float, course_rad: float) -> CircleDrift | None:
    """Estimate by how much a circle drifts.

    Parameters
    ----------
    track : TurnTrack
        Over ground.
    execute_s : float
        Instant of the execute, s.
    course_rad : float
        Heading of the approach, rad.

    Returns
    -------
    CircleDrift or None
        None for a heading change of less than 600 deg.

    Notes
    -----
    A circle that still widens or narrows adds to each pair a step along its heading. Over pairs of a whole turn it
    averages out; over fewer the standard error is as large as that step, which the spread of the pairs shows.

    References
    ----------
    ITTC 7.5-04-02-01, Full scale manoeuvring trials, correction for current; MSC/Circ.1053.
    """
    after = track.time_s >= execute_s
    change = track.heading_rad[after] - course_rad
    side = 1.0 if change[-1] >= 0 else -1.0
    turned = np.maximum.accumulate(side * change)
    if turned[-1] < SHORTEST_RAD:
        return None
    # a heading at rest has no inverse
    rising = np.concatenate([[True], np.diff(turned) > 0])
    turned, time_s = turned[rising], track.time_s[after][rising]
    angle = np.arange(_FROM_RAD, turned[-1] - 2.0 * pi, _STEP_RAD)
    begin, end = (np.interp(angle + shift, turned, time_s) for shift in (0.0, 2.0 * pi))
    set_m_s = np.column_stack(
        [
            (np.interp(end, track.time_s, column) - np.interp(begin, track.time_s, column)) / (end - begin)
            for column in (track.north_m, track.east_m)
        ]
    )
    mean = np.mean(set_m_s, axis=0)
    spread = float(np.sqrt(np.mean((set_m_s - mean) ** 2)))
    # a vector that turns through an arc deviates from its mean by its length times the arc through the root of twelve
    arc = float(angle[-1] - angle[0])
    return CircleDrift(float(mean[0]), float(mean[1]), spread * sqrt(12.0) / min(arc, sqrt(12.0)))


def is_current(drift: CircleDrift, track: TurnTrack, execute_s: float) -> bool:
    """Whether the approach was set across its heading as the circle is.

    Parameters
    ----------
    drift : CircleDrift
        Of the circle.
    track : TurnTrack
        Over ground; what lies before the execute is a steady approach.
    execute_s : float
        Instant of the execute, s.

    Returns
    -------
    bool
        False where both differ by more than a third of the drift and by more than two standard errors. What sets along
        the approach is not seen there, and not contradicted.
    """
    before = track.time_s <= execute_s
    heading = float(np.mean(track.heading_rad[before]))
    across = -track.speed_m_s[before] * np.sin(track.drift_rad[before])
    expected = drift.east_m_s * np.cos(heading) - drift.north_m_s * np.sin(heading)
    # neighbouring values say the same: four of them count
    error = hypot(
        drift.std_m_s, float(np.std(across)) / 2.0, _HEADING_STD_RAD * float(np.mean(track.speed_m_s[before]))
    )
    apart = abs(float(np.mean(across)) - float(expected))
    return apart <= max(_APART_SHARE * hypot(drift.north_m_s, drift.east_m_s), 2.0 * error)
