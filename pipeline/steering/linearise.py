"""Eq. (16) with effects, linearised about a steady straight course.

The derivatives are those of `pipeline.model.dynamics`, which the filter moves by: no effect is written out here again.
On a steady course the speed is that of the approach, and the shaft turns as it did there; the air is calm, the water
deep, the ship upright and laden as in her last log. Where an effect shifts the course itself, such as a neutral angle,
the rudder and drift that hold it are found first, by Newton's rule, and the derivatives taken there.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model import dynamics
from kempf.pipeline.model.batch import ONE
from kempf.pipeline.model.chain import PSI, R, V
from kempf.pipeline.model.dynamics import N_BEFORE, N_INPUT, PARAMETER, SHIP, E
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.model.terms.program import DEPTH
from kempf.pipeline.steering.motion import LinearMotion, ShipEffects

#: a step in the rudder, rad: a power of two, so that what is linear in it comes out to the last bit
_RUDDER_STEP = 2.0**-20
#: where corners are looked for: beside the course by these shares of a radian of rudder or drift, or of V / L in turn
_BESIDE = (2.0**-13, 2.0**-14)
_ROUNDS = 20
_DEEP_M = 1e12


def motion_with_effects(
    hull: Hull, effects: ShipEffects, speed_m_s: float, arm_per_m: float, course_rad: float
) -> LinearMotion:
    """Linearise the ship; see `kempf.pipeline.steering.motion.linear_motion`."""
    return _Course(hull, effects, speed_m_s, arm_per_m, course_rad).motion()


class _Course:
    """The compiled model, asked at single states."""

    def __init__(self, hull: Hull, effects: ShipEffects, speed_m_s: float, arm_per_m: float, course_rad: float) -> None:
        model, p = effects.model, effects.values.size
        self.width = width = N_BEFORE + model.extra
        self.speed, self.length, self.table = speed_m_s, effects.length_m, model.table
        self.hull = hull.array()[:, None]
        self.ship = (self.hull, (arm_per_m, 0.0, 0.0, 0.0, 2.0, speed_m_s))
        self.values, self.slopes = np.zeros((PARAMETER + p, 1)), np.zeros((PARAMETER + p, width, 1))
        self.values[SHIP : SHIP + 10, 0] = [*hull.array(), effects.length_m, effects.draught_m, speed_m_s, 1.0]
        self.values[PARAMETER:, 0] = effects.values
        for i in range(width):
            self.slopes[i, i] = 1.0
        self.room = (np.zeros((DEPTH, width + 1, 1)), np.zeros(1), np.zeros((width + 1, 1)))
        # V, delta, wind speed and angle, shaft speed, depth, roll, true heading, time, day; no error of the speed
        self.row = np.array([speed_m_s, 0.0, 0.0, 0.0, 1.0, _DEEP_M, 0.0, course_rad, 0.0, effects.day, 0.0])
        assert self.row.size == N_INPUT

    def at(self, x: Float, rudder_rad: float) -> tuple[Float, Float, Float, Float]:
        """Return dx/dt and its derivatives, and what is measured and its derivatives."""
        width, room = self.width, self.room
        f, J = np.zeros((width, 1)), np.zeros((width, width, 1))
        state, rudder = x[:, None].copy(), np.array([rudder_rad])
        shared = (self.table, self.values, self.slopes, *room)
        # vddot and rddot stay 0: they go by the rudder's rate, which is no input here
        unused = (np.zeros((0, 1)), np.zeros((0, 1)))
        dynamics.measured_by(
            *(state, self.row, rudder, 1.0, self.row, rudder, False),
            *(self.ship, *shared, unused, f, J, ONE),
        )
        y, C = np.zeros(3), np.zeros((3, width))
        for channel, own in enumerate((V, R, PSI)):
            y[channel], C[channel, own] = x[own], 1.0
            if dynamics.add_programs(dynamics.ON_LATERAL + channel, *shared, ONE):
                y[channel] += room[2][0, 0]
                C[channel] += room[2][1:, 0]
        return f[:, 0], J[:, :, 0], y, C

    def by_rudder(self, x: Float, rudder_rad: float) -> tuple[Float, Float]:
        """Return the derivatives of dx/dt and of what is measured by the rudder that the hull feels."""
        above, _, y_above, _ = self.at(x, rudder_rad + _RUDDER_STEP)
        below, _, y_below, _ = self.at(x, rudder_rad - _RUDDER_STEP)
        return (above - below) / (2.0 * _RUDDER_STEP), (y_above - y_below) / (2.0 * _RUDDER_STEP)

    def noise(self) -> Float:
        squares = []
        for place in range(self.width - N_BEFORE):
            shared = (self.table, self.values, self.slopes, *self.room)
            dynamics.add_programs(dynamics.ON_NOISE + place, *shared, ONE)
            squares.append(float(self.room[2][0, 0]) ** 2)
        return np.array(squares)

    def rest(self) -> tuple[Float, float]:
        """Find the drift, the effects' states and the rudder with which she goes straight on; zero if none does."""
        x, rudder = np.zeros(self.width), 0.0
        free = [V, *range(N_BEFORE, self.width)]
        rows = [V, R, *range(N_BEFORE, self.width)]
        for _ in range(_ROUNDS):
            f, J, _, _ = self.at(x, rudder)
            if not np.any(f[rows]):
                return x, rudder
            jacobian = np.column_stack([J[np.ix_(rows, free)], self.by_rudder(x, rudder)[0][rows]])
            if not (np.all(np.isfinite(jacobian)) and np.all(np.isfinite(f))):
                break
            step = np.linalg.lstsq(jacobian, -f[rows], rcond=1e-14)[0]
            x[free] += step[:-1]
            rudder += float(step[-1])
            if np.max(np.abs(step)) < 1e-13:
                return x, rudder
        return np.zeros(self.width), 0.0

    def corners(self, x: Float, rudder_rad: float) -> Float:
        """Measure how much the derivatives jump across the course; what bends smoothly halves with the step."""
        here = self.at(x, rudder_rad)
        corners = np.zeros(3)
        for k, unit in enumerate((self.speed, self.speed / self.length, 1.0)):
            jumps = []
            for share in _BESIDE:
                move, turned = np.zeros(self.width), share * unit if k == 2 else 0.0
                if k < 2:
                    move[(V, R)[k]] = share * unit
                above, below = self.at(x + move, rudder_rad + turned), self.at(x - move, rudder_rad - turned)
                bent = [above[i] - 2.0 * here[i] + below[i] for i in (0, 2)]
                moved = [np.abs(above[i] - below[i]) for i in (0, 2)]
                size = max(float(np.max(m)) for m in moved) or 1.0
                jumps.append(max(float(np.max(np.abs(b))) for b in bent) / size)
            # the share of a corner is the same at both steps
            corners[k] = jumps[1] if jumps[1] > 1e-7 and jumps[1] > 0.75 * jumps[0] else 0.0
        return corners

    def motion(self) -> LinearMotion:
        x, rudder = self.rest()
        corners = self.corners(x, rudder)
        B, D = self.by_rudder(x, rudder)
        _, A, offsets, C = self.at(x, rudder)
        kept = np.delete(np.arange(self.width), E)
        A, C = A[np.ix_(kept, kept)], C[:, kept]
        return LinearMotion(A, B[kept], C, D, self.noise(), rudder, float(x[V]), offsets, corners)
