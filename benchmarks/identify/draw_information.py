"""Draws the Monte Carlo at the information limit. Measures nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from benchmarks.identify.information_result import Cell
from kempf.pipeline.channels.series import Float
from kempf.schemas.model_spec import HULL_PARAMETERS

_PARAMETERS = tuple(HULL_PARAMETERS)


def draw_information(grid: Sequence[Cell], cells: Sequence[Cell], paper_percent: Float, path: Path) -> None:
    """Draw ratio to the true bound, ratio to the own one, coverage and bias by cell, and the paper's scenario.

    Parameters
    ----------
    grid : sequence of Cell
        Five hulls, three noise levels.
    cells : sequence of Cell
        All, of which those of the paper's scenario are taken.
    paper_percent : ndarray, shape (6,)
        Errors that the paper reports.
    """
    figure, axes = plt.subplots(3, 2, figsize=(13, 12), layout="constrained")
    runs = max(len(c.z) for c in grid)
    spread = 2.0 / np.sqrt(2.0 * runs)
    _by_cell(axes[0, 0], grid, [c.rms / c.bound for c in grid], "rms error / bound at the truth", (0.0, 1.1), spread)
    _by_cell(axes[0, 1], grid, [c.rms / c.own for c in grid], "rms error / reported standard error", (0.0, 1.1), spread)
    covered = [100 * c.covered for c in grid]
    _by_cell(axes[1, 0], grid, covered, "covered by the 95 % interval, %", (93.0, 97.0), None)
    axes[1, 0].set_ylim(max(50.0, min(float(np.min(covered)) - 2.0, 88.0)), 100.5)
    _by_cell(axes[1, 1], grid, [c.bias / c.own for c in grid], "bias / reported standard error", (-0.2, 0.2), None)
    axes[1, 1].set_ylim(-1.5, 1.5)
    for panel, with_heading in ((axes[2, 0], False), (axes[2, 1], True)):
        chosen = [
            c
            for c in cells
            if c.case.scale == 1.0
            and c.case.environment == "paper"
            and not c.case.control
            and c.case.with_heading == with_heading
        ]
        _scenario(panel, chosen, paper_percent)
        measured = "y_v, y_r and heading" if with_heading else "y_v and y_r only"
        panel.set_title(f"the paper's scenario, {measured}", fontsize=10)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    plt.close(figure)


def _by_cell(
    panel: Axes,
    grid: Sequence[Cell],
    values: Sequence[Float],
    title: str,
    wanted: tuple[float, float],
    spread: float | None,
) -> None:
    """One column a cell, one mark a parameter; the wanted band shaded, marks off the panel drawn at its edge."""
    x = np.arange(len(grid))
    panel.axhspan(*wanted, color="0.92", zorder=0)
    if spread is not None:
        # a ratio of 1 would be seen in here, 19 times of 20
        panel.axhline(1.0, color="0.4", lw=0.8)
        panel.axhspan(1.0 - spread, 1.0 + spread, color="C2", alpha=0.2, lw=0)
        panel.set_ylim(0.3, 2.0)
    low, high = panel.get_ylim() if spread is not None else (-1.45, 1.45) if wanted[0] < 0 else (51.0, 101.0)
    for i, name in enumerate(_PARAMETERS):
        column = np.array([v[i] for v in values])
        shown = np.clip(column, low, high)
        panel.plot(x + 0.11 * (i - 2.5), shown, "o", ms=4, color=f"C{i}", label=name, clip_on=False)
    panel.set_xticks(x, [f"x {c.case.scale:g}" for c in grid], fontsize=7)
    for hull in dict.fromkeys(c.case.hull for c in grid):
        middle = float(np.mean([k for k, c in enumerate(grid) if c.case.hull == hull]))
        panel.text(middle, -0.09, hull, transform=panel.get_xaxis_transform(), ha="center", va="top", fontsize=8)
    for edge in np.arange(2.5, len(grid) - 1, 3.0):
        panel.axvline(edge, color="0.8", lw=0.6)
    panel.set_title(title, fontsize=10)
    panel.grid(axis="y", lw=0.3)
    covered = wanted[0] > 50.0
    panel.legend(ncols=6, fontsize=7, frameon=False, loc="lower left" if covered else "upper left")


def _scenario(panel: Axes, chosen: Sequence[Cell], paper_percent: Float) -> None:
    """Errors of all ships in percent by parameter, the bound as a tick, the paper's error and a third of it as bars."""
    x = np.arange(len(_PARAMETERS))
    panel.bar(x, paper_percent, 0.8, color="0.88", label="the paper's error")
    panel.bar(x, paper_percent / 3.0, 0.8, color="0.78", label="a third of it")
    for k, c in enumerate(chosen):
        at = x + 0.14 * (k - 0.5 * (len(chosen) - 1))
        panel.plot(at, 100 * c.rms, "o", ms=4.5, color=f"C{k}", label=c.case.hull)
        panel.plot(at, 100 * c.bound, "_", ms=9, color="k", label="bound at the truth" if k == 0 else None)
    panel.set_yscale("log")
    panel.set_ylim(0.05, 300.0)
    panel.set_xticks(x, _PARAMETERS)
    panel.set_ylabel("rms error, %")
    panel.grid(axis="y", lw=0.3)
    panel.legend(ncols=4, fontsize=7, frameon=False, loc="upper left")
