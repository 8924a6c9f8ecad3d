"""Added-variable plots: what is left of the innovations against what an effect would explain of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.workbench.figures.diagnosis_style import FULL, new_figure, style
from kempf.workbench.report.content import AddedVariable

_BINS, _WIDTH_95 = 14, 1.96


def draw_added_variable(found: Sequence[AddedVariable]) -> Any:
    """Draw one panel an effect.

    Parameters
    ----------
    found : sequence of AddedVariable
        At least one.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with style():
        rows = (len(found) + 1) // 2
        figure = new_figure(3.3 * rows)
        panels = figure.subplots(rows, min(2, len(found)), squeeze=False)
        for panel, one in zip(panels.flat, found, strict=False):
            _draw(panel, one)
        for panel in list(panels.flat)[len(found) :]:
            panel.set_visible(False)
        return figure


def _draw(panel: Any, one: AddedVariable) -> None:
    panel.plot(one.expected, one.left, ".", ms=2.2, mec="none", color="0.65", rasterized=True, label="one measurement")
    reach = float(np.max(np.abs(one.expected))) or 1.0
    line = np.linspace(-reach, reach, 2)
    panel.fill_between(line, *_fan(line, one.score), color=FULL, alpha=0.15, lw=0)
    panel.plot(line, line, color=FULL, label="as foretold, with 95 %")
    panel.axhline(0.0, color="black", lw=0.6)
    middle, mean, half = binned(one.expected, one.left)
    panel.errorbar(middle, mean, half, fmt="o", ms=3.5, color="black", lw=1, capsize=2, label="means, 95 %")
    height = max(2.2, 1.3 * float(np.max(np.abs(np.concatenate([mean - half, mean + half])))))
    panel.set_ylim(-height, height)
    panel.set_xlabel("what it would explain, standard deviations")
    panel.set_ylabel("what is left, standard deviations")
    panel.set_title(f"{one.title} (score {one.score:.3g})")
    panel.legend(loc="upper left", fontsize=7.5)


def _fan(line: Float, score: float) -> tuple[Float, Float]:
    half = _WIDTH_95 / np.sqrt(max(score, 1e-12)) * np.abs(line)
    return line - half, line + half


def binned(x: Float, y: Float) -> tuple[Float, Float, Float]:
    """Return means of y over bins of x that hold equally many, and half the width of their 95 % intervals.

    Parameters
    ----------
    x, y : ndarray, shape (N,)

    Returns
    -------
    middle, mean, half : ndarray, shape (b,)
    """
    order = np.argsort(x, kind="stable")
    parts = [part for part in np.array_split(order, _BINS) if part.size > 1]
    middle = np.array([np.mean(x[part]) for part in parts])
    mean = np.array([np.mean(y[part]) for part in parts])
    half = np.array([_WIDTH_95 * np.std(y[part], ddof=1) / np.sqrt(part.size) for part in parts])
    return middle, mean, half


def describe_added_variable(found: Sequence[AddedVariable]) -> str:
    """Return the figure in words.

    Parameters
    ----------
    found : sequence of AddedVariable
    """
    told = []
    for one in found:
        slope = float(one.expected @ one.left / max(float(one.expected @ one.expected), 1e-300))
        told.append(f"{one.title}, slope {slope:.2f}")
    return (
        "What is left of the whitened innovations against what the effect would explain of them, both without what the "
        f"fitted parameters can imitate; a slope of 1 is the expected change: {'; '.join(told)}."
    )
