"""What an error of the speed does to the turning ship, in terms of the rudder that would do the same.

With V off by dV eq. (16) is off by (a1 v + a2 r + 2 b V delta) dV. Of that a1 v + a2 r is -b V delta_0, where delta_0
is the rudder that holds the present turn: the speed's error acts like one of the rudder of (2 delta - delta_0) dV / V.
In a steady turn that is delta dV / V; just after the rudder has gone from side to side it is three times as much.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.pipeline.estimate.record.moves import moves
from kempf.schemas.units import SECOND_NS

#: the yaw rate is the heading's change over this share of a leg
_SHARE = 0.1
_FEWEST = 20


@dataclass(frozen=True, eq=False)
class SpeedError:
    """The error of a record's speed, a first-order process."""

    #: Shape (n,). Rudder that a unit of it stands for at each instant.
    gain_rad_s_m: Float
    std_m_s: float
    #: Correlation time; 0 where the speed is no measured one.
    time_s: float

    def at(self, rows: Any) -> SpeedError:
        """Return it at some of the instants."""
        return replace(self, gain_rad_s_m=self.gain_rad_s_m[rows])

    def scaled(self, factor: Float) -> SpeedError:
        """Return it where the rudder does ``factor`` times as much, shape (n,)."""
        return replace(self, gain_rad_s_m=self.gain_rad_s_m * factor)

    @property
    def rate_per_s(self) -> float:
        """Correlation rate, 1/s."""
        return 1.0 / self.time_s if self.time_s > 0.0 else 0.0

    @property
    def intensity_rad_sqrt_s(self) -> Float:
        """Intensity of the rudder that does the same, rad s^0.5, shape (n,), to one who is slow beside the error."""
        result: Float = np.abs(self.gain_rad_s_m) * self.std_m_s * np.sqrt(2.0 * self.time_s)
        return result


def rudder_of_speed_error(heading: Series, rudder: Series, instants: Nanoseconds, delta: Float) -> Float:
    """Return 2 delta - delta_0, the error of the rudder that a relative error of the speed of one stands for.

    Parameters
    ----------
    heading, rudder : Series
        rad.
    instants : ndarray, shape (n,)
        UTC ns.
    delta : ndarray, shape (n,)
        Rudder at the instants, rad.

    Returns
    -------
    ndarray, shape (n,)
        rad; ``delta`` itself, that of steady turns, where the data do not show what rudder holds a turn.

    Notes
    -----
    delta_0 is proportional to the yaw rate, by Nomoto's model of first order (Nomoto et al. 1957, "On the steering
    qualities of ships", International Shipbuilding Progress 4), T r' + r = K (delta - delta_n), whose integral over
    time is a regression of the rudder's integral on heading, yaw rate and time, all of them hardly noisy.
    """
    start, end = int(instants[0]), int(instants[-1])
    half = 0.5 * _SHARE * (end - start) / max(moves(rudder.value), 1)
    if instants.size < _FEWEST or len(heading) < _FEWEST or not half > 0.0:
        return delta
    origin, own = int(heading.time_utc_ns[0]), heading.seconds_since(int(heading.time_utc_ns[0]))
    t, w = (instants - origin).astype(np.float64) / SECOND_NS, half / SECOND_NS
    later, earlier = np.clip(t + w, own[0], own[-1]), np.clip(t - w, own[0], own[-1])
    if not np.all(later > earlier):
        return delta
    rate = (np.interp(later, own, heading.value) - np.interp(earlier, own, heading.value)) / (later - earlier)
    put = np.concatenate([[0.0], np.cumsum(0.5 * (delta[1:] + delta[:-1]) * np.diff(t))])
    columns = np.column_stack([np.interp(t, own, heading.value), rate, t - t[0], np.ones(t.size)])
    columns[:, 0] -= columns[0, 0]
    scale = np.linalg.norm(columns, axis=0)
    if not np.all(scale > 0.0):
        return delta
    holds = float((np.linalg.lstsq(columns / scale, put, rcond=1e-9)[0] / scale)[0])
    farthest = 3.0 * float(np.max(np.abs(delta)))
    result: Float = np.clip(2.0 * delta - holds * rate, -farthest, farthest)
    return result
