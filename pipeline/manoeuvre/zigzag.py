"""The zigzag: the rudder is put over to the other side whenever the heading has come so far.

The order is given exactly when the heading has changed by the nominal angle, and the overshoot is what it goes on
beyond that: IMO MSC.137(76), 4.2.7; ITTC 7.5-02-06-01. A helmsman who is late makes it larger.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, nan

import numpy as np

from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.sailed import Sailed, reach_of, thinned
from kempf.pipeline.manoeuvre.ship import SailedTrack, Ship

#: a leg that takes longer, in ship lengths on the approach, does not end
LONGEST_LEG = 150.0


@dataclass(frozen=True)
class PredictedZigzag:
    """A psi/delta zigzag."""

    #: heading_rad, rudder_rad: Nominal heading change and rudder.
    heading_rad: float
    rudder_rad: float
    #: Of the first execute, +1 to starboard, -1 to port.
    side: int = 1
    overshoots: int = 4
    #: Heading changes at which the rudder was really ordered over, magnitudes, rad; by default the nominal one.
    switched_rad: tuple[float, ...] = ()
    name: str = "zigzag"

    def track(self, ship: Ship) -> SailedTrack:
        """Return the track, of as many legs as there are overshoots and one more."""
        longest, legs = LONGEST_LEG * ship.waters.own_time_s, self.overshoots + 1
        targets = [*self.switched_rad, *[self.heading_rad] * legs][:legs]
        phases = zip(self._sides(), targets, strict=True)
        return ship.sail(np.array([[s * self.rudder_rad, s, s * t, longest] for s, t in phases]))

    def _sides(self) -> list[int]:
        """Return to which side the rudder lies in each leg."""
        return [self.side * (-1) ** k for k in range(self.overshoots + 1)]

    def sailed(self, ship: Ship) -> Sailed | None:
        """Sail it; the curve has columns time, s, heading and rudder, rad."""
        track, sides, legs = self.track(ship), self._sides(), self.overshoots + 1
        if track.how == motion.RAN_AWAY or track.ends[0] < 0:
            return None
        heading, first = track.column(motion.HEADING), int(track.ends[0])
        figures = {
            f"overshoots_deg.{k}": self._overshoot(heading, track.ends, k, sides[k]) for k in range(self.overshoots)
        }
        time, path = track.column(motion.TIME), track.column(motion.PATH)
        figures["initial_turning_m"] = float(path[first])
        figures["time_to_second_execute_s"] = float(time[first])
        third = int(track.ends[2]) if legs > 2 else -1
        figures["period_s"] = float(time[third] - time[first]) if third >= 0 else nan
        curve = thinned(track.rows[:, [motion.TIME, motion.HEADING, motion.RUDDER]])
        return Sailed(figures, curve, reach_of(track, ship.waters.length_m))

    def _overshoot(self, heading: np.ndarray, ends: np.ndarray, k: int, side: int) -> float:
        """Return how far the heading went beyond the nominal one after the order at the end of a leg, deg."""
        begin, end = int(ends[k]), int(ends[k + 1])
        if begin < 0:
            return nan
        swing = side * heading[begin : end + 1 if end >= 0 else None]
        # a swing that has not turned back by the end has no peak
        if end < 0 and int(np.argmax(swing)) == swing.size - 1:
            return nan
        return degrees(float(np.max(swing)) - self.heading_rad)
