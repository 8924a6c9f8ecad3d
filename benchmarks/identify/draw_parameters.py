"""Draws the six parameters of many runs, by several methods, with their standard errors. Measures nothing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from kempf.pipeline.channels.series import Float
from kempf.schemas.model_spec import HULL_PARAMETERS

_COLOURS = ("tab:red", "tab:blue", "0.25")
_MARKS = ("s", "o", "x")


@dataclass(frozen=True, eq=False)
class Cloud:
    """Estimates by one method: values and standard errors, shape (n_run, 6) each."""

    label: str
    value: Float
    std: Float


def draw_parameters(clouds: list[Cloud], names: list[str], path: Path) -> None:
    """Draw one panel a parameter, nondimensional; what lies outside the panel is an arrow at its edge.

    The panel is laid round the methods after the first one, which may be far off.
    """
    figure, axes = plt.subplots(2, 3, figsize=(13, 7), sharex=True, layout="constrained")
    where = np.arange(len(names))
    for i, (panel, parameter) in enumerate(zip(axes.flat, HULL_PARAMETERS, strict=True)):
        inner = np.concatenate([c.value[:, i] for c in clouds[1:]])
        low, high = np.nanpercentile(inner, [4, 96])
        margin = 0.35 * (high - low)
        low, high = min(low - margin, 0.0), max(high + margin, 0.0)
        for k, cloud in enumerate(clouds):
            value, std = cloud.value[:, i], cloud.std[:, i]
            x = where + 0.22 * (k - 1)
            inside = (value >= low) & (value <= high)
            label = cloud.label if i == 0 else None
            style = {"fmt": _MARKS[k], "ms": 4, "color": _COLOURS[k], "lw": 1.2, "capsize": 2}
            errors = np.where(np.isfinite(std), std, 0.0)
            panel.errorbar(x[inside], value[inside], errors[inside], label=label, **style)
            for above, edge, mark in ((value > high, high, "^"), (value < low, low, "v")):
                edges = np.full(int(above.sum()), edge)
                panel.plot(x[above], edges, mark, color=_COLOURS[k], ms=5, clip_on=False, mfc="none")
        panel.axhline(0.0, color="0.6", lw=0.8)
        panel.set_ylim(low, high)
        panel.set_title(f"{parameter}'  (–)", fontsize=10)
        panel.grid(lw=0.3)
        panel.set_xticks(where, names, rotation=60, fontsize=8)
    figure.supxlabel(
        "run: rudder and heading, deg; bars: one standard error; open triangle: outside the panel", fontsize=9
    )
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)
