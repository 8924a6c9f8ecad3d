"""A predicted manoeuvre: the ship of the estimates over the ships that the data allow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any

from markupsafe import Markup

from kempf.workbench.charts.signs import STARBOARD
from kempf.workbench.web.draw.frame import BOTTOM, LEFT, RIGHT, TOP, Frame
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _HEIGHT = 760.0, 340.0
#: by kind: columns across and up with their factors, and what the axes are
_AXES = {
    "turning-circle": (
        (1, 1.0),
        (0, 1.0),
        "across the approach, m, to the side of the turn +",
        "along the approach, m",
    ),
    "zigzag": ((0, 1.0), (1, degrees(1.0)), "time from the first execute, s", f"heading and rudder, deg, {STARBOARD}"),
    "pull-out": (
        (0, 1.0),
        (1, degrees(1.0)),
        "time from the order amidships, s",
        f"yaw rate, deg/s, {STARBOARD}",
    ),
    "spiral": (
        (0, degrees(1.0)),
        (1, degrees(1.0)),
        f"rudder, deg, {STARBOARD}",
        f"steady yaw rate, deg/s, {STARBOARD}",
    ),
}
_RUDDER_COLUMN = 2
Points = list[tuple[float, float]]


def draw_sailed(manoeuvre: Mapping[str, Any], curves: Mapping[str, Sequence[Any]]) -> Markup:
    """Return the figure of a predicted manoeuvre.

    Parameters
    ----------
    manoeuvre : mapping
        JSON content of what was sailed.
    curves : mapping
        See `kempf.workbench.web.data.sailed.curves_of`.
    """
    (column, factor), (row, scale), across, up = _AXES[manoeuvre["kind"]]

    def points(curve: Sequence[Sequence[float]], of: int = row) -> Points:
        return [(factor * point[column], scale * point[of]) for point in curve]

    first = curves["estimates"][0]
    rudder = points(first, _RUDDER_COLUMN) if manoeuvre["kind"] == "zigzag" else []
    every = [p for curve in (*curves["estimates"], *curves["ships"]) for p in points(curve)]
    # a ship that is slow to finish would press the others together
    if manoeuvre["kind"] == "zigzag":
        every = [p for p in every if p[0] <= 1.1 * rudder[-1][0]]
    left, right = _ends([x for x, _ in every])
    low, high = _ends([y for _, y in (*every, *rudder)])
    height = _HEIGHT
    if manoeuvre["kind"] == "turning-circle":
        height = TOP + BOTTOM + (_WIDTH - LEFT - RIGHT) * (high - low) / (right - left)
        if height > 1.2 * _WIDTH:  # equally long metres both ways
            room = (right - left) * (height / (1.2 * _WIDTH) - 1.0) / 2.0
            left, right, height = left - room, right + room, 1.2 * _WIDTH
    frame = Frame(_WIDTH, height, (left, right), (low, high))
    parts = frame.grid()
    parts += [frame.line([p for p in points(curve) if left <= p[0] <= right], "line-ship") for curve in curves["ships"]]
    if rudder:
        parts.append(frame.line(rudder, "line-rudder"))
    for place, curve in enumerate(curves["estimates"]):
        shown = [p for p in points(curve) if left <= p[0] <= right]
        parts.append(frame.line(shown, "line-other" if place else "line-predicted"))
    if low < 0.0 < high:
        zero = frame.y(0.0)
        parts.append(element("line", x1=LEFT, x2=_WIDTH - RIGHT, y1=zero, y2=zero, class_="axis"))
    parts += frame.words(across, up)
    if rudder:
        parts.append(_beside_the_rudder(frame, rudder))
    return drawing(
        _WIDTH, height, "The manoeuvre as the estimates have it, and as other ships that the data allow", *parts
    )


def _beside_the_rudder(frame: Frame, rudder: Points) -> Markup:
    """Say which line is the rudder where it is first held to the second side; at the first it would meet the axis."""
    held = max(abs(angle) for _, angle in rudder)
    first = next((angle for _, angle in rudder if abs(angle) > 0.9 * held), 0.0)
    second = [point for point in rudder if abs(point[1]) > 0.9 * held and point[1] * first < 0.0]
    at, angle = second[0] if second else rudder[-1]
    above = angle > 0.0
    return element("text", "rudder", x=frame.x(at), y=frame.y(angle) + (-5.0 if above else 13.0), class_="label strong")


def _ends(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    room = 0.05 * (high - low) or 1.0
    return low - room, high + room
