"""Parameters over time: a panel each, a point a parameter set, its 95 % interval as a line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.workbench.web.draw.scale import ticks
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _PANEL, _LEFT, _GAP = 640.0, 92.0, 64.0, 14.0


def draw_history(rows: Sequence[Mapping[str, Any]]) -> Markup | None:
    """Return the hull's parameters of the model and estimator that most sets are of; None where none has an interval.

    Parameters
    ----------
    rows : sequence of mapping
        Of `kempf.warehouse.history.History.rows`.
    """
    usable = [row for row in rows if row["low"] is not None and not row["superseded"] and row["converged"]]
    usable = [row for row in usable if row["parameter"] in HULL_PARAMETERS]
    kinds = Counter((row["model"], row["estimator"]) for row in usable)
    if not kinds:
        return None
    kind = max(kinds, key=lambda one: (kinds[one], one))
    shown = [row for row in usable if (row["model"], row["estimator"]) == kind]
    names = [name for name in HULL_PARAMETERS if any(row["parameter"] == name for row in shown)]
    times = [row["start_utc_ns"] for row in shown]
    first, last = min(times), max(times)
    parts: list[Markup] = []
    for k, name in enumerate(names):
        own = [row for row in shown if row["parameter"] == name]
        parts += _panel(name, own, k * (_PANEL + _GAP) + 6.0, first, max(last, first + 1))
    bottom = len(names) * (_PANEL + _GAP) + 10.0
    starts = sorted({row["start"][:10]: row["start_utc_ns"] for row in shown}.items())
    for word, at in (starts[0], starts[-1]) if len(starts) > 1 else starts:
        anchor = "start" if at == first else "end"
        parts.append(element("text", word, x=_x(at, first, last), y=bottom + 4.0, text_anchor=anchor, class_="label"))
    title = f"Parameters over time: model {kind[0]}, {kind[1]}; value and 95 % interval"
    return drawing(_WIDTH, bottom + 14.0, title, *parts, role="group")


def _x(at: int, first: int, last: int) -> float:
    return _LEFT + 12.0 + (_WIDTH - _LEFT - 28.0) * (at - first) / max(last - first, 1)


def _panel(name: str, rows: Sequence[Mapping[str, Any]], top: float, first: int, last: int) -> list[Markup]:
    low, high = float(min(row["low"] for row in rows)), float(max(row["high"] for row in rows))
    room = 0.06 * (high - low) or 1.0
    low, high = low - room, high + room

    def y(value: float) -> float:
        return top + _PANEL * (high - value) / (high - low)

    parts = [element("rect", x=_LEFT, y=top, width=_WIDTH - _LEFT - 4.0, height=_PANEL, fill="none", class_="frame")]
    for tick in ticks(low, high, 4):
        parts.append(element("line", x1=_LEFT, x2=_WIDTH - 4.0, y1=y(tick), y2=y(tick), class_="grid"))
        parts.append(element("text", f"{tick:g}", x=_LEFT - 6.0, y=y(tick) + 3.5, text_anchor="end", class_="label"))
    unit = "" if rows[0]["unit"] in ("", "1") else f", {rows[0]['unit']}"
    parts.append(element("text", name + unit, x=_LEFT + 8.0, y=top + 14.0, class_="label strong"))
    for row in rows:
        x = _x(row["start_utc_ns"], first, last)
        words = (
            f"{row['parameter_set_id']}, {row['start'][:16]}: {row['value']:.4g}, {row['low']:.4g} to {row['high']:.4g}"
        )
        mark = element(
            "g",
            element("title", words),
            element("line", x1=x, x2=x, y1=y(row["low"]), y2=y(row["high"]), class_="interval"),
            element("circle", cx=x, cy=y(row["value"]), r=3, class_="point"),
        )
        parts.append(element("a", mark, href=f"/sets/{row['parameter_set_id']}"))
    return parts
