"""The doctor's figure: what the checks measured beside what sound channels give, the motions before and after."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kempf.flows.jobs.ingest.examine_log import ExaminedLog
from kempf.pipeline.channels.doctor.log import Log, integral
from kempf.pipeline.channels.doctor.outcome import CheckFigure
from kempf.pipeline.channels.series import Float, Nanoseconds
from kempf.schemas.enumeration import as_words
from kempf.schemas.units import SECOND_NS
from kempf.workbench.figures.drawn import pyplot, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = {"agree": "tab:green", "disagree": "tab:red", "untestable": "0.6"}
_TURNS = {
    "heading": "heading",
    "rate": "integral of the yaw rate",
    "course": "course",
    "earth": "direction of the velocity components",
}
#: Points of a line in the figure, at most.
_POINTS = 2000


def draw(examined_log: ExaminedLog, path: Path) -> None:
    """Draw an examination.

    Parameters
    ----------
    path : Path
        Ending ``.png``, ``.svg`` or ``.pdf``.
    """
    rows = [(outcome, figure) for outcome in examined_log.examination.outcomes for figure in outcome.figures]
    corrected = examined_log.log
    for finding in examined_log.examination.findings:
        corrected = finding.faults[0].corrected(corrected) if finding.faults else corrected
    sides = [("as logged", examined_log.log)] + (
        [("corrected", corrected)] if corrected is not examined_log.log else []
    )
    height = 0.24 * max(len(rows), 1) + 1.0
    sheet = pyplot().figure(figsize=(12, height + 7.5), layout="constrained")
    upper, lower = np.asarray(sheet.subfigures(2, 1, height_ratios=[height, 7.5]))
    _forest(upper.subplots(), rows)
    panels = lower.subplots(3, len(sides), sharex=True, sharey="row", squeeze=False)
    for column, (title, log) in enumerate(sides):
        _turns(panels[0, column], log)
        _rudder(panels[1, column], log)
        _speeds(panels[2, column], log)
        panels[0, column].set_title(title)
        panels[2, column].set_xlabel("time, s")
    sheet.suptitle(f"{examined_log.file_name}: {examined_log.examination.verdict}")
    save(sheet, path, 110)


def _forest(panel: Axes, rows: list[tuple[Any, CheckFigure]]) -> None:
    """Draw each figure between what is expected, which is scaled to -1 to 1; beyond 4 it is drawn at the edge."""
    for k, (outcome, figure) in enumerate(rows):
        middle, half = _band(figure)
        value, std = (figure.value - middle) / half, figure.std / half
        at = float(np.clip(value, -4.0, 4.0))
        panel.errorbar(at, -k, xerr=min(4.0 * std, 8.0), fmt="o" if at == value else ">" if at > 0 else "<", ms=4,
                       color=_COLOURS[figure.state], lw=1)  # fmt: skip
        panel.text(4.3, -k, f"{figure.value:.3g} ± {figure.std:.1g} {figure.unit}", va="center", fontsize=7)
        del outcome
    panel.axvspan(-1.0, 1.0, color="0.92", lw=0)
    panel.set_yticks([-k for k in range(len(rows))], [f"{o.check}: {f.name}" for o, f in rows], fontsize=7)
    panel.set_xlim(-4.2, 6.0)
    panel.set_xticks([-1, 1], ["expected from", "to"])
    panel.set_title("values with bars of 4 s.e. (numbers: ± 1 s.e.); grey: expected range", fontsize=9)


def _band(figure: CheckFigure) -> tuple[float, float]:
    if not np.isfinite(figure.high):
        # one-sided: nought is the lower edge
        scale = max(abs(figure.value), 4.0 * figure.std, 1e-12)
        return figure.low + scale, scale
    return 0.5 * (figure.low + figure.high), max(0.5 * (figure.high - figure.low), 1e-12)


def _line(panel: Axes, origin: int, time: Nanoseconds, value: Float, label: str, **style: Any) -> None:
    every = max(time.size // _POINTS, 1)
    panel.plot((time[::every] - origin) / SECOND_NS, value[::every], label=label, lw=0.9, **style)


def _origin(log: Log) -> int:
    return min((int(series.time_utc_ns[0]) for series in log.series.values()), default=0)


def _turns(panel: Axes, log: Log) -> None:
    origin = _origin(log)
    angles: dict[str, tuple[Nanoseconds, Float]] = {}
    if "heading" in log.series:
        angles["heading"] = (log.series["heading"].time_utc_ns, log.series["heading"].value)
    if "yaw_rate" in log.series:
        turned = integral(log.series["yaw_rate"])
        angles["rate"] = (turned.time_utc_ns, turned.value)
    for kind in ("course", "earth"):
        velocity = log.velocity(kind)
        if velocity is not None:
            angles[kind] = (velocity.time_utc_ns[velocity.under_way], velocity.direction[velocity.under_way])
    for kind, (time, value) in angles.items():
        if value.size:
            _line(panel, origin, time, np.rad2deg(value - (value[0] if kind == "rate" else 0.0)), _TURNS[kind])
    panel.set_ylabel("turned, deg")
    _finish(panel)


def _rudder(panel: Axes, log: Log) -> None:
    origin = _origin(log)
    for name in ("rudder_order", "rudder_angle"):
        if name in log.series:
            series = log.series[name]
            _line(panel, origin, series.time_utc_ns, np.rad2deg(series.value), as_words(name))
    panel.set_ylabel("rudder, deg")
    _finish(panel)


def _speeds(panel: Axes, log: Log) -> None:
    origin = _origin(log)
    for kind, label in (("track", "between fixes"), ("course", "over ground"), ("earth", "velocity components")):
        velocity = log.velocity(kind)
        if velocity is not None:
            _line(panel, origin, velocity.time_utc_ns, np.abs(velocity.value), label)
    if "speed_through_water" in log.series:
        series = log.series["speed_through_water"]
        _line(panel, origin, series.time_utc_ns, series.value, "through the water")
    panel.set_ylabel("speed, m/s")
    _finish(panel)


def _finish(panel: Axes) -> None:
    panel.grid(lw=0.3)
    if panel.lines:
        panel.legend(fontsize=7, loc="upper right")
