"""How far two parameter sets are apart: a row a parameter, in standard errors of the difference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from kempf.schemas.confidence import NORMAL_95
from kempf.workbench.web.draw.frame import LEFT, RIGHT
from kempf.workbench.web.draw.scale import ticks
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _ROW, _NAMES, _TOP = 640.0, 20.0, 150.0, 6.0


def draw_differences(rows: Sequence[Mapping[str, Any]]) -> Markup | None:
    """Return the figure; None where no parameter has a known difference.

    Parameters
    ----------
    rows : sequence of mapping
        ``name`` and ``in_std`` of each parameter.
    """
    known = [row for row in rows if row["in_std"] is not None]
    if not known:
        return None
    most = 1.1 * max(3.0, *(abs(row["in_std"]) for row in known))
    bottom = _TOP + _ROW * len(known)
    left, right = LEFT + _NAMES, _WIDTH - RIGHT

    def x(value: float) -> float:
        return float(left + (right - left) * (value + most) / (2.0 * most))

    parts = [
        element(
            "rect",
            x=x(-NORMAL_95),
            y=_TOP,
            width=x(NORMAL_95) - x(-NORMAL_95),
            height=bottom - _TOP,
            class_="expected",
        )
    ]
    for tick in ticks(-most, most, 9):
        parts.append(element("line", x1=x(tick), x2=x(tick), y1=_TOP, y2=bottom, class_="grid"))
        parts.append(element("text", f"{tick:g}", x=x(tick), y=bottom + 14.0, text_anchor="middle", class_="label"))
    for place, row in enumerate(known):
        y = _TOP + _ROW * (place + 0.5)
        words = f"{row['name']}: {row['in_std']:.3g}"
        parts.append(element("text", row["name"], x=left - 8.0, y=y + 4.0, text_anchor="end", class_="label strong"))
        parts.append(element("line", x1=x(0.0), x2=x(row["in_std"]), y1=y, y2=y, class_="interval"))
        parts.append(element("circle", element("title", words), cx=x(row["in_std"]), cy=y, r=4, class_="point"))
    parts.append(
        element(
            "text", "second less first, standard errors", x=right, y=bottom + 28.0, text_anchor="end", class_="label"
        )
    )
    return drawing(_WIDTH, bottom + 32.0, "Differences of two parameter sets in standard errors", *parts)
