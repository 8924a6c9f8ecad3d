"""One manoeuvre measured and predicted: rudder, yaw rate, heading and lateral speed, and what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup

from kempf.pipeline.channels.series import Float, Mask
from kempf.schemas.units import SECOND_NS
from kempf.workbench.charts.signs import STARBOARD
from kempf.workbench.charts.turns import within_a_turn
from kempf.workbench.web.draw.scale import ticks
from kempf.workbench.web.draw.shades import shades
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _PANEL, _LEFT, _GAP = 760.0, 78.0, 62.0, 20.0
_POINTS = 260
_DEG = 180.0 / np.pi
#: Values, and how they are drawn.
Line = tuple[Float, str]
#: column, words, factor to the unit shown
_SHOWN = (
    ("yaw_rate", "rad_s", f"yaw rate, deg/s ({STARBOARD})", _DEG),
    ("heading", "rad", "heading, deg", _DEG),
    ("lateral_speed", "m_s", f"lateral speed, m/s ({STARBOARD})", 1.0),
)


def draw_run(
    columns: Mapping[str, Float], before: Mapping[str, Float] | None = None, marked: Mask | None = None
) -> Markup:
    """Return the figure of a run.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        See `kempf.pipeline.compare.run_series.run_series`.
    before : mapping, optional
        The same run predicted with another set; left out where its instants are other ones.
    marked : ndarray of bool, shape (n,), optional
        Instants that are shaded in every panel.
    """
    if before is not None and not np.array_equal(before["time_utc_ns"], columns["time_utc_ns"]):
        before = None
    time = (columns["time_utc_ns"] - columns["time_utc_ns"][0]).astype(np.float64) / SECOND_NS
    panels = []
    for name, unit, words, factor in _SHOWN:
        measured, predicted = _shown(columns, name, unit, factor)
        lines = [(measured, "measured")]
        if before is not None:
            lines.append((_shown(before, name, unit, factor)[1], "before"))
        lines.append((predicted, "predicted"))
        if name != "heading":
            # what is left beside a heading of 300 deg would lie off the panel
            lines.append((measured - predicted, "left"))
        panels.append((words, lines))
    beside = ", predicted by the other set (dashed)" if before is not None else ""
    shaded = "" if marked is None else ", the instants of the evidence shaded"
    title = f"Measured (dots), predicted (line){beside} and the difference (thin line){shaded}"
    return _figure(time, columns["rudder_angle_rad"], panels, title, marked)


def _shown(columns: Mapping[str, Float], name: str, unit: str, factor: float) -> tuple[Float, Float]:
    """Return what was measured and what is predicted in the unit shown."""
    measured, predicted = columns[f"{name}_{unit}"], columns[f"{name}_predicted_{unit}"]
    if name == "heading":
        measured, predicted = within_a_turn(measured), within_a_turn(predicted, measured)
    return factor * measured, factor * predicted


def draw_panels(
    time_s: Float, measured: Mapping[str, Float], tried: Sequence[tuple[Mapping[str, Float], str]], words: str
) -> Markup:
    """Return a figure of what was measured of a run and of several predictions of it.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    measured : mapping of str to ndarray, shape (n,)
        ``rudder_angle_rad`` and, as far as they were measured, ``yaw_rate_rad_s``, ``heading_rad``,
        ``lateral_speed_m_s``; NaN where nothing was.
    tried : sequence of (mapping, str)
        Predictions, columns as those of ``measured``, each with its class.
    words : str
        What the figure is called when it is read aloud.
    """
    panels = []
    for name, unit, label, factor in _SHOWN:
        column = f"{name}_{unit}"
        lines = [(factor * prediction[column], kind) for prediction, kind in tried]
        panels.append((label, [(factor * measured[column], "measured"), *lines]))
    return _figure(time_s, measured["rudder_angle_rad"], panels, words)


def _figure(
    time: Float,
    rudder_rad: Float,
    panels: Sequence[tuple[str, list[Line]]],
    title: str,
    marked: Mask | None = None,
) -> Markup:
    """Draw the rudder and below it every panel whose first line was measured."""
    end = float(time[-1])
    shown = [(words, lines) for words, lines in panels if np.isfinite(lines[0][0]).any()]
    parts, top = [], _GAP - 4.0
    for words, lines in ((f"rudder, deg ({STARBOARD})", [(_DEG * rudder_rad, "rudder")]), *shown):
        if marked is not None:
            parts += shades(time, marked, _LEFT, (_WIDTH - _LEFT - 12.0) / max(end, 1e-9), top, _PANEL)
        parts += _panel(top, words, time, end, lines)
        top += _PANEL + _GAP
    return drawing(_WIDTH, top + 4.0, title, *parts, *_seconds(top, end))


def _seconds(top: float, end: float) -> list[Markup]:
    parts = [
        element("text", f"{tick:g}", x=_x(tick, end), y=top - 4.0, text_anchor="middle", class_="label")
        for tick in ticks(0.0, end, 8)
    ]
    return [*parts, element("text", "s", x=_WIDTH - 6.0, y=top - 4.0, text_anchor="end", class_="label")]


def _x(second: float, end: float) -> float:
    return _LEFT + (_WIDTH - _LEFT - 12.0) * second / max(end, 1e-9)


def _panel(top: float, words: str, time: Float, end: float, lines: Sequence[Line]) -> list[Markup]:
    every = np.concatenate([values[np.isfinite(values)] for values, _ in lines])
    low, high = (float(every.min()), float(every.max())) if every.size else (0.0, 1.0)
    room = 0.06 * (high - low) or 1.0
    low, high = low - room, high + room
    parts = [element("rect", x=_LEFT, y=top, width=_WIDTH - _LEFT - 12.0, height=_PANEL, fill="none", class_="frame")]
    for tick in ticks(low, high, 4):
        y = top + _PANEL * (high - tick) / (high - low)
        parts.append(element("line", x1=_LEFT, x2=_WIDTH - 12.0, y1=y, y2=y, class_="grid"))
        parts.append(element("text", f"{tick:g}", x=_LEFT - 6.0, y=y + 3.5, text_anchor="end", class_="label"))
    step = max(1, time.size // _POINTS)
    for values, kind in lines:
        at = np.flatnonzero(np.isfinite(values))[::step]
        across = _LEFT + (_WIDTH - _LEFT - 12.0) * time[at] / max(end, 1e-9)
        down = top + _PANEL * (high - values[at]) / (high - low)
        places = list(zip(across.tolist(), down.tolist(), strict=True))
        if kind == "measured":
            path = " ".join(f"M{a:.1f} {b:.1f}h.01" for a, b in places)
        else:
            path = "M" + " ".join(f"{a:.1f} {b:.1f}" for a, b in places) if places else ""
        if path:
            parts.append(element("path", d=path, fill="none", class_=f"line-{kind}"))
    parts.append(element("text", words, x=_LEFT, y=top - 5.0, class_="label strong"))
    return parts
