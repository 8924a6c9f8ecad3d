"""A measured spiral as two ways over the same rudder angles: from starboard to port, and back."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from kempf.warehouse.segments import Segment

#: rudder angles that differ by less are the same order, deg
_SAME_DEG = 0.6
#: Yaw rates with ``value``, ``low`` and ``high``, deg/s, by rudder angle, deg.
Way = Mapping[float, Mapping[str, Any]]


def orders_of(segment: Segment) -> tuple[float, ...]:
    """Return the rudder angles of a spiral, from starboard to port, deg: of the way from starboard, if there is one.

    The way from port holds the same ones, but for play and the reading; one that it alone holds is left out.
    """
    from_starboard, from_port = _ways(segment)
    return tuple(sorted(from_starboard or from_port, reverse=True))


def rates_of(segment: Segment) -> dict[str, Mapping[str, Any]]:
    """Return the yaw rates of both ways as a predicted spiral names them, numbered by `orders_of`."""
    names = ("from_starboard_deg_s", "from_port_deg_s")
    return {
        f"{name}.{k}": way[near]
        for name, way in zip(names, _ways(segment), strict=True)
        for k, order in enumerate(orders_of(segment))
        for near in sorted(way, key=lambda angle: abs(angle - order))[:1]
        if abs(near - order) < _SAME_DEG
    }


def _ways(segment: Segment) -> tuple[Way, Way]:
    """Return the ways from starboard and from port; the outermost angles belong to both, where both were sailed."""
    points = [(float(point["rudder_deg"]), point["yaw_rate_deg_s"]) for point in segment.detail.get("points", ())]
    falling: dict[float, Mapping[str, Any]] = {}
    rising: dict[float, Mapping[str, Any]] = {}
    for (here, rate), (then, next_rate) in pairwise(points):
        way = falling if then < here else rising
        way.setdefault(here, rate)
        way.setdefault(then, next_rate)
    return falling, rising
