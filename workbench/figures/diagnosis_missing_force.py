"""The missing force and moment against drift speed, yaw rate, rudder and heading, before and after."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.workbench.figures.diagnosis_style import FULL, PLAIN, new_figure, style
from kempf.workbench.report.content import MissingForce

_BINS = 12
#: sway in 1e-3 m/s^2, yaw in 1e-3 deg/s^2
_ROWS = (("sway", "sway,\n1e-3 m/s²", 1e3), ("yaw", "yaw,\n1e-3 deg/s²", 1e3 * 180.0 / np.pi))


def draw_missing_force(before: MissingForce, after: MissingForce) -> Any:
    """Draw the accelerations that the disturbances must lend the model.

    Parameters
    ----------
    before, after : MissingForce
        Beside the plain model and beside the last; the same object where no effect was added.

    Returns
    -------
    matplotlib.figure.Figure
    """
    with style():
        figure = new_figure(4.4)
        panels = figure.subplots(2, len(before.against), sharey="row", sharex="col", squeeze=False)
        for row, (name, words, factor) in zip(panels, _ROWS, strict=True):
            row[0].set_ylabel(words)
            for panel, quantity in zip(row, before.against, strict=True):
                panel.axhline(0.0, color="black", lw=0.6)
                shown = [(before, PLAIN, "o", "plain model", -1)]
                if after is not before:
                    shown.append((after, FULL, "s", "model with effects", 1))
                for one, colour, marker, label, _ in shown:
                    x, y = one.against[quantity], factor * getattr(one, name)
                    panel.plot(x, y, ".", ms=1.4, mec="none", color=colour, alpha=0.25, rasterized=True)
                    middle, low, mean, high = spread(x, y)
                    panel.errorbar(
                        *(middle, mean, (mean - low, high - mean)),
                        fmt=marker,
                        ms=3.5,
                        color=colour,
                        lw=1,
                        capsize=1.5,
                        label=label,
                    )
        for panel, quantity in zip(panels[-1], before.against, strict=True):
            panel.set_xlabel(quantity)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
        return figure


def spread(x: Float, y: Float) -> tuple[Float, Float, Float, Float]:
    """Return medians of y over bins of equal width in x, and the quartiles around them.

    Parameters
    ----------
    x, y : ndarray, shape (N,)

    Returns
    -------
    middle, low, median, high : ndarray, shape (b,)
        Bins with fewer than five are left out.
    """
    if not x.size:
        return np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0)
    edges = np.linspace(float(np.min(x)), float(np.max(x)), _BINS + 1)
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _BINS - 1)
    rows = []
    for k in range(_BINS):
        inside = y[place == k]
        if inside.size >= 5:
            rows.append((0.5 * (edges[k] + edges[k + 1]), *np.percentile(inside, [25.0, 50.0, 75.0])))
    middle, low, median, high = np.array(rows).reshape(-1, 4).T
    return middle, low, median, high


def describe_missing_force(before: MissingForce, after: MissingForce) -> str:
    """Return the figure in words.

    Parameters
    ----------
    before, after : MissingForce
    """
    if not before.sway.size or not after.sway.size:
        return "Missing sway and yaw acceleration: the free run of a model runs away, and nothing can be told."
    told = f"{1e3 * np.std(before.sway):.2f} 10⁻³ m/s² beside the plain model"
    if after is not before:
        told += f", {1e3 * np.std(after.sway):.2f} beside the model with effects"
    return (
        "Missing sway and yaw acceleration, given all measurements of each run, against drift speed, yaw rate, rudder "
        f"and heading. Standard deviation of the sway part: {told}."
    )
