"""The confusion map of the hidden cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

from benchmarks.diagnose.hidden_effects.tally import Judged

mpl.use("Agg")
import matplotlib.pyplot as plt

_VERDICTS = ("adequate", "unexplained", "insufficient_data")


def draw_confusion(cases: Sequence[Judged], path: Path) -> None:
    """Draw how often each true effect was answered with each first name; a ring where the set held the truth."""
    kinds = {"catalogue": 0, "outsider": 1, "none": 2}
    rows = sorted({(kinds[c.truth["kind"]], c.truth["effect"]) for c in cases})
    names = [name for _, name in rows]
    said = {c.named for c in cases}
    columns = [n for n in names if n in said] + sorted(said - set(names) - set(_VERDICTS))
    columns += [v for v in _VERDICTS if v in said]
    counts = np.zeros((len(names), len(columns)))
    held = np.zeros_like(counts)
    for case in cases:
        place = names.index(case.truth["effect"]), columns.index(case.named)
        counts[place] += 1
        held[place] += case.in_set
    figure, axes = plt.subplots(figsize=(2.5 + 0.28 * len(columns), 2.5 + 0.24 * len(names)), layout="constrained")
    share = counts / counts.sum(axis=1, keepdims=True)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in np.argwhere(counts > 0):
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=7, color=_ink(share[i, j]))
        if held[i, j] > 0:
            axes.plot(j, i, "o", mfc="none", mec="tab:orange", ms=11)
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(names)), names, fontsize=7)
    axes.set_xlabel("first name given, or verdict\n(ring: the named set held the true effect)", fontsize=8)
    axes.set_ylabel("true effect", fontsize=8)
    figure.savefig(path, dpi=130, metadata={"Software": None})
    plt.close(figure)


def _ink(share: float) -> str:
    return "white" if share > 0.6 else "black"
