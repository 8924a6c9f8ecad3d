"""The confusion map: how much of what one effect would explain another would explain alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.schemas.diagnosis_evidence import ConfusionMap
from kempf.workbench.figures.diagnosis_style import FULL, new_figure, style


def draw_confusion(confusion: ConfusionMap) -> Any:
    """Draw the squared cosines."""
    from matplotlib.patches import Rectangle

    n, alike = len(confusion.titles), confusion.squared_cosine
    with style():
        figure = new_figure(0.9 + 0.30 * n)
        panel = figure.subplots()
        for i in range(n):
            for j in range(n):
                value = float(alike[i, j])
                if value < 0.005:
                    continue
                # the colour thins out towards the page, dark or light
                cell = Rectangle((j - 0.5, i - 0.5), 1.0, 1.0, facecolor=FULL, alpha=0.7 * min(value, 1.0), lw=0)
                panel.add_patch(cell)
                if i != j:
                    weight = "bold" if value > confusion.threshold else "normal"
                    panel.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=7.5, fontweight=weight)
        panel.set_xlim(-0.5, n - 0.5)
        panel.set_ylim(n - 0.5, -0.5)
        # names would be longer than the map is wide: columns bear the numbers of the rows
        panel.set_xticks(np.arange(n), [str(k) for k in range(1, n + 1)])
        panel.set_yticks(np.arange(n), [f"{name}  {k}" for k, name in enumerate(confusion.titles, start=1)])
        panel.grid(visible=False)
        panel.tick_params(length=0)
        return figure


def describe_confusion(confusion: ConfusionMap) -> str:
    """Return the figure in words."""
    names, alike, threshold = confusion.titles, confusion.squared_cosine, confusion.threshold
    pairs = [
        (float(alike[i, j]), names[i], names[j]) for i in range(len(names)) for j in range(i) if alike[i, j] > threshold
    ]
    words = "; ".join(f"{a} and {b}, {100 * x:.0f} %" for x, a, b in sorted(pairs, key=lambda p: (-p[0], p[1:]))[:5])
    return "Squared cosine, in percent, between what the highest-scoring effects would explain of the innovations. " + (
        f"Pairs above {100 * threshold:.0f} %: {words}." if words else f"No pair lies above {100 * threshold:.0f} %."
    )
