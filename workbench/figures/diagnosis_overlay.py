"""Measured over predicted: one manoeuvre in free run, under the plain model and under the one with effects."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.workbench.figures.diagnosis_style import CHANNELS, FULL, MEASURED, PLAIN, new_figure, style
from kempf.workbench.report.content import RunView

_NAMES = ("lateral_speed", "yaw_rate", "heading")
_ORDER = (2, 1, 0)
FREE = "free run"


def draw_overlay(view: RunView) -> Any:
    """Draw heading, yaw rate and lateral speed of a run.

    Parameters
    ----------
    view : RunView

    Returns
    -------
    matplotlib.figure.Figure
    """
    used = [i for i in _ORDER if np.isfinite(view.measured[:, i]).any()]
    with style():
        figure = new_figure(0.7 + 1.75 * len(used))
        rows = figure.subplots(*(2 * len(used), 1), sharex=True, squeeze=False, height_ratios=[2.0, 1.0] * len(used))[
            :, 0
        ]
        improved = view.full is not view.plain
        courses = [("plain model", view.plain, PLAIN, "--")]
        if improved:
            courses.append(("model with effects", view.full, FULL, "-"))
        for k, i in enumerate(used):
            panel, below = rows[2 * k : 2 * k + 2]
            words, unit, factor = CHANNELS[i]
            measured = factor * view.measured[:, i]
            panel.plot(view.time_s, measured, ".", ms=3, color=MEASURED, mec="none", label="measured", rasterized=True)
            for label, course, colour, line in courses:
                predicted = factor * course.free[:, i]
                panel.plot(view.time_s, predicted, color=colour, ls=line, label=label)
                below.plot(view.time_s, measured - predicted, color=colour, ls=line, lw=0.9)
            below.axhline(0.0, color="black", lw=0.6)
            panel.set_ylabel(unit)
            below.set_ylabel(f"error,\n{unit}")
            panel.set_title(f"{words}, {unit}: fit in {FREE} {_fits(view, _NAMES[i], improved=improved)}")
        rows[-1].set_xlabel("time from the beginning of the run, s")
        rows[-1].set_xlim(0.0, view.time_s[-1])
        figure.align_ylabels(rows)
        panels = rows
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
        return figure


def _fits(view: RunView, name: str, *, improved: bool) -> str:
    before = view.plain.fit_percent.get(FREE, {}).get(name)
    after = view.full.fit_percent.get(FREE, {}).get(name)
    if before is None:
        return "diverges"
    if not improved or after is None:
        return f"{before:.1f} %"
    return f"{before:.1f} % (plain), {after:.1f} % (with effects)"


def describe_overlay(view: RunView) -> str:
    """Return the figure in words.

    Parameters
    ----------
    view : RunView
    """
    improved = view.full is not view.plain
    told = ", ".join(
        f"{words} {_fits(view, name, improved=improved)}"
        for name, (words, _, _) in zip(_NAMES, CHANNELS, strict=True)
        if name in view.plain.fit_percent.get(FREE, {})
    )
    kind = "held out" if view.held_out else "fitted"
    return f"{view.label}, {kind}: measured over predicted in time, horizon free run. Fit: {told}."
