"""The paper's Fig. 2: the six parameters of eq. (17) against the iteration, the true values as straight lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kempf.pipeline.estimate.result import Value
from kempf.workbench.figures.drawn import pyplot, save


def draw_iterations(iterations: Sequence[dict[str, Any]], truth: Sequence[Value], path: Path, title: str) -> None:
    """Draw one panel a parameter.

    Parameters
    ----------
    iterations : sequence of dict
        With ``iteration``, ``A`` and ``B``, as `kempf.pipeline.estimate.paper.ship` records them.
    truth : sequence of Value
        A11, A12, A21, A22, B1, B2.
    path : Path
        Of a PNG.
    title : str
        Above the figure.
    """
    count = [entry["iteration"] for entry in iterations]
    estimates = [[*entry["A"][0], *entry["A"][1], *entry["B"]] for entry in iterations]
    figure, axes = pyplot().subplots(3, 2, figsize=(10, 8), sharex=True, layout="constrained")
    for k, (panel, true) in enumerate(zip(axes.flat, truth, strict=True)):
        panel.axhline(true.value, color="black", lw=1.2, label="true")
        panel.plot(count, [values[k] for values in estimates], "o-", ms=3, lw=1.0, color="tab:blue", label="estimated")
        panel.set_ylabel(f"{true.name}, {true.unit}")
        panel.grid(lw=0.3)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, frameon=False, title=title)
    figure.supxlabel("iteration (0: first approximation)")
    save(figure, path, 90)
