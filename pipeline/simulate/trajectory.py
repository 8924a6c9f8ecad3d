"""What really happened: the ship's path on the fine grid, and its value at any instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.disturbances import FORCING
from kempf.pipeline.simulate.plant import STATE

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The true path of a trial."""

    #: Distance of the grid's points; the first is at 0 s.
    step_s: float
    #: Shape (n, 6). Columns `kempf.pipeline.simulate.plant.STATE`: m/s, rad/s, rad (not wrapped), m, m, m/s.
    state: Float
    #: Shape (n, 6). d(state)/dt.
    slope: Float
    #: rudder, order: Shape (n,). Rudder angle and its order, rad.
    rudder: Float
    order: Float
    #: Shape (n, 4). Columns `kempf.pipeline.simulate.disturbances.FORCING`.
    forcing: Float

    @property
    def time_s(self) -> Float:
        """Instants of the rows, s since the start, shape (n,)."""
        return np.arange(self.state.shape[0], dtype=np.float64) * self.step_s

    @property
    def duration_s(self) -> float:
        """Time of the last row, s."""
        return float((self.state.shape[0] - 1) * self.step_s)

    def column(self, name: str) -> Float:
        """Return one column of the state or of the forcing by its name, shape (n,)."""
        if name in STATE:
            return self.state[:, STATE.index(name)]
        return self.forcing[:, FORCING.index(name)]

    def at(self, time_s: Float) -> Sample:
        """Return the truth at any instants within the path, in any order.

        The state by the cubic that has the right values and slopes at both ends of the cell (error of order step^4;
        about 1e-10 of the value), rudder and forcing, which are straight lines in a cell, linearly.
        """
        position = time_s / self.step_s
        row = np.clip(np.floor(position).astype(np.int64), 0, self.state.shape[0] - 2)
        s = np.ascontiguousarray(position - row)
        t = s[:, None]
        h = self.step_s
        state = (
            (1 + 2 * t) * (1 - t) ** 2 * self.state[row]
            + t * (1 - t) ** 2 * h * self.slope[row]
            + t**2 * (3 - 2 * t) * self.state[row + 1]
            + t**2 * (t - 1) * h * self.slope[row + 1]
        )
        rudder = (1 - s) * self.rudder[row] + s * self.rudder[row + 1]
        forcing = (1 - t) * self.forcing[row] + t * self.forcing[row + 1]
        return Sample(time_s, state, rudder, self.order[row], forcing)


@dataclass(frozen=True, eq=False)
class Sample:
    """The truth at some instants."""

    #: Shape (m,). The instants.
    time_s: Float
    #: state, rudder, order, forcing: As in `Trajectory`, shape (m, ...); the order is the one at the cell's beginning.
    state: Float
    rudder: Float
    order: Float
    forcing: Float

    def ground_velocity(self, forward_m: float = 0.0, starboard_m: float = 0.0) -> tuple[Float, Float]:
        """Return the velocity over ground towards north and east, m/s, of a point fixed in the ship.

        Parameters
        ----------
        forward_m, starboard_m : float
            The point, from midships on the centre line.
        """
        v, r, psi, V = (self.state[:, STATE.index(name)] for name in ("v", "r", "psi", "V"))
        current_north, current_east, V_T = self.forcing[:, 1], self.forcing[:, 2], self.forcing[:, 3]
        ahead = V - r * starboard_m
        across = v + V_T + r * forward_m
        north = ahead * np.cos(psi) - across * np.sin(psi) + current_north
        east = ahead * np.sin(psi) + across * np.cos(psi) + current_east
        return north, east
