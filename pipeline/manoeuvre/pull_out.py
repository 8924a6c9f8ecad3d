"""The pull-out: out of a steady turn the rudder is put amidships; the yaw rate that is left says if she is stable.

ITTC 7.5-02-06-01; Burcher (1972), "Developments in ship manoeuvrability", Trans. RINA 114. Amidships is here the rudder
with which she holds a straight course.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, nan

import numpy as np

from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.sailed import Sailed, reach_of, thinned
from kempf.pipeline.manoeuvre.ship import Ship, Start
from kempf.pipeline.manoeuvre.turning_circle import settled, turned

#: how long the steady turn is held, so that what effects remember is that of the turn, and how long she is watched
#: then, in ship lengths on the approach; the end of it, over which what is left is averaged
_HELD, _WATCHED, _END = 10.0, 60.0, 10.0
#: a rate that is left, as a share of the turn's, below which it is none but what the integration leaves
_NOTHING = 1e-5


@dataclass(frozen=True)
class PredictedPullOut:
    """Out of a turn to a side."""

    #: Magnitude, of the turn.
    rudder_rad: float
    #: +1 to starboard, -1 to port.
    side: int = 1
    #: Rudder afterwards, starboard positive; None for that of a straight course.
    after_rad: float | None = None
    name: str = "pull-out"

    def sailed(self, ship: Ship) -> Sailed | None:
        """Sail it; the curve has columns time from the order amidships, s, and yaw rate, rad/s."""
        own, side = ship.waters.own_time_s, self.side
        turn = turned(ship, side, self.rudder_rad)
        if turn is None:
            return None
        after = nan if self.after_rad is None else self.after_rad
        order, balance = side * self.rudder_rad, settled(ship, side, self.rudder_rad, turn)
        # one whose speed falls on and on comes out of the turn as she is after one and a half
        start = Start.at_end_of(turn)
        if balance is not None:
            start = Start(balance.forward_m_s, balance.lateral_m_s, balance.yaw_rate_rad_s, balance.rudder_rad)
        track = ship.beginning(start).sail(
            np.array([[order, 0.0, 0.0, 0.0 if balance is None else _HELD * own], [after, 0.0, 0.0, _WATCHED * own]])
        )
        if track.how != motion.SAILED:
            return None
        begin = int(track.ends[0])
        time, rate = track.column(motion.TIME)[begin:], side * track.column(motion.RATE)[begin:]
        time = time - time[0]
        last = time >= time[-1] - _END * own
        steady, left = float(rate[0]), float(np.mean(rate[last]))
        # what the integration ends with is no rate
        left = 0.0 if abs(left) < _NOTHING * abs(steady) else left
        below = np.flatnonzero(rate <= 0.5 * steady)
        figures = {
            "steady_yaw_rate_deg_s": side * degrees(steady),
            # no minus before a nought
            "residual_yaw_rate_deg_s": side * degrees(left) + 0.0,
            "residual_share_percent": 100.0 * left / steady,
            "time_to_half_s": float(time[below[0]]) if below.size else nan,
        }
        curve = thinned(np.column_stack([time, side * rate]))
        return Sailed(figures, curve, reach_of(track, ship.waters.length_m))
