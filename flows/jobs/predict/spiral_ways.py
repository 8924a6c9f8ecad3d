"""A measured spiral as two ways over the same rudder angles: from starboard to port, and back."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from kempf.warehouse.tables.segments import Segment

#: Rudder angles that differ by less are the same order, deg.
SAME_ORDER_DEG = 0.6
#: Yaw rates with ``value``, ``low`` and ``high``, deg/s, by rudder angle, deg.
Way = Mapping[float, Mapping[str, Any]]


def orders_of(segment: Segment) -> tuple[float, ...]:
    """Return the rudder angles of a spiral, from starboard to port, deg: of the way from starboard, if there is one.

    The way from port holds the same ones, but for play and the reading; one that it alone holds is left out.
    """
    from_starboard, from_port = _ways(segment)
    orders: list[float] = []
    for angle in sorted(from_starboard or from_port, reverse=True):
        if not orders or orders[-1] - angle >= SAME_ORDER_DEG:
            orders.append(angle)
    return tuple(orders)


def rates_of(segment: Segment) -> dict[str, Mapping[str, Any]]:
    """Return the yaw rates of both ways as a predicted spiral names them, numbered by `orders_of`, each hold once."""
    orders, rates = orders_of(segment), {}
    for name, way in zip(("from_starboard_deg_s", "from_port_deg_s"), _ways(segment), strict=True):
        for k, order in enumerate(orders):
            near = min(way, key=lambda angle: abs(angle - order), default=None)
            if near is None or abs(near - order) >= SAME_ORDER_DEG:
                continue
            if order == min(orders, key=lambda one: abs(one - near)):
                rates[f"{name}.{k}"] = way[near]
    return rates


def _ways(segment: Segment) -> tuple[Way, Way]:
    """Return the first way from starboard and the first from port; the hold at which she turns back is the first's."""
    points = [(float(point["rudder_deg"]), point["yaw_rate_deg_s"]) for point in segment.detail.get("points", ())]
    ways: dict[int, dict[float, Mapping[str, Any]]] = {}
    before = 0
    for (here, rate), (then, next_rate) in pairwise(points):
        side = -1 if then < here else 1
        if side != before and side in ways:
            break
        way = ways.setdefault(side, {})
        if before == 0:
            way[here] = rate
        way.setdefault(then, next_rate)
        before = side
    return ways.get(-1, {}), ways.get(1, {})
