"""The confusion map: how much of what one effect would explain another would explain alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.confusion_sets import ALIKE
from kempf.workbench.figures.diagnosis_style import new_figure, style


def draw_confusion(names: Sequence[str], alike: Float) -> Any:
    """Draw the squared cosines.

    Parameters
    ----------
    names : sequence of str
    alike : ndarray, shape (k, k)
        0 to 1.

    Returns
    -------
    matplotlib.figure.Figure
    """
    n = len(names)
    with style():
        figure = new_figure(0.9 + 0.30 * n)
        panel = figure.subplots()
        image = panel.imshow(alike, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        for i in range(n):
            for j in range(n):
                if i != j and alike[i, j] >= 0.005:
                    panel.text(
                        *(j, i, f"{100 * alike[i, j]:.0f}"),
                        ha="center",
                        va="center",
                        fontsize=7,
                        color="white" if alike[i, j] > 0.55 else "black",
                        fontweight="bold" if alike[i, j] > ALIKE else "normal",
                    )
        # names would be longer than the map is wide: columns bear the numbers of the rows
        panel.set_xticks(np.arange(n), [str(k) for k in range(1, n + 1)])
        panel.set_yticks(np.arange(n), [f"{name}  {k}" for k, name in enumerate(names, start=1)])
        panel.grid(visible=False)
        panel.tick_params(length=0)
        bar = figure.colorbar(image, ax=panel, shrink=0.8)
        bar.set_label("squared cosine (numbers: percent)")
        return figure


def describe_confusion(names: Sequence[str], alike: Float) -> str:
    """Return the figure in words.

    Parameters
    ----------
    names : sequence of str
    alike : ndarray, shape (k, k)
    """
    pairs = [
        (float(alike[i, j]), names[i], names[j]) for i in range(len(names)) for j in range(i) if alike[i, j] > ALIKE
    ]
    told = "; ".join(f"{a} and {b}, {100 * x:.0f} %" for x, a, b in sorted(pairs, key=lambda p: (-p[0], p[1:]))[:5])
    return "Squared cosine between what the highest-scoring effects would explain of the innovations. " + (
        f"Pairs above {100 * ALIKE:.0f} %: {told}." if told else f"No pair lies above {100 * ALIKE:.0f} %."
    )
