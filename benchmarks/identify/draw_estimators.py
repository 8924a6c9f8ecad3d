"""Draws error against disturbance for every method, one panel a ship. Measures nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D

#: what is drawn above this is an arrow at the edge, percent
_TOP = 1000.0
#: method: colour, line style, marker
STYLES = {
    "ml": ("black", "-", "o"),
    "ml, without the heading": ("black", ":", "o"),
    "output-error": ("tab:blue", "-", "s"),
    "output-error, means removed": ("tab:blue", ":", "s"),
    "prediction-error": ("tab:orange", "-", "^"),
    "prediction-error, means removed": ("tab:orange", ":", "^"),
    "subspace": ("tab:green", "-", "v"),
    "subspace, means removed": ("tab:green", ":", "v"),
    "multiple-models": ("tab:purple", "-", "D"),
    "ekf-ols": ("tab:brown", "-", "P"),
    "ekf-ols, without its constant": ("tab:brown", ":", "P"),
    "least-squares": ("0.55", "-", "x"),
    "paper": ("tab:red", "-", "*"),
}


def draw(levels: Sequence[float], error: Mapping[str, Mapping[str, Sequence[float]]], path: Path) -> None:
    """Draw median error, percent, by ship and method over the levels; NaN where a method gave nothing.

    Parameters
    ----------
    levels : sequence of float
        Disturbance over the paper's.
    """
    figure, panels = plt.subplots(1, len(error), figsize=(6.2 * len(error), 6.2), sharey=True, layout="constrained")
    where = list(range(len(levels)))
    # one scale for all panels; NaN, where a method gave nothing, compares as false and drops out
    lowest = min(v for methods in error.values() for values in methods.values() for v in values if v > 0.0)
    for panel, (ship, methods) in zip(panels, error.items(), strict=True):
        for method, values in methods.items():
            colour, line, mark = STYLES[method]
            width = 2.6 if method == "ml" else 1.3
            panel.plot(where, [min(v, _TOP) for v in values], line, color=colour, lw=width, zorder=2)
            inside = [(x, v) for x, v in zip(where, values, strict=True) if v <= _TOP]
            above = [x for x, v in zip(where, values, strict=True) if v > _TOP]
            panel.plot(*zip(*inside, strict=True), mark, color=colour, ms=6, zorder=3) if inside else None
            panel.plot(above, [_TOP] * len(above), marker="$\\uparrow$", ls="", color=colour, ms=9, zorder=3)
        panel.set_yscale("log")
        panel.set_ylim(0.7 * lowest, 1.3 * _TOP)
        panel.set_xticks(where, [f"{level:g}" for level in levels])
        panel.set_xlabel("disturbance, times the paper's (5e-3 m/s$^2$, 0.3 m/s)")
        panel.set_title(ship)
        panel.grid(visible=True, which="major", lw=0.4, color="0.85")
    panels[0].set_ylabel("rms relative error of the six parameters, %, median over seeds")
    methods = list(dict.fromkeys(method for one in error.values() for method in one))
    handles = [
        Line2D([], [], color=STYLES[m][0], ls=STYLES[m][1], marker=STYLES[m][2], lw=2.6 if m == "ml" else 1.3, label=m)
        for m in methods
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=9)
    figure.savefig(path, dpi=110)
    plt.close(figure)
