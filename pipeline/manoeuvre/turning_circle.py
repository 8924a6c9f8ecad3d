"""The turning circle: rudder hard over on a straight course, and kept there.

Her speed falls for longer than one and a half turns: the steady figures are those of the turn that she comes to, unless
a circle of so many turns as one that was measured is asked for. Then they are means over the last turn, as measured.
IMO MSC.137(76), 4.2 and 5.3.1; ISO 13643-3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import degrees, nan, pi

import numpy as np

from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.sailed import Reach, Sailed, reach_of, thinned
from kempf.pipeline.manoeuvre.ship import Balance, SailedTrack, Ship, Start
from kempf.pipeline.segment.circles.turning_figures import turning_figures

#: a ship that takes longer for a whole circle, in ship lengths on the approach, does not turn
LONGEST = 400.0
#: a steady turn whose yaw rate is farther off the one at the end of a turn, as a share of it, is another one
_BESIDE = 0.5
#: how long she swings about it at most, in ship lengths on the approach
_SWINGS = 200.0
#: the figures that are given; those of the steady turn
_STEADY = ("steady_diameter_m", "steady_yaw_rate_deg_s", "steady_drift_deg", "speed_loss_percent")
FIGURES = ("advance_m", "transfer_m", "tactical_diameter_m", *_STEADY, "time_to_90_s", "time_to_180_s")


@dataclass(frozen=True)
class PredictedCircle:
    """A turning circle to one side, to be predicted."""

    #: Magnitude.
    rudder_rad: float
    #: +1 to starboard, -1 to port.
    side: int = 1
    #: Of the heading, in all, as one that was measured; None: until the turn is steady.
    turn_rad: float | None = None
    name: str = "turning-circle"

    def sailed(self, ship: Ship) -> Sailed | None:
        """Sail it; the curve has columns along and across the approach, m, across positive to the side of the turn."""
        track = turned(ship, self.side, self.rudder_rad, self.turn_rad)
        if track is None:
            return None
        r = track.rows
        forward, lateral = r[:, motion.FORWARD], r[:, motion.LATERAL]
        figures = turning_figures(
            *(r[:, motion.TIME], r[:, motion.NORTH], r[:, motion.EAST], r[:, motion.HEADING]),
            *(np.hypot(forward, lateral), np.arctan2(-lateral, forward), 0.0),
        )
        named, reach = {name: getattr(figures, name) for name in FIGURES}, reach_of(track, ship.waters.length_m)
        if self.turn_rad is None:
            balance = settled(ship, self.side, self.rudder_rad, track)
            named |= _steady(balance, track)
            reach = reach if balance is None else _as_far_as(balance, reach, ship.waters.length_m)
        curve = thinned(np.column_stack([r[:, motion.NORTH], self.side * r[:, motion.EAST]]))
        return Sailed(named, curve, reach)


def turned(ship: Ship, side: int, rudder_rad: float, turn_rad: float | None = None) -> SailedTrack | None:
    """Return a turn by an angle, rad, one and a half by default; None where she runs away or never comes round."""
    angle, longest = 3.0 * pi if turn_rad is None else turn_rad, LONGEST * ship.waters.own_time_s
    track = ship.sail(np.array([[side * rudder_rad, side, side * angle, longest]]))
    return track if track.how == motion.SAILED else None


def settled(ship: Ship, side: int, rudder_rad: float, track: SailedTrack) -> Balance | None:
    """Return the steady turn that one comes to; None where there is none beside the end of it."""
    order = side * rudder_rad
    balance = _beside(ship, order, track)
    if balance is not None:
        return balance
    # a hull that slides swings about its steady turn for long, and the search for it loses its way from there
    on = ship.beginning(Start.at_end_of(track)).sail(np.array([[order, 0.0, 0.0, _SWINGS * ship.waters.own_time_s]]))
    return _beside(ship, order, on) if on.how == motion.SAILED else None


def _beside(ship: Ship, order_rad: float, track: SailedTrack) -> Balance | None:
    """Return the steady turn beside the motion at the end of a track."""
    start = np.zeros(2 + ship.waters.model.extra)
    start[0], start[1] = track.rows[-1, motion.LATERAL], track.rows[-1, motion.RATE]
    balance = ship.rate_by(ship.felt_rad(order_rad), start)
    return balance if balance is not None and abs(balance.yaw_rate_rad_s / start[1] - 1.0) < _BESIDE else None


def _steady(balance: Balance | None, track: SailedTrack) -> dict[str, float]:
    """Return the steady figures of the turn that she comes to; NaN where she comes to none."""
    if balance is None:
        return dict.fromkeys(_STEADY, nan)
    speed, before = np.hypot(balance.forward_m_s, balance.lateral_m_s), track.rows[0]
    return {
        "steady_diameter_m": float(2.0 * speed / abs(balance.yaw_rate_rad_s)),
        "steady_yaw_rate_deg_s": degrees(balance.yaw_rate_rad_s),
        "steady_drift_deg": degrees(float(np.arctan2(-balance.lateral_m_s, balance.forward_m_s))),
        "speed_loss_percent": float(100.0 * (1.0 - speed / np.hypot(before[motion.FORWARD], before[motion.LATERAL]))),
    }


def _as_far_as(balance: Balance, reach: Reach, length_m: float) -> Reach:
    """Return how far out a turn goes that ends in a steady one."""
    return replace(
        reach,
        drift_rad=max(reach.drift_rad, float(np.arctan2(abs(balance.lateral_m_s), balance.forward_m_s))),
        yaw_rate=max(reach.yaw_rate, abs(balance.yaw_rate_rad_s) * length_m / balance.forward_m_s),
        slowest_m_s=min(reach.slowest_m_s, balance.forward_m_s),
    )
