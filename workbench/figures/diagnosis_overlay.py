"""Measured over predicted: one manoeuvre in free run under the first model and the last, its rudder beneath."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from kempf.schemas.diagnosis_evidence import ManoeuvreEvidence
from kempf.workbench.figures.diagnosis_style import CHANNELS, FULL, INK, PLAIN, draw_dots, framed_figure, style

_NAMES = ("lateral_speed", "yaw_rate", "heading")
_ORDER = (2, 1, 0)
FREE = "free run"


def draw_overlay(shown: ManoeuvreEvidence, first: str, last: str) -> Any:
    """Draw heading, yaw rate and lateral speed of a manoeuvre, each with its error, and the rudder.

    Parameters
    ----------
    first, last : str
        What the two models are called.
    """
    used = [i for i in _ORDER if np.isfinite(shown.measured[:, i]).any()]
    models = [(first, shown.before, PLAIN, "--")]
    if shown.after is not None:
        models.append((last, shown.after, FULL, "-"))
    with style():
        figure = framed_figure(2.0 + 1.9 * len(used), legend_in=0.25)
        heights = [*([2.0, 1.0] * len(used)), 1.2]
        panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for k, i in enumerate(used):
            panel, below = panels[2 * k : 2 * k + 2]
            words, unit, factor = CHANNELS[i]
            draw_dots(panel, shown.time_s, factor * shown.measured[:, i])
            for label, predicted, colour, line in models:
                panel.plot(shown.time_s, factor * predicted.free_run[:, i], color=colour, ls=line, label=label)
                below.plot(shown.time_s, factor * predicted.free_run_error[:, i], color=colour, ls=line, lw=0.9)
            below.axhline(0.0, color=INK, lw=0.6)
            panel.set_ylabel(unit)
            below.set_ylabel(f"error,\n{unit}")
            panel.set_title(f"{words}, {unit}: fit in {FREE} {_fits(shown, _NAMES[i], first, last)}")
        rudder = panels[-1]
        rudder.plot(shown.time_s, np.degrees(shown.rudder), color=INK, lw=1.0)
        rudder.axhline(0.0, color=INK, lw=0.6)
        rudder.set_ylabel("deg")
        rudder.set_title("rudder, deg, positive to starboard")
        rudder.set_xlabel("time from the beginning of the manoeuvre, s")
        rudder.set_xlim(0.0, shown.time_s[-1])
        figure.align_ylabels(panels)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper right", ncols=3)
        return figure


def _fits(shown: ManoeuvreEvidence, name: str, first: str, last: str) -> str:
    before = shown.before.fit_percent.get(FREE, {}).get(name)
    if shown.after is None:
        return _percent(before)
    return f"{_percent(before)} ({first}), {_percent(shown.after.fit_percent.get(FREE, {}).get(name))} ({last})"


def _percent(fit: float | None) -> str:
    return "diverges" if fit is None or not isfinite(fit) else f"{fit:.1f} %"


def describe_overlay(shown: ManoeuvreEvidence, label: str, first: str, last: str) -> str:
    """Return the figure in words.

    Parameters
    ----------
    label : str
        Of the manoeuvre.
    first, last : str
        What the two models are called.
    """
    fits = ", ".join(
        f"{words} {_fits(shown, name, first, last)}"
        for i, (name, (words, _, _)) in enumerate(zip(_NAMES, CHANNELS, strict=True))
        if np.isfinite(shown.measured[:, i]).any()
    )
    kind = "held out" if shown.held_out else "fitted"
    return f"{label}, {kind}: measured over predicted in time, horizon free run, rudder beneath. Fit: {fits}."
