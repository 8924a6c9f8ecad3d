"""The drift of a turning circle: how far the ship is set between two passages of one heading, turn after turn.

A uniform current sets her so, and a steady wind. A water log separates the two: over ground she is faster than
through the water when she heads with a current, while a wind changes both speeds alike. So it shows the current of a
circle, too, that is too short for two passages of many headings.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi, sin, sqrt

import numpy as np

from kempf.pipeline.channels.series import Mask
from kempf.pipeline.segment.circles.turn_track import TurnTrack

#: Heading change from which on passages are compared, at most over the last two turns, and the one a record must reach,
#: rad: the last pair of passages lies 360 deg apart, and 60 deg of pairs are needed to see how far they agree.
_FROM_RAD = pi
SHORTEST_RAD = _FROM_RAD + 2.0 * pi + pi / 3

#: Largest difference between the current that the water log shows and the drift of the circle, as a share of that.
_APART_SHARE = 1.0 / 3.0

#: Factor on the standard error, since the step of a circle that narrows dies away, and the smallest share of the spread
#: that is left over pairs of a whole turn.
_DYING, _SMALLEST_SHARE = 1.5, 0.25

_STEP_RAD = float(np.deg2rad(2.0))

#: Heading change from which on the water log shows a current by itself, rad, and the parts of it that are left out one
#: after the other to see how well. Fewer readings than that show nothing.
_LOGGED_FROM_RAD, _PARTS, _FEWEST = 5.0 * pi / 3.0, 8, 20

#: standard errors of a component from which a current is seen by the log alone
_SEEN_BY_LOG = 2.5


@dataclass(frozen=True)
class CircleDrift:
    """A uniform stream and its standard error a component."""

    #: north_m_s, east_m_s: Where it sets, m/s.
    north_m_s: float
    east_m_s: float
    #: Standard error of either, m/s.
    std_m_s: float

    @property
    def size_m_s(self) -> float:
        """Its size, m/s."""
        return hypot(self.north_m_s, self.east_m_s)

    @property
    def seen_by_log(self) -> bool:
        """Whether a current that the water log shows by itself is one; by chance one is seen in 4 % of turns."""
        return self.size_m_s > _SEEN_BY_LOG * self.std_m_s

    @property
    def seen(self) -> bool:
        """Whether it is larger than two standard errors."""
        return self.size_m_s > 2.0 * self.std_m_s


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
    averages out; over fewer the standard error is what is left of it, which the spread of the pairs shows. The step
    dies away meanwhile, hence half as much again, and never less than three eighths of the spread.

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
    angle = np.arange(max(_FROM_RAD, float(turned[-1]) - 4.0 * pi), turned[-1] - 2.0 * pi, _STEP_RAD)
    begin, end = (np.interp(angle + shift, turned, time_s) for shift in (0.0, 2.0 * pi))
    set_m_s = np.column_stack(
        [
            (np.interp(end, track.time_s, column) - np.interp(begin, track.time_s, column)) / (end - begin)
            for column in (track.north_m, track.east_m)
        ]
    )
    mean = np.mean(set_m_s, axis=0)
    spread = float(np.sqrt(np.mean((set_m_s - mean) ** 2)))
    # of a vector of constant length that turns through an arc the mean is this share, the deviation what is left of 1
    half_arc = float(angle[-1] - angle[0]) / 2.0
    share = abs(sin(half_arc)) / half_arc
    return CircleDrift(
        float(mean[0]), float(mean[1]), _DYING * spread * max(share / sqrt(1.0 - share**2), _SMALLEST_SHARE)
    )


def is_current(drift: CircleDrift, track: TurnTrack, execute_s: float) -> bool:
    """Whether the water log shows that it is the water that drifts.

    Parameters
    ----------
    drift : CircleDrift
        Of the circle.
    track : TurnTrack
        Over ground, with the water log's speed.
    execute_s : float
        Instant of the execute, s.

    Returns
    -------
    bool
        True where the difference between the speed over ground along the bow and the water log's goes with the heading
        as the drift says, to within a third of it or two standard errors; False also where there is no water log.
    """
    known = (track.time_s >= execute_s) & np.isfinite(track.log_m_s)
    if np.count_nonzero(known) < _FEWEST:
        return False
    north, east = _by_log(track, known)
    apart = hypot(float(north) - drift.north_m_s, float(east) - drift.east_m_s)
    return apart <= max(_APART_SHARE * drift.size_m_s, 2.0 * drift.std_m_s)


def current_by_log(track: TurnTrack, execute_s: float, course_rad: float) -> CircleDrift | None:
    """Estimate a uniform current by the water log, from speeds over ground and through the water.

    Parameters
    ----------
    track : TurnTrack
        Over ground, from the approach on, with the water log's speed.
    execute_s : float
        Instant of the execute, s.
    course_rad : float
        Heading of the approach, rad.

    Returns
    -------
    CircleDrift or None
        With the jackknife's standard error over the approach and eight parts of the turn (Efron & Stein 1981, Annals of
        Statistics 9), what changes from part to part included. None where there is no water log, and for a heading
        change of less than 300 deg.
    """
    known = np.isfinite(track.log_m_s) & np.isfinite(track.speed_m_s)
    turned = np.abs(track.heading_rad - course_rad)
    turned[track.time_s < execute_s] = -1.0
    last = float(turned[-1])
    if last < _LOGGED_FROM_RAD or np.count_nonzero(known) < _FEWEST:
        return None
    # the approach is a part of its own
    part = np.where(turned < 0.0, _PARTS, np.minimum(turned * _PARTS / last, _PARTS - 1)).astype(np.int64)
    parts = [number for number in range(_PARTS + 1) if np.any(known & (part == number))]
    if len(parts) < _PARTS:
        return None
    without = np.array([_by_log(track, known & (part != number)) for number in parts])
    scatter = np.sum((without - np.mean(without, axis=0)) ** 2, axis=0)
    std = float(np.sqrt(np.max(scatter) * (len(parts) - 1) / len(parts)))
    north, east = _by_log(track, known)
    return CircleDrift(north, east, std)


def _by_log(track: TurnTrack, known: Mask) -> tuple[float, float]:
    """Return the current towards north and east by which speeds over ground and through the water differ, m/s.

    The log is regressed on the speed over ground along the bow, which is the surer of the two: what the log's noise
    takes from the coefficient of a regressor would look like a current, as the ship loses speed while she turns.
    """
    heading, log = track.heading_rad[known], track.log_m_s[known]
    along = track.speed_m_s[known] * np.cos(track.drift_rad[known])
    # the log's scale and bias beside it
    basis = np.column_stack([np.cos(heading), np.sin(heading), along, np.ones(heading.size)])
    north, east, scale, _ = np.linalg.lstsq(basis, log, rcond=None)[0]
    return -float(north / scale), -float(east / scale)
