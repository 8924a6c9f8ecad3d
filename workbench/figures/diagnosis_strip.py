"""One-step innovations of a manoeuvre in time, shaded by phase."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.diagnosis_evidence import ManoeuvreEvidence
from kempf.workbench.figures.diagnosis_style import (
    CHANNELS,
    FAINT,
    FULL,
    PHASE_COLOURS,
    PHASE_WORDS,
    PLAIN,
    framed_figure,
    style,
)

_LIMIT = 5.0
_ORDER = (2, 1, 0)


def draw_strip(shown: ManoeuvreEvidence, first: str, last: str) -> Any:
    """Draw the whitened innovations of a manoeuvre.

    Parameters
    ----------
    first, last : str
        What the two models are called.
    """
    from matplotlib.patches import Patch

    used = [i for i in _ORDER if np.isfinite(shown.measured[:, i]).any()]
    with style():
        figure = framed_figure(1.4 + 1.15 * len(used), legend_in=0.3)
        panels = figure.subplots(len(used), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
        for panel, i in zip(panels, used, strict=True):
            for phase in shown.phases:
                if phase.name in PHASE_COLOURS:
                    panel.axvspan(phase.start_s, phase.end_s, color=PHASE_COLOURS[phase.name], lw=0, zorder=0)
            for level in (-NORMAL_95, NORMAL_95):
                panel.axhline(level, color=FAINT, lw=0.8, ls="--", zorder=1)
            _dots(panel, shown.time_s, shown.before.whitened[:, i], PLAIN, "x", first)
            if shown.after is not None:
                _dots(panel, shown.time_s, shown.after.whitened[:, i], FULL, "o", last)
            panel.set_ylabel(CHANNELS[i][0])
            panel.grid(visible=False)
        panels[0].set_ylim(-_LIMIT, _LIMIT)
        panels[-1].set_xlim(0.0, shown.time_s[-1])
        panels[-1].set_xlabel("time from the beginning of the manoeuvre, s")
        phases = [name for name in PHASE_COLOURS if any(phase.name == name for phase in shown.phases)]
        patches = [Patch(facecolor=PHASE_COLOURS[n], edgecolor=FAINT, lw=0.5, label=PHASE_WORDS[n]) for n in phases]
        handles, _ = panels[0].get_legend_handles_labels()
        figure.legend(handles=[*handles, *patches], loc="upper center", ncols=4)
        return figure


def _dots(panel: Any, time: Any, values: Any, colour: str, marker: str, label: str) -> None:
    # what leaves the panel is drawn at its edge
    inside = np.clip(values, -0.97 * _LIMIT, 0.97 * _LIMIT)
    small = {"ms": 2.4, "mew": 0.6 if marker == "x" else 0.0, "alpha": 0.75}
    panel.plot(time, inside, marker, color=colour, label=label, ls="", rasterized=True, **small)


def describe_strip(shown: ManoeuvreEvidence, label: str, first: str, last: str) -> str:
    """Return the figure in words.

    Parameters
    ----------
    label : str
        Of the manoeuvre.
    first, last : str
        What the two models are called.
    """
    sizes = [
        f"{name} {predicted.whitened_rms:.2f}"
        for name, predicted in ((first, shown.before), (last, shown.after))
        if predicted is not None and isfinite(predicted.whitened_rms)
    ]
    return (
        f"{label}: whitened one-step innovations in time, shaded by phase. Root mean square, 1 when the model is "
        f"right: {', '.join(sizes)}."
    )
