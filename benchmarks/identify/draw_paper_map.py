"""Draws the map of the paper's procedure and its errors by cause. Measures nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.colors import LogNorm

from kempf.pipeline.channels.series import Float

_CAUSES = {
    "predicted": ("predicted by the attenuation", "k--"),
    "undisturbed": ("(14), true disturbances taken off", "ko"),
    "settled": ("procedure, settling left out", "C0.-"),
    "written": ("procedure as written", "C3.-"),
}


def draw_paper_map(
    maps: Sequence[tuple[str, Sequence[Any]]],
    axes_values: tuple[Sequence[float], Sequence[float]],
    parts: dict[str, Float],
    path: Path,
) -> None:
    """Draw the maps side by side, the errors by cause to the right.

    Parameters
    ----------
    maps : sequence of (str, sequence of Cell)
        Title, and cells with the noise running fastest.
    axes_values : (sequence of float, sequence of float)
        Noises and variabilities.
    parts : dict of str to ndarray, shape (n_noise, 6)
        Mean errors in percent by cause.
    """
    noises, variabilities = axes_values
    figure, axes = plt.subplots(1, len(maps) + 1, figsize=(17, 5), layout="constrained")
    for panel, (title, cells) in zip(axes, maps, strict=False):
        worst = np.array([c.worst_percent for c in cells]).reshape(len(variabilities), len(noises))
        image = panel.imshow(
            np.clip(worst, 5.0, 500.0), norm=LogNorm(5.0, 500.0), cmap="RdYlGn_r", origin="lower", aspect="auto"
        )
        for k, cell in enumerate(cells):
            total = sum(cell.ends.values())
            settled = f"{cell.ends['converged']}/{total} conv."
            lost = "".join(f"\n{cell.ends[e]}/{total} {e}" for e in ("cycling", "diverged") if cell.ends[e])
            text = f"{cell.worst_percent:.0f} %\n{settled}{lost}"
            panel.text(k % len(noises), k // len(noises), text, ha="center", va="center", fontsize=7)
        panel.set_xticks(range(len(noises)), [f"{n:g}" for n in noises])
        panel.set_yticks(range(len(variabilities)), [f"{v:g}" for v in variabilities])
        panel.set_xlabel("noise, times that of usual instruments")
        panel.set_ylabel("variability of force and current, times their mean")
        panel.set_title(f"{title}: median worst error, %", fontsize=10)
    figure.colorbar(image, ax=list(axes[: len(maps)]), shrink=0.8, extend="both")
    last = axes[-1]
    for name, (label, style) in _CAUSES.items():
        last.loglog(noises, np.max(np.abs(parts[name]), axis=1), style, label=label, ms=6, mfc="none")
    last.set_xlabel("noise, times that of usual instruments")
    last.set_ylabel("largest mean error of the six parameters, %")
    last.set_title("constant disturbances: error by cause", fontsize=10)
    last.set_ylim(bottom=0.1)
    last.grid(lw=0.3)
    last.legend(fontsize=8, frameon=False)
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)
