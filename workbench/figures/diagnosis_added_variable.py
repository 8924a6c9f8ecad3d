"""Added-variable plots: what is left of the innovations against what an effect would explain of them."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np

from kempf.schemas.diagnosis_evidence import AddedVariable
from kempf.workbench.figures.diagnosis_style import FAINT, FULL, INK, new_figure, style


def draw_added_variable(shown: Sequence[AddedVariable]) -> Any:
    """Draw one panel an effect.

    Parameters
    ----------
    shown : sequence of AddedVariable
        At least one.
    """
    with style():
        rows = (len(shown) + 1) // 2
        figure = new_figure(3.3 * rows)
        panels = list(figure.subplots(rows, min(2, len(shown)), squeeze=False).flat)
        for panel, variable in zip(panels, shown, strict=False):
            _draw(panel, variable)
        for panel in panels[len(shown) :]:
            panel.set_visible(False)
        return figure


def _draw(panel: Any, shown: AddedVariable) -> None:
    panel.plot(
        *(shown.expected, shown.left, "."), ms=2.2, mec="none", color=FAINT, rasterized=True, label="one measurement"
    )
    reach = float(np.max(np.abs(shown.expected))) or 1.0
    line = np.linspace(-reach, reach, 2)
    if isfinite(shown.slope_half_95):
        fan = shown.slope_half_95 * np.abs(line)
        panel.fill_between(line, line - fan, line + fan, color=FULL, alpha=0.2, lw=0)
    panel.plot(line, line, color=FULL, label="expected size, with 95 %")
    panel.axhline(0.0, color=INK, lw=0.6)
    mean, half = shown.bin_mean, shown.bin_half_95
    panel.errorbar(shown.bin_middle, mean, half, fmt="o", ms=3.5, color=INK, lw=1, capsize=2, label="means, 95 %")
    height = max(2.2, 1.3 * float(np.max(np.abs(np.concatenate([mean - half, mean + half])))))
    panel.set_ylim(-height, height)
    panel.set_xlabel("what it would explain, standard deviations")
    panel.set_ylabel("what is left, standard deviations")
    panel.set_title(f"{shown.title} (score {shown.score:.3g})")
    panel.legend(loc="upper left", fontsize=7.5)


def describe_added_variable(shown: Sequence[AddedVariable]) -> str:
    """Return the figure in words."""
    slopes = "; ".join(f"{variable.title}, slope {variable.slope:.2f}" for variable in shown)
    return (
        "What is left of the whitened innovations against what the effect would explain of them, both without what the "
        f"fitted parameters can imitate; a slope of 1 is the expected size: {slopes}."
    )
