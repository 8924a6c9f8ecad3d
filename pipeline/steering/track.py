"""A ship on her course under a law: the loop, what it recorded, and the numbers that are compared.

The ship is any `SteerableShip`: the loop knows what her instruments show and what rudder it orders, and shares no
dynamics with her. `kempf.flows.jobs.steering.steered_ship` is the simulator as one.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from typing import Protocol

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.steering.course_keeping import Law
from kempf.schemas.errors import UsageError


class SteerableShip(Protocol):
    """What is steered."""

    def measure(self) -> tuple[Float, float]:
        """Return what the instruments show now: (y_v m/s, y_r rad/s, heading rad not wrapped), and the rudder, rad."""
        ...

    def hold(self, order_rad: float, duration_s: float) -> None:
        """Order a rudder angle and sail on."""
        ...

    def truth(self) -> Float:
        """Return v, r, psi, north m, east m, V, rudder, wind force m/s^2 now, shape (8,)."""
        ...


@dataclass(frozen=True, eq=False)
class Track:
    """What happened, one row an order."""

    #: Shape (n,).
    time_s: Float
    #: Shape (n,). Heading that was ordered.
    course_rad: Float
    #: Shape (n, 8). See `SteerableShip.truth`.
    truth: Float
    #: Shape (n, n_state). v, r, psi (from the course at the start), F, V_T as the law sees them, then the states of
    #: effects.
    estimate: Float

    @property
    def heading_error_rad(self) -> Float:
        """True heading less ordered heading, shape (n,)."""
        return self.truth[:, 2] - self.course_rad

    @property
    def cross_track_m(self) -> Float:
        """Distance to starboard of the line through the start along the first course, shape (n,)."""
        north, east = self.truth[:, 3] - self.truth[0, 3], self.truth[:, 4] - self.truth[0, 4]
        K = self.course_rad[0]
        across: Float = east * np.cos(K) - north * np.sin(K)
        return across


@dataclass(frozen=True)
class Performance:
    """How well a course was kept, over the part of a track after a settling time."""

    #: heading_rms_rad, heading_mean_rad, heading_max_rad: Of the heading error; the maximum of its modulus.
    heading_rms_rad: float
    heading_mean_rad: float
    heading_max_rad: float
    #: rudder_rms_rad, rudder_mean_rad: rms about the mean, and the mean: the steady rudder that meets the wind.
    rudder_rms_rad: float
    rudder_mean_rad: float
    #: Way of the rudder per second.
    rudder_travel_rad_s: float
    #: Mean speed across the course.
    drift_m_s: float
    #: rms distance from the straight line that fits the track best: what the helm adds to the steady drift.
    cross_track_rms_m: float
    #: Whether she stayed within 90 degrees of her course in that time; else the other numbers mean little.
    kept: bool


def keep_course(
    ship: SteerableShip, law: Law, duration_s: float, course_rad: float, changes: tuple[tuple[float, float], ...] = ()
) -> Track:
    """Steer a ship by a law.

    Parameters
    ----------
    course_rad : float
        Heading to hold, near the one she has.
    changes : tuple of (float, float), optional
        Instants, s, and the headings, rad, that hold from them on.

    Raises
    ------
    UsageError
        The duration is shorter than ten orders.
    """
    steps = int(duration_s / law.step_s)
    if steps < 10:
        raise UsageError(
            "track_too_short",
            f"A track of {duration_s:g} s holds {steps} orders at a step of {law.step_s:g} s, expected at least 10.",
            "Ask for a longer track.",
        )
    time: Float = np.arange(steps, dtype=np.float64) * law.step_s
    course = np.full(steps, course_rad)
    for instant, heading in changes:
        course[time >= instant] = heading
    n_state = len(law.plant.states)
    truth, estimate = np.empty((steps, 8)), np.empty((steps, n_state))
    x, turned, last_rudder = np.zeros(n_state), np.zeros(n_state), 0.0
    for k in range(steps):
        measured, rudder = ship.measure()
        measured = measured - np.array([0.0, 0.0, course_rad])
        if k == 0:
            x[:3] = [0.0, measured[1], measured[2]]
        else:
            # what the rudder did meanwhile is known when the step is over; straight between its ends
            x = law.predict(x, 0.5 * (last_rudder + rudder))
        x = law.correct(x, measured)
        turned[2] = course[k] - course_rad
        truth[k], estimate[k] = ship.truth(), x
        last_rudder = rudder
        ship.hold(float(law.order(x - turned)), law.step_s)
    return Track(time, course, truth, estimate)


@dataclass(frozen=True)
class CourseChangeResponse:
    """How the last change of course went."""

    #: Positive to starboard.
    change_rad: float
    #: Greatest heading beyond the new course, counted in the sense of the change; 0 where she never came beyond.
    overshoot_rad: float
    #: Time after which she stayed within a tenth of the change; None where the track ended before.
    settled_s: float | None


def course_change(track: Track) -> CourseChangeResponse | None:
    """Measure the last change of course of a track; None where there is none."""
    steps = np.flatnonzero(np.diff(track.course_rad))
    if not steps.size:
        return None
    first = int(steps[-1]) + 1
    change = float(track.course_rad[first] - track.course_rad[first - 1])
    error, time = track.heading_error_rad[first:] * np.sign(change), track.time_s[first:] - track.time_s[first]
    outside = np.flatnonzero(np.abs(error) > 0.1 * abs(change))
    last = int(outside[-1]) if outside.size else -1
    settled = float(time[last + 1]) if last + 1 < time.size else None
    return CourseChangeResponse(change, float(max(np.max(error), 0.0)), settled)


def performance(track: Track, settle_s: float, until_s: float = inf) -> Performance:
    """Measure how well the course was kept from ``settle_s`` on.

    Parameters
    ----------
    settle_s : float
        Left out at the beginning, s.
    until_s : float, optional
        End, s; by default that of the track.

    Raises
    ------
    UsageError
        Fewer than ten orders lie between.
    """
    rows = np.flatnonzero((track.time_s >= settle_s) & (track.time_s < until_s))
    if rows.size < 10:
        raise UsageError(
            "track_too_short",
            f"{rows.size} orders lie between {settle_s:g} and {until_s:g} s, expected at least 10.",
            "Ask for a longer track or a shorter settling time.",
        )
    time, error, rudder = track.time_s[rows], track.heading_error_rad[rows], track.truth[rows, 6]
    across = track.cross_track_m[rows]
    line = np.polynomial.Polynomial.fit(time, across, 1)
    travel = float(np.sum(np.abs(np.diff(rudder)))) / float(time[-1] - time[0])
    return Performance(
        heading_rms_rad=float(np.sqrt(np.mean(error**2))),
        heading_mean_rad=float(np.mean(error)),
        heading_max_rad=float(np.max(np.abs(error))),
        rudder_rms_rad=float(np.std(rudder)),
        rudder_mean_rad=float(np.mean(rudder)),
        rudder_travel_rad_s=travel,
        drift_m_s=float(line.deriv()(0.0)),
        cross_track_rms_m=float(np.std(across - line(time))),
        kept=bool(np.max(np.abs(error)) < 0.5 * pi),
    )
