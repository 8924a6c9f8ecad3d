"""A chart's frame: two axes with their grid, and where values lie between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from kempf.workbench.web.draw.scale import ticks
from kempf.workbench.web.draw.svg import element

#: room beside the frame for numbers and words
LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 22.0, 36.0


@dataclass(frozen=True)
class Frame:
    """Two axes.

    Parameters
    ----------
    width, height : float
        Of the whole figure.
    across, up : (float, float)
        Smallest and largest value of each axis.
    """

    width: float
    height: float
    across: tuple[float, float]
    up: tuple[float, float]

    def x(self, value: float) -> float:
        """Return how far a value is from the left."""
        low, high = self.across
        return LEFT + (self.width - LEFT - RIGHT) * (value - low) / ((high - low) or 1.0)

    def y(self, value: float) -> float:
        """Return how far a value is from the top."""
        low, high = self.up
        return TOP + (self.height - TOP - BOTTOM) * (high - value) / ((high - low) or 1.0)

    def grid(self) -> list[Markup]:
        """Draw the grid and its numbers."""
        left, right = LEFT, self.width - RIGHT
        top, bottom = TOP, self.height - BOTTOM
        parts = [element("rect", x=left, y=top, width=right - left, height=bottom - top, fill="none", class_="frame")]
        for tick in ticks(*self.across, 8):
            x = self.x(tick)
            parts.append(element("line", x1=x, x2=x, y1=top, y2=bottom, class_="grid"))
            parts.append(element("text", f"{tick:g}", x=x, y=bottom + 14.0, text_anchor="middle", class_="label"))
        for tick in ticks(*self.up, 7):
            y = self.y(tick)
            parts.append(element("line", x1=left, x2=right, y1=y, y2=y, class_="grid"))
            parts.append(element("text", f"{tick:g}", x=left - 6.0, y=y + 3.5, text_anchor="end", class_="label"))
        return parts

    def words(self, across: str, up: str) -> list[Markup]:
        """Write what the axes are, outside the frame, where no line runs through it."""
        return [
            element("text", up, x=LEFT, y=TOP - 8.0, class_="label strong"),
            element(
                "text",
                across,
                x=self.width - RIGHT,
                y=self.height - 4.0,
                text_anchor="end",
                class_="label strong",
            ),
        ]

    def line(self, points: Sequence[tuple[float, float]], kind: str) -> Markup:
        """Draw a line through points that are values of both axes; what is drawn ends at the frame."""
        low, high = self.up
        path = " ".join(f"{self.x(a):.1f},{self.y(min(max(b, low), high)):.1f}" for a, b in points)
        return element("polyline", points=path, fill="none", class_=kind)
