"""Draws the trial days of one ship: the whole logs above, each zigzag enlarged below. Measures nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.warehouse.tables.segments import Segment

_HEADING, _RUDDER = "tab:blue", "tab:orange"


@dataclass(frozen=True, eq=False)
class Day:
    """One log: its name, series and the zigzags found in it."""

    name: str
    instruments: Instruments
    segments: tuple[Segment, ...]


def draw_ship(vessel: str, days: list[Day], path: Path) -> None:
    """Draw one column a log, and write a PNG."""
    rows = 1 + max(1, *(len(day.segments) for day in days))
    figure, axes = plt.subplots(rows, len(days), figsize=(13, 3.1 * rows), squeeze=False, layout="constrained")
    for column, day in enumerate(days):
        _whole(axes[0, column], day)
        for row in range(1, rows):
            if row <= len(day.segments):
                _zigzag(axes[row, column], day, day.segments[row - 1])
            else:
                axes[row, column].axis("off")
    handles, labels = axes[1, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, frameon=False, fontsize=8)
    figure.suptitle(f"{vessel}: heading and rudder, positive to starboard", fontsize=11)
    figure.savefig(path, dpi=75, metadata={"Software": None})
    plt.close(figure)


def _whole(panel: Any, day: Day) -> None:
    heading, rudder = day.instruments.series["heading"], day.instruments.series["rudder_angle"]
    origin = int(heading.time_utc_ns[0])
    zero = float(heading.value[0])
    turned = (np.rad2deg(heading.value - zero) + 180.0) % 360.0 - 180.0
    # the line breaks where it would run across the panel from 180 to -180
    turned[np.flatnonzero(np.abs(np.diff(turned)) > 180.0)] = np.nan
    minutes = heading.seconds_since(origin) / 60.0
    panel.plot(minutes, turned, lw=0.8, color=_HEADING)
    panel.plot(rudder.seconds_since(origin) / 60.0, np.rad2deg(rudder.value), lw=0.8, color=_RUDDER)
    for segment in day.segments:
        begin, end = ((ns - origin) / 6e10 for ns in (segment.start_utc_ns, segment.end_utc_ns))
        panel.axvspan(begin, end, color="0.85", lw=0)
    found = ", ".join(f"{s.psi0_deg:g}/{s.delta0_deg:g} {s.first_side}" for s in day.segments) or "no zigzag"
    panel.set_title(f"{day.name}: {found}", fontsize=9)
    panel.set_ylabel("deg (heading less the first)", fontsize=8)
    panel.set_yticks(range(-180, 181, 60))
    panel.set_xlabel("min", fontsize=8)
    panel.grid(lw=0.3)
    panel.tick_params(labelsize=8)


def _seconds(series: Series, segment: Segment, margin_ns: int) -> tuple[Series, Float]:
    part = series.between(segment.start_utc_ns - margin_ns, segment.end_utc_ns + margin_ns)
    return part, part.seconds_since(segment.executes_utc_ns[0])


def _zigzag(panel: Any, day: Day, segment: Segment) -> None:
    margin = (segment.end_utc_ns - segment.start_utc_ns) // 12
    heading, at_heading = _seconds(day.instruments.series["heading"], segment, margin)
    rudder, at_rudder = _seconds(day.instruments.series["rudder_angle"], segment, margin)
    turn = round((float(np.rad2deg(np.mean(heading.value))) - segment.base_heading_deg) / 360.0)
    deviation = np.rad2deg(heading.value) - segment.base_heading_deg - 360.0 * turn
    origin = segment.executes_utc_ns[0]
    panel.plot(at_rudder, np.rad2deg(rudder.value), lw=1.0, color=_RUDDER, label="rudder")
    panel.plot(at_heading, deviation, lw=1.2, color=_HEADING, label="heading less $K_0$")
    for k, ns in enumerate(segment.executes_utc_ns):
        panel.axvline((ns - origin) / 1e9, color="k", lw=0.6, ls=":", label=None if k else "execute")
    for side in (1, -1):
        label = r"$\pm\psi_0$" if side > 0 else None
        panel.axhline(side * segment.psi0_deg, color="0.5", lw=0.8, ls="--", label=label)
    panel.axhline(0.0, color="0.7", lw=0.6)
    for k, o in enumerate(segment.detail["overshoots"]):
        side = 1 if o["side"] == "starboard" else -1
        x, y = (o["peak_utc_ns"] - origin) / 1e9, side * (segment.psi0_deg + o["beyond_nominal_deg"])
        panel.plot(x, y, "o", ms=4, color="tab:red", label=None if k else r"overshoot beyond $\psi_0$, deg")
        text = f"{o['beyond_nominal_deg']:.1f}"
        panel.annotate(
            text,
            (x, y),
            (0, 5 * side),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            va="bottom" if side > 0 else "top",
        )
    first, last = ((ns - origin) / 1e9 for ns in (segment.start_utc_ns, segment.end_utc_ns))
    panel.axvspan(first, last, color="0.94", lw=0, zorder=0, label="segment")
    reach = 1.3 * max(segment.psi0_deg + max([0.0, *segment.overshoots_deg]), segment.delta0_deg)
    panel.set_ylim(-reach, reach)
    panel.set_xlim(first - margin / 1e9, last + margin / 1e9)
    panel.set_title(
        f"{segment.psi0_deg:g}/{segment.delta0_deg:g}, first to {segment.first_side}, "
        f"$K_0$ = {segment.base_heading_deg:.1f}°",
        fontsize=9,
    )
    panel.set_ylabel("deg", fontsize=8)
    panel.set_xlabel("s after the first execute", fontsize=8)
    panel.grid(lw=0.3)
    panel.tick_params(labelsize=8)
