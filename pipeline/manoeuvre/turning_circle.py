"""The turning circle: rudder hard over on a straight course, and kept there for one and a half turns.

IMO MSC.137(76), 4.2 and 5.3.1; ISO 13643-3.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.sailed import Sailed, reach_of, thinned
from kempf.pipeline.manoeuvre.ship import Ship
from kempf.pipeline.segment.turning_figures import turning_figures

#: a ship that takes longer for a whole circle, in ship lengths on the approach, does not turn
LONGEST = 400.0
#: the figures that are given
FIGURES = (
    "advance_m",
    "transfer_m",
    "tactical_diameter_m",
    "steady_diameter_m",
    "steady_yaw_rate_deg_s",
    "steady_drift_deg",
    "speed_loss_percent",
    "time_to_90_s",
    "time_to_180_s",
)


@dataclass(frozen=True)
class TurningCircle:
    """One to a side."""

    #: Magnitude.
    rudder_rad: float
    #: +1 to starboard, -1 to port.
    side: int = 1
    #: Of the heading, in all.
    turn_rad: float = 3.0 * pi
    name: str = "turning-circle"

    def sailed(self, ship: Ship) -> Sailed | None:
        """Sail it; the curve has columns along and across the approach, m, across positive to the side of the turn."""
        longest = LONGEST * ship.waters.own_time_s
        order = self.side * self.rudder_rad
        track = ship.sail(np.array([[order, self.side, self.side * self.turn_rad, longest]]))
        if track.how != motion.SAILED:
            return None
        r = track.rows
        forward, lateral = r[:, motion.FORWARD], r[:, motion.LATERAL]
        figures = turning_figures(
            *(r[:, motion.TIME], r[:, motion.NORTH], r[:, motion.EAST], r[:, motion.HEADING]),
            *(np.hypot(forward, lateral), np.arctan2(-lateral, forward), 0.0),
        )
        curve = thinned(np.column_stack([r[:, motion.NORTH], self.side * r[:, motion.EAST]]))
        return Sailed({name: getattr(figures, name) for name in FIGURES}, curve, reach_of(track, ship.waters.length_m))
