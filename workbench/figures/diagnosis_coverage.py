"""Coverage: the motions, rudder angles and speeds of the manoeuvres; beyond them the model extrapolates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kempf.schemas.diagnosis_evidence import ManoeuvreEvidence
from kempf.workbench.figures.diagnosis_style import FULL, PLAIN, new_figure, style


def draw_coverage(manoeuvres: Sequence[ManoeuvreEvidence]) -> Any:
    """Draw lateral speed against yaw rate, and rudder against speed."""
    with style():
        figure = new_figure(3.4)
        left, right = figure.subplots(1, 2)
        for held, colour, marker, label in ((False, PLAIN, "o", "fitted"), (True, FULL, "x", "held out")):
            chosen = [manoeuvre for manoeuvre in manoeuvres if manoeuvre.held_out is held]
            look = {"ls": "", "marker": marker, "ms": 2.6, "color": colour, "alpha": 0.6, "rasterized": True}
            look["mew"] = 0.6 if held else 0.0
            for k, manoeuvre in enumerate(chosen):
                words = f"{label} ({len(chosen)})" if k == 0 else None
                left.plot(np.degrees(manoeuvre.turn), manoeuvre.drift, label=words, **look)
                right.plot(np.degrees(manoeuvre.rudder), manoeuvre.speed, label=words, **look)
        left.set_xlabel("yaw rate r, deg/s")
        left.set_ylabel("lateral speed v, m/s")
        left.set_title("motion")
        right.set_xlabel("rudder δ, deg")
        right.set_ylabel("speed V, m/s")
        right.set_title("rudder and speed")
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2, markerscale=2.0)
        return figure


def describe_coverage(ranges: Mapping[str, tuple[float, float]]) -> str:
    """Return the figure in words.

    Parameters
    ----------
    ranges : mapping of str to (float, float)
        As `kempf.schemas.diagnosis_evidence.DiagnosisEvidence.ranges`.
    """
    words = (
        *(("drift", "lateral speed", 1.0, "m/s"), ("turn", "yaw rate", np.degrees(1.0), "deg/s")),
        *(("rudder", "rudder", np.degrees(1.0), "deg"), ("speed", "speed", 1.0, "m/s")),
    )
    spans = ", ".join(
        f"{name} {factor * ranges[key][0]:.3g} to {factor * ranges[key][1]:.3g} {unit}"
        for key, name, factor, unit in words
    )
    return f"What the manoeuvres cover: {spans}."
