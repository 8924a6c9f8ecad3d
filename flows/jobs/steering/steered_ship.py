"""The simulated ship as `kempf.pipeline.steering.track` steers her: the one place where the law and the plant meet.

They are in two rooms of the pipeline that must not know each other, or an error of one would hide in the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.simulate.disturbances import Environment
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.plant import ORDERS, follow, hull_constants, steer
from kempf.pipeline.simulate.programme import GRID_S
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.steering_gear import SteeringGear
from kempf.schemas.errors import DataRejected, UsageError


@dataclass(frozen=True)
class ShipInstruments:
    """Noise of what the law is shown, standard deviations of one reading."""

    #: Of each component of the GNSS velocity.
    velocity_m_s: float = 0.05
    yaw_rate_rad_s: float = radians(0.03)
    heading_rad: float = radians(0.05)
    rudder_rad: float = radians(0.1)


class SteeredShip:
    """A ship of the simulator, heading north, steered order by order.

    Parameters
    ----------
    hull : SimulatedHull
    environment : Environment
        Wind and stream.
    longest_s : float
        How long she can be steered.
    seed : int
        Of wind, stream and noise; equal seeds give equal weather and noise whatever the law does.
    instruments : ShipInstruments, optional
    gear : SteeringGear, optional
        Between the rudder's reading and the hull, fresh; None lets the hull feel what is read.
    """

    def __init__(
        self,
        hull: SimulatedHull,
        environment: Environment,
        longest_s: float,
        *,
        seed: int = 0,
        instruments: ShipInstruments | None = None,
        gear: SteeringGear | None = None,
    ) -> None:
        # a law's steps are cut to the grid one by one
        n = round(longest_s / GRID_S) + 2
        self._hull, self._constants = hull, hull_constants(hull)
        self._noise, self._row = instruments or ShipInstruments(), 0
        self._state, self._rudder, self._order = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
        self._state[0, 5] = hull.trial_speed_m_s
        self._forcing = environment.forcing(n, GRID_S, seed)
        self._random = stream(seed, "steered ship")
        self._gear, self._felt = gear, 0.0

    def measure(self) -> tuple[Float, float]:
        """Return (y_v m/s of eq. (18), y_r rad/s, heading rad not wrapped) and the rudder, rad, as instruments show."""
        v, r, psi, _, _, V = self._state[self._row]
        _, current_north, current_east, V_T = self._forcing[self._row]
        noise = self._random.standard_normal(5)
        spread = self._noise
        heading = psi + spread.heading_rad * noise[3]
        north = V * np.cos(psi) - (v + V_T) * np.sin(psi) + current_north + spread.velocity_m_s * noise[0]
        east = V * np.sin(psi) + (v + V_T) * np.cos(psi) + current_east + spread.velocity_m_s * noise[1]
        lateral = east * np.cos(heading) - north * np.sin(heading)
        shown = np.array([lateral, r + spread.yaw_rate_rad_s * noise[2], heading])
        return shown, float(self._rudder[self._row] + spread.rudder_rad * noise[4])

    def hold(self, order_rad: float, duration_s: float) -> None:
        """Order a rudder angle and sail on.

        Raises
        ------
        UsageError
            The duration is no multiple of the grid, or longer than she can be steered.
        DataRejected
            She left the range of eq. (16).
        """
        cells = round(duration_s / GRID_S)
        if abs(cells * GRID_S - duration_s) > 1e-9 or self._row + cells >= self._rudder.size:
            raise UsageError(
                "steered_too_long",
                f"An order of {duration_s:g} s after {self._row * GRID_S:g} s cannot be sailed on a grid of {GRID_S} s "
                f"up to {(self._rudder.size - 1) * GRID_S:g} s.",
                "Take steps that are multiples of the grid, and a longer ship's time.",
            )
        steer(
            ORDERS,
            np.empty(0),
            np.array([order_rad]),
            (GRID_S, 1, cells),
            (self._row, cells),
            (self._hull.rudder_rate_rad_s, self._hull.rudder_limit_rad),
            self._constants,
            self._state,
            self._rudder,
            self._order,
            self._forcing,
            np.zeros(1),
        )
        if self._gear is not None:
            # how the helm moves does not depend on where the ship is: she sails the same cells with what she feels
            readings = self._rudder[self._row : self._row + cells + 1]
            felt = np.concatenate([[self._felt], self._gear.felt(readings, GRID_S)])
            follow(felt, (GRID_S, 1), self._row, self._constants, self._state, self._forcing)
            self._felt = float(felt[-1])
        self._row += cells
        if not np.all(np.isfinite(self._state[self._row])) or self._state[self._row, 5] <= 0.0:
            raise DataRejected(
                "plant_out_of_range",
                f"The ship {self._hull.name} left the range of eq. (16): she stopped, or her motion is not finite.",
                "Take a law that holds her, or a more stable ship.",
            )

    def truth(self) -> Float:
        """Return v, r, psi, north m, east m, V, rudder, wind force m/s^2 now, shape (8,)."""
        k = self._row
        return np.array([*self._state[k], self._rudder[k], self._forcing[k, 0]])
