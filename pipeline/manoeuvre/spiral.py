"""The spirals: which rudder holds which yaw rate, and how wide the loop of an unstable ship is.

The reverse spiral of Bech (1968), "The reverse spiral test as applied to large ships", Shipping World and Shipbuilder
161, asks for the rudder of a given yaw rate: it is f = 0 solved for the rudder, also where no helm would stay. The
direct spiral of Dieudonne goes through rudder angles in steps, from one side to the other and back: it follows that
curve and jumps where the curve turns back.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, nan, radians

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.sailed import Reach, Sailed
from kempf.pipeline.manoeuvre.ship import Balance, Ship

#: r L / V0 from which on no ship is looked at, and steps of the curve up to there
_FASTEST, _STEPS = 3.0, 240
#: by so much rudder it is followed on; of the speed no more changes from one turn to the next
_RUDDER_STEP, _TORN = radians(0.25), 0.1


@dataclass(frozen=True)
class PredictedSpiral:
    """From hard over to hard over."""

    #: Magnitude of the outermost rudder angle.
    rudder_rad: float
    #: Step of the direct spiral between them.
    step_rad: float = radians(5.0)
    #: Rudder angles from starboard to port that are held instead, as of a spiral that was sailed.
    held_rad: tuple[float, ...] = ()
    name: str = "spiral"

    def sailed(self, ship: Ship) -> Sailed | None:
        """Sail both; the curve has columns rudder, rad, and yaw rate, rad/s, from port to starboard."""
        starboard, port = self._arm(ship, 1), self._arm(ship, -1)
        straight = ship.rudder_for(0.0)
        if starboard is None or port is None or straight is None:
            return None
        balances = [*port[::-1], straight, *starboard]
        rudder = np.array([b.rudder_rad for b in balances])
        rate = np.array([b.yaw_rate_rad_s for b in balances])
        middle = len(port)
        low, high = float(np.min(rudder[middle:])), float(np.max(rudder[: middle + 1]))
        width, neutral = max(high - low, 0.0), straight.rudder_rad
        down, up = self._direct(rudder, rate, neutral, middle)
        figures = {
            "loop_width_deg": degrees(width),
            "loop_height_deg_s": degrees(down - up) if width > 0.0 else 0.0,
            "neutral_rudder_deg": degrees(neutral),
        }
        orders = self.orders_rad
        for name, side in (("from_starboard_deg_s", 1), ("from_port_deg_s", -1)):
            # the outermost one is come to from amidships, every other from the side of the way
            outermost = 0 if side > 0 else len(orders) - 1
            for k, order in enumerate(orders):
                felt = ship.felt_rad(order) if k == outermost else order + side * ship.lost_rad
                falling, rising = self._direct(rudder, rate, felt, middle)
                figures[f"{name}.{k}"] = degrees(falling if side > 0 else rising)
        reach = Reach(
            max(float(np.arctan2(abs(b.lateral_m_s), b.forward_m_s)) for b in balances),
            max(abs(b.yaw_rate_rad_s) * ship.waters.length_m / b.forward_m_s for b in balances),
            self.rudder_rad,
            min(b.forward_m_s for b in balances),
            max(b.forward_m_s for b in balances),
        )
        return Sailed(figures, np.column_stack([rudder, rate]), reach)

    @property
    def orders_rad(self) -> Float:
        """Rudder angles of the direct spiral, from starboard to port."""
        if self.held_rad:
            return np.array(self.held_rad)
        steps = round(self.rudder_rad / self.step_rad)
        angles = np.unique([*(self.step_rad * np.arange(steps)), self.rudder_rad])
        orders: Float = np.concatenate([angles[::-1], -angles[1:]])
        return orders

    def _arm(self, ship: Ship, side: int) -> list[Balance] | None:
        """Return the curve to one side up to the outermost rudder, None where it does not come to it.

        It is followed by yaw rates, of which each has one rudder, also within the loop of an unstable ship. Where more
        rudder costs so much speed that she turns no faster it is followed on by rudder angles.
        """
        own = ship.waters.own_time_s
        arm: list[Balance] = []
        start = None
        step = _FASTEST / own / _STEPS
        rate = step
        while rate < _FASTEST / own:
            balance = ship.rudder_for(side * rate, start)
            if balance is None or (arm and _torn(arm[-1], balance)):
                return self._on_by_rudder(ship, side, arm)
            arm.append(balance)
            start = balance.solution
            if side * balance.rudder_rad >= self.rudder_rad:
                return arm
            rate += step
        return None

    def _on_by_rudder(self, ship: Ship, side: int, arm: list[Balance]) -> list[Balance] | None:
        """Return the curve with the rudder angles beyond it, None where she does not hold a turn with them."""
        # within the loop more rudder is no way on
        if len(arm) < 2 or not 0.0 < side * arm[-2].rudder_rad < side * arm[-1].rudder_rad:
            return None
        while side * arm[-1].rudder_rad < self.rudder_rad:
            start = arm[-1].solution.copy()
            start[1] = arm[-1].yaw_rate_rad_s
            rudder = min(side * arm[-1].rudder_rad + _RUDDER_STEP, self.rudder_rad)
            balance = ship.rate_by(side * rudder, start)
            if balance is None or _torn(arm[-1], balance):
                return None
            arm.append(balance)
        return arm

    def _direct(self, rudder: Float, rate: Float, order: float, middle: int) -> tuple[float, float]:
        """Return the yaw rates at a rudder angle that is come to from starboard, and from port."""
        # from starboard she stays on the starboard arm until it turns back
        turn = middle + int(np.argmin(rudder[middle:]))
        back = int(np.argmax(rudder[: middle + 1]))
        falling = _on(rudder[turn:], rate[turn:], order) if order >= rudder[turn] else nan
        rising = _on(rudder[: back + 1], rate[: back + 1], order) if order <= rudder[back] else nan
        return (rising if np.isnan(falling) else falling), (falling if np.isnan(rising) else rising)


def _torn(last: Balance, balance: Balance) -> bool:
    """Return whether a turn is not the one beside another, but of another part of the curve or of none."""
    change = abs(balance.forward_m_s - last.forward_m_s)
    return not np.isfinite(balance.rudder_rad) or change > _TORN * last.forward_m_s


def _on(rudder: Float, rate: Float, order: float) -> float:
    return float(np.interp(order, rudder, rate))
