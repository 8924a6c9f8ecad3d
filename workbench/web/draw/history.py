"""Parameters over time: a panel each, a point a parameter set, its 95 % interval as a line; changes are bands."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.tables.notes import Note
from kempf.workbench.web.draw.scale import ticks
from kempf.workbench.web.draw.svg import drawing, element
from kempf.workbench.web.window import instant

#: sizes; a panel's words stand in the gap above it
_WIDTH, _PANEL, _LEFT, _GAP = 640.0, 92.0, 64.0, 20.0


def draw_history(
    rows: Sequence[Mapping[str, Any]], examined: Sequence[Mapping[str, Any]] = (), noted: Sequence[Note] = ()
) -> Markup | None:
    """Return the hull's parameters of the sets that `shown_kind` chooses; None where none has an interval.

    Parameters
    ----------
    rows : sequence of mapping
        Of `kempf.warehouse.queries.history.History.rows`.
    examined : sequence of mapping, optional
        Of `kempf.workbench.documents.changes.Examined.as_json`: where a parameter moved its panel says so.
    noted : sequence of Note, optional
        A line where each says that something happened.
    """
    kind = shown_kind(rows)
    if kind is None:
        return None
    shown = [row for row in _usable(rows) if (row["model"], row["estimator"]) == kind]
    names = [name for name in HULL_PARAMETERS if any(row["parameter"] == name for row in shown)]
    times = [row["start_utc_ns"] for row in shown]
    first, last = min(times), max(times)
    parts: list[Markup] = []
    # another version of a model, or other settings, are tested by themselves
    alike = [of for of in examined if (of["model"], of["estimator"]) == kind]
    changes = max(alike, key=lambda of: int(of["sets"]))["changes"] if alike else []
    bottom = len(names) * (_PANEL + _GAP) + 14.0
    for k, name in enumerate(names):
        own, top = [row for row in shown if row["parameter"] == name], k * (_PANEL + _GAP) + 16.0
        bands, words = _bands(changes, name, top, first, last)
        parts += [*bands, *_panel(name, own, top, first, max(last, first + 1)), *words]
    for note in noted:
        if note.event_utc_ns is not None and first <= note.event_utc_ns <= last:
            x = _x(note.event_utc_ns, first, last)
            line = element("line", x1=x, x2=x, y1=16.0, y2=bottom - 4.0, class_="noted")
            word = element("text", f"note {note.number}", x=x, y=bottom + 5.0, text_anchor="middle", class_="label")
            parts.append(element("g", element("title", note.text), line, word))
    starts = sorted({row["start"][:10]: row["start_utc_ns"] for row in shown}.items())
    for word, at in (starts[0], starts[-1]) if len(starts) > 1 else starts:
        anchor = "start" if at == first else "end"
        parts.append(element("text", word, x=_x(at, first, last), y=bottom + 4.0, text_anchor=anchor, class_="label"))
    title = f"Parameters over time: model {kind[0]}, {kind[1]}; value and 95 % interval"
    return drawing(_WIDTH, bottom + 14.0, title, *parts, role="group")


def shown_kind(rows: Sequence[Mapping[str, Any]]) -> tuple[str, str] | None:
    """Return the model and the estimator that most sets are of; None where none has an interval.

    Parameters
    ----------
    rows : sequence of mapping
        Of `kempf.warehouse.queries.history.History.rows`.
    """
    kinds = Counter((row["model"], row["estimator"]) for row in _usable(rows))
    return max(kinds, key=lambda pair: (kinds[pair], pair)) if kinds else None


def _usable(rows: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    usable = [row for row in rows if row["low"] is not None and not row["superseded"] and row["converged"]]
    return [row for row in usable if row["parameter"] in HULL_PARAMETERS]


def _x(at: int, first: int, last: int) -> float:
    return _LEFT + 12.0 + (_WIDTH - _LEFT - 28.0) * (at - first) / max(last - first, 1)


def _bands(
    changes: Sequence[Mapping[str, Any]], name: str, top: float, first: int, last: int
) -> tuple[list[Markup], list[Markup]]:
    """Return where a ship changed as bands of a parameter's panel, and what that was for the parameter in words."""
    bands: list[Markup] = []
    words: list[str] = []
    for change in changes:
        at = [_x(instant(end), first, last) for end in change["between"]]
        own = change["parameters"].get(name)
        moved = own is not None and own["moved"]
        room = {"x": at[0], "width": max(at[1] - at[0], 1.0), "y": top, "height": _PANEL}
        bands.append(element("rect", **room, class_="changed moved" if moved else "changed"))
        if moved:
            a_year = " a year" if change["kind"] == "drift" else ""
            text = f"{change['kind']} {own['percent']:+.1f} ± {own['percent_std']:.1f} %{a_year}"
            words.append(text)
    if words:
        at_end = {"x": _WIDTH - 4.0, "y": top - 5.0, "text_anchor": "end", "class_": "label strong"}
        return bands, [element("text", "; ".join(words), **at_end)]
    return bands, []


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
    parts.append(element("text", name + unit, x=_LEFT, y=top - 5.0, class_="label strong"))
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
