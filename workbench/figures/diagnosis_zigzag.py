"""Heading and rudder of a zigzag, its overshoots and what IMO resolution MSC.137(76) allows of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.workbench.figures.diagnosis_style import FULL, MEASURED, PLAIN, new_figure, style
from kempf.workbench.report.content import RunView

_PLACES = {"first overshoot": 0, "second overshoot": 1}


def limits(view: RunView) -> dict[int, float]:
    """Return the limits of the overshoots that have one, deg, by number from 0.

    Parameters
    ----------
    view : RunView
    """
    found = {}
    for name, one in view.imo.items():
        for words, place in _PLACES.items():
            if name.endswith(words) and one.get("limit_deg") is not None:
                found[place] = float(one["limit_deg"])
    return found


def draw_zigzag(view: RunView) -> Any:
    """Draw heading from the base course and rudder in one panel.

    Parameters
    ----------
    view : RunView

    Returns
    -------
    matplotlib.figure.Figure
    """
    heading = _deviation(view, view.measured[:, 2])
    if not np.isfinite(heading).any():
        heading = _deviation(view, view.heading_rad)
    with style():
        figure = new_figure(2.9)
        panel = figure.subplots()
        panel.axhline(0.0, color="black", lw=0.5)
        for side in (-1, 1):
            panel.axhline(side * view.psi0_deg, color="0.5", lw=0.7, ls=":")
        panel.plot(view.time_s, np.degrees(view.rudder_rad), color=PLAIN, lw=1.0, ls="--", label="rudder")
        panel.plot(view.time_s, heading, color=MEASURED, label="heading from the base course")
        allowed = limits(view)
        for k, (at, side, beyond) in enumerate(view.peaks):
            top = side * (view.psi0_deg + beyond)
            panel.plot([at, at], [side * view.psi0_deg, top], color=FULL, lw=2.2, label="overshoot" if k == 0 else None)
            panel.annotate(
                f"{beyond:.1f}°",
                (at, top),
                (0, 7 * side),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=8,
                color=FULL,
            )
            if k in allowed:
                level = side * (view.psi0_deg + allowed[k])
                width = 0.04 * float(view.time_s[-1])
                label = None if k != min(allowed) else "largest that IMO allows"
                panel.plot([at - width, at + width], [level, level], color="#CC79A7", lw=2.4, label=label)
        low, high = panel.get_ylim()
        panel.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
        panel.set_xlim(0.0, view.time_s[-1])
        panel.set_xlabel("time from the beginning of the run, s")
        panel.set_ylabel("deg, positive to starboard")
        handles, labels = panel.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=4)
        return figure


def _deviation(view: RunView, heading_rad: Any) -> Any:
    """Heading from the base course, deg, whichever turn and whichever zero it is counted from."""
    first = view.time_s <= max(view.executes_s[0] if view.executes_s else 5.0, view.time_s[1])
    start = np.degrees(np.nanmean(view.heading_rad[first])) - view.base_heading_deg
    approach = (start + 180.0) % 360.0 - 180.0
    known = heading_rad[first]
    if not np.isfinite(known).any():
        return np.full(heading_rad.shape, np.nan)
    return np.degrees(heading_rad - np.nanmean(known)) + approach


def describe_zigzag(view: RunView) -> str:
    """Return the figure in words.

    Parameters
    ----------
    view : RunView
    """
    told = ", ".join(f"{beyond:.1f}" for _, _, beyond in view.peaks) or "none"
    return f"{view.label}: heading and rudder in time. Overshoots beyond the nominal heading, degrees: {told}."
