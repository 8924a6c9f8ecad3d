"""Draws the estimator's time over samples and over segments. Measures nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

STYLES = (("tab:blue", "o"), ("tab:orange", "s"))
#: what is counted, seconds by name of the line over it, and its name
Panel = tuple[Sequence[int], Mapping[str, Sequence[float]], str]


def draw(left: Panel, right: Panel, path: Path) -> None:
    """Draw two panels, every line with a dotted one in proportion through its last point.

    Parameters
    ----------
    left, right : Panel
        Seconds may be NaN where not measured.
    """
    figure, panels = plt.subplots(1, 2, figsize=(11.0, 4.4), layout="constrained")
    for panel, (counts, lines, name) in zip(panels, (left, right), strict=True):
        for (label, values), (colour, mark) in zip(lines.items(), STYLES, strict=True):
            panel.loglog(counts, [1e3 * v for v in values], mark + "-", color=colour, label=label)
            straight = [1e3 * values[-1] * n / counts[-1] for n in counts]
            panel.loglog(counts, straight, ":", color=colour, zorder=0)
        panel.set_xticks(counts, [f"{n}" for n in counts])
        panel.minorticks_off()
        panel.set_xlabel(name)
        panel.set_ylabel("time of the processor, ms")
        panel.grid(visible=True, lw=0.4, color="0.85")
        panel.legend(title="dotted: in proportion")
    figure.savefig(path, dpi=110)
    plt.close(figure)
