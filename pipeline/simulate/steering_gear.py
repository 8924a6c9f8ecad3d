"""What lies between the rudder's reading and the rudder that the hull feels: lag, dead time, play, rate limit, a zero.

Each part takes the angle over one cell of the grid, linear between its ends, to the angle at its end. It shares no code
with the effects of the model: an error of one would hide in the other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import exp, inf
from typing import Protocol

import numpy as np

from kempf.pipeline.simulate.plant import Float


class GearPart(Protocol):
    """One part of the gear."""

    def __call__(self, begin_rad: float, end_rad: float, cell_s: float) -> float:
        """Return what comes out at the end of a cell, rad."""
        ...


class Lag:
    """A first-order lag, by its exact answer to a ramp."""

    def __init__(self, tau_s: float) -> None:
        self._tau_s, self._out = tau_s, 0.0

    def __call__(self, begin_rad: float, end_rad: float, cell_s: float) -> float:
        """Return the lagging angle at the end of a cell, rad."""
        rate = (end_rad - begin_rad) / cell_s
        behind = self._out - (begin_rad - rate * self._tau_s)
        self._out = end_rad - rate * self._tau_s + behind * exp(-cell_s / self._tau_s)
        return self._out


class DeadTime:
    """A dead time, linear between the ends of cells."""

    def __init__(self, tau_s: float) -> None:
        self._tau_s, self._waiting = tau_s, deque([0.0])

    def __call__(self, begin_rad: float, end_rad: float, cell_s: float) -> float:
        """Return the angle of so much earlier, rad."""
        self._waiting.append(end_rad)
        whole, share = divmod(self._tau_s / cell_s, 1.0)
        while len(self._waiting) > whole + 2:
            self._waiting.popleft()
        held = self._waiting
        late = held[0] if len(held) < whole + 2 else held[1] + share * (held[0] - held[1])
        return float(late)


class Play:
    """A play of a whole width, in whose middle the rudder stood."""

    def __init__(self, width_rad: float) -> None:
        self._half, self._out = 0.5 * width_rad, 0.0

    def __call__(self, begin_rad: float, end_rad: float, cell_s: float) -> float:
        """Return the angle that is taken along, rad."""
        self._out = min(max(self._out, end_rad - self._half), end_rad + self._half)
        return self._out


class RateLimit:
    """A largest rate."""

    def __init__(self, seconds_per_rad: float) -> None:
        self._rate, self._out = 1.0 / seconds_per_rad if seconds_per_rad > 0.0 else inf, 0.0

    def __call__(self, begin_rad: float, end_rad: float, cell_s: float) -> float:
        """Return the angle that follows as fast as it may, rad."""
        most = self._rate * cell_s
        self._out = min(max(end_rad, self._out - most), self._out + most)
        return self._out


class SteeringGear:
    """Parts in a row, and an angle by which the hull's rudder stands further to starboard than it reads.

    Parameters
    ----------
    parts : sequence of GearPart
    zero_rad : float, optional
    """

    def __init__(self, parts: Sequence[GearPart] = (), zero_rad: float = 0.0) -> None:
        self._parts, self._zero_rad = tuple(parts), zero_rad
        self._ends = [0.0] * len(self._parts)

    def felt(self, readings_rad: Float, cell_s: float) -> Float:
        """Return what the hull feels at the end of each cell, shape (n,), for readings at the cells' ends, (n + 1,)."""
        out = np.empty(readings_rad.size - 1)
        begins = [float(readings_rad[0]), *self._ends]
        for k, reading in enumerate(readings_rad[1:].tolist()):
            angle = reading
            for i, part in enumerate(self._parts):
                begin, begins[i] = begins[i], angle
                angle = part(begin, angle, cell_s)
            begins[-1] = angle
            out[k] = angle + self._zero_rad
        self._ends = begins[1:]
        return out
