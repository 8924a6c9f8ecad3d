"""The trial programme: what the helmsman is ordered to do, step by step, and what is on record of each step."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, radians
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.plant import AUTOPILOT, FIXED, ORDERS, ZIGZAG
from kempf.schemas.side import Side

Float = NDArray[np.float64]

#: Time between two orders of the helmsman or the autopilot, s.
TICK_S = 0.5


@dataclass(frozen=True, eq=False)
class Steering:
    """A step of the programme as the kernel `kempf.pipeline.simulate.plant.steer` takes it."""

    kind: int
    settings: Float
    orders: Float


def _autopilot(heading_rad: float, hull: SimulatedHull) -> Steering:
    # gains in the ship's own time L/V: well damped for every hull of the catalogue, a fraction of a degree in calm sea
    time = hull.length_m / hull.trial_speed_m_s
    return Steering(AUTOPILOT, np.array([heading_rad, 1.0, 1.5 * time, 0.15 / time]), np.empty(0))


@dataclass(frozen=True)
class SteadyCourse:
    """Hold a heading by autopilot.

    Parameters
    ----------
    duration_s : float
        How long.
    heading_deg : float or None
        Heading, reached by the shorter turn; None holds the one at the beginning.
    """

    duration_s: float
    heading_deg: float | None = None
    kind: ClassVar[str] = "steady_course"

    def steering(self, hull: SimulatedHull, heading_rad: float, random: np.random.Generator) -> Steering:
        """Return the step for the kernel; ``heading_rad`` is the heading at its beginning, not wrapped."""
        turn = 0.0
        if self.heading_deg is not None:
            turn = (radians(self.heading_deg) - heading_rad + pi) % (2 * pi) - pi
        return _autopilot(heading_rad + turn, hull)


@dataclass(frozen=True)
class CourseChange:
    """Change the heading by autopilot and hold the new one: positive to starboard."""

    change_deg: float
    duration_s: float = 300.0
    kind: ClassVar[str] = "course_change"

    def steering(self, hull: SimulatedHull, heading_rad: float, random: np.random.Generator) -> Steering:
        """Return the step for the kernel; ``heading_rad`` is the heading at its beginning, not wrapped."""
        return _autopilot(heading_rad + radians(self.change_deg), hull)


@dataclass(frozen=True)
class ZigzagTest:
    """The zigzag psi0/delta0; the base heading K0 is the heading at its beginning.

    Parameters
    ----------
    heading_deg, rudder_deg : float
        psi0 and delta0.
    first_side : {"starboard", "port"}
        Of the first execute.
    legs : int or None
        Number of executes; it ends where the heading reaches psi0 at the end of the last leg. None: legs until
        ``duration_s``.
    duration_s : float
        It ends then at the latest.
    """

    heading_deg: float = 20.0
    rudder_deg: float = 20.0
    first_side: Side = "starboard"
    legs: int | None = None
    duration_s: float = 1200.0
    kind: ClassVar[str] = "zigzag"

    def steering(self, hull: SimulatedHull, heading_rad: float, random: np.random.Generator) -> Steering:
        """Return the step for the kernel; ``heading_rad`` is the heading at its beginning, not wrapped."""
        side = 1.0 if self.first_side == "starboard" else -1.0
        legs = inf if self.legs is None else float(self.legs)
        settings = [heading_rad, radians(self.heading_deg), radians(self.rudder_deg), side, legs]
        return Steering(ZIGZAG, np.array(settings), np.empty(0))


@dataclass(frozen=True)
class TurningCircle:
    """Put the rudder over and keep it there until the heading has changed by ``change_deg`` or the time is over."""

    rudder_deg: float = 35.0
    change_deg: float = 540.0
    duration_s: float = 1800.0
    kind: ClassVar[str] = "turning_circle"

    def steering(self, hull: SimulatedHull, heading_rad: float, random: np.random.Generator) -> Steering:
        """Return the step for the kernel; ``heading_rad`` is the heading at its beginning, not wrapped."""
        settings = np.array([radians(self.rudder_deg), radians(self.change_deg)])
        return Steering(FIXED, settings, np.empty(0))


@dataclass(frozen=True)
class RudderHold:
    """Hold one rudder angle: amidships behind a turning circle it is a pull-out, many in a row are a spiral.

    Parameters
    ----------
    rudder_deg : float
        Starboard positive.
    duration_s : float
        How long, with the time in which the rudder goes there.
    """

    rudder_deg: float
    duration_s: float
    kind: ClassVar[str] = "held_rudder"

    def steering(self, hull: SimulatedHull, heading_rad: float, random: np.random.Generator) -> Steering:
        """Return the step for the kernel; ``heading_rad`` is the heading at its beginning, not wrapped."""
        return Steering(FIXED, np.array([radians(self.rudder_deg), inf]), np.empty(0))


@dataclass(frozen=True)
class HandSteering:
    """Random rudder in a band: a sum of sinusoids of equal size, random phase and logarithmic spacing.

    Parameters
    ----------
    duration_s : float
        How long.
    rudder_rms_deg : float
        Root mean square of the order.
    shortest_period_s, longest_period_s : float
        The band.
    """

    duration_s: float = 600.0
    rudder_rms_deg: float = 6.0
    shortest_period_s: float = 20.0
    longest_period_s: float = 150.0
    kind: ClassVar[str] = "hand_steering"

    def steering(self, hull: SimulatedHull, heading_rad: float, random: np.random.Generator) -> Steering:
        """Return the step for the kernel; the orders are drawn from ``random``."""
        n_waves = 16
        time = np.arange(int(self.duration_s / TICK_S) + 1) * TICK_S
        frequency = np.geomspace(1.0 / self.longest_period_s, 1.0 / self.shortest_period_s, n_waves)
        phase = random.uniform(0.0, 2.0 * pi, n_waves)
        waves = np.sin(2.0 * pi * frequency * time[:, None] + phase)
        orders = radians(self.rudder_rms_deg) * np.sqrt(2.0 / n_waves) * waves.sum(axis=1)
        limited = np.clip(orders, -hull.rudder_limit_rad, hull.rudder_limit_rad)
        return Steering(ORDERS, np.zeros(5), limited)


Step = SteadyCourse | CourseChange | ZigzagTest | TurningCircle | RudderHold | HandSteering


@dataclass(frozen=True)
class ManoeuvreRecord:
    """What truly happened in one step of the programme."""

    #: As it was ordered.
    step: Step
    #: start_s, end_s: Since the start of the trial; a zigzag with a number of legs ends at its last crossing.
    start_s: float
    end_s: float
    #: Heading at the beginning, not wrapped; K0 of a zigzag.
    base_heading_rad: float
    #: Instants at which the rudder was ordered over; for a zigzag one a leg, and all but the first where the heading
    #: crossed K0 +- psi0.
    executes_s: tuple[float, ...] = ()
    #: Of a zigzag, greatest heading beyond psi0 after each crossing whose turn came to its end.
    overshoots_rad: tuple[float, ...] = ()
