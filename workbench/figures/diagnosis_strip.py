"""The innovation strip: what each measurement tells beyond its prediction one step ahead, shaded by phase."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.workbench.figures.diagnosis_style import (
    CHANNELS,
    FULL,
    PHASE_COLOURS,
    PHASE_WORDS,
    PLAIN,
    new_figure,
    style,
)
from kempf.workbench.report.content import RunView

_LIMIT = 5.0
_ORDER = (2, 1, 0)


def draw_strip(view: RunView) -> Any:
    """Draw the whitened innovations of a run.

    Parameters
    ----------
    view : RunView

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.patches import Patch

    used = [i for i in _ORDER if np.isfinite(view.measured[:, i]).any()]
    improved = view.full is not view.plain
    with style():
        figure = new_figure(0.9 + 1.1 * len(used))
        panels = figure.subplots(len(used), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for panel, i in zip(panels, used, strict=True):
            for one in view.phases:
                panel.axvspan(one.start_s, one.end_s, color=PHASE_COLOURS.get(one.name, "white"), lw=0, zorder=0)
            for level in (-1.96, 1.96):
                panel.axhline(level, color="0.35", lw=0.7, ls="--", zorder=1)
            if improved:
                _dots(panel, view.time_s, view.plain.whitened[:, i], PLAIN, "x", "plain model")
            _dots(
                *(panel, view.time_s, view.full.whitened[:, i], FULL if improved else PLAIN, "o"),
                "model with effects" if improved else "plain model",
            )
            panel.set_ylabel(CHANNELS[i][0])
            panel.grid(visible=False)
        panels[0].set_ylim(-_LIMIT, _LIMIT)
        panels[-1].set_xlim(0.0, view.time_s[-1])
        panels[-1].set_xlabel("time from the beginning of the run, s")
        phases = [name for name in PHASE_COLOURS if any(one.name == name for one in view.phases)]
        patches = [Patch(facecolor=PHASE_COLOURS[n], edgecolor="0.6", lw=0.5, label=PHASE_WORDS[n]) for n in phases]
        handles, _ = panels[0].get_legend_handles_labels()
        figure.legend(handles=[*handles, *patches], loc="outside upper center", ncols=4)
        return figure


def _dots(panel: Any, time: Any, values: Any, colour: str, marker: str, label: str) -> None:
    # what leaves the panel is drawn at its edge
    shown = np.clip(values, -0.97 * _LIMIT, 0.97 * _LIMIT)
    small = {"ms": 2.4, "mew": 0.6 if marker == "x" else 0.0, "alpha": 0.75}
    panel.plot(time, shown, marker, color=colour, label=label, ls="", rasterized=True, **small)


def describe_strip(view: RunView) -> str:
    """Return the figure in words.

    Parameters
    ----------
    view : RunView
    """
    told = []
    for name, course in (("plain model", view.plain), ("model with effects", view.full)):
        good = course.whitened[np.isfinite(course.whitened)]
        if good.size and (name == "plain model" or view.full is not view.plain):
            told.append(f"{name} {float(np.sqrt(np.mean(good**2))):.2f}")
    return (
        f"{view.label}: whitened one-step innovations in time, shaded by phase. Root mean square, 1 when the model is "
        f"right: {', '.join(told)}."
    )
