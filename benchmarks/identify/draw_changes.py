"""Draws the false alarms and the power of the change detector. Measures nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt

from kempf.pipeline.history.settings import ChangeSettings


class Counted(Protocol):
    """A share in percent with its interval."""

    @property
    def percent(self) -> float: ...

    @property
    def interval(self) -> tuple[float, float]: ...


def draw_changes(
    alarms: Mapping[str, Mapping[int, Counted]],
    rival: Mapping[str, tuple[Counted, Counted]],
    curves: Mapping[tuple[str, int], Sequence[Counted]],
    sizes: Sequence[float],
    settings: ChangeSettings,
    path: Path,
) -> None:
    """Draw false alarms by world on the left, power against size on the right."""
    figure = plt.figure(figsize=(14, 6.5), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=(1.15, 1.0))
    panel = left.subplots()
    worlds = list(alarms)
    lengths = list(next(iter(alarms.values())))
    for i, n in enumerate(lengths):
        y = [k + 0.11 * (i - len(lengths) / 2) for k in range(len(worlds))]
        x = [alarms[w][n].percent for w in worlds]
        spans = [alarms[w][n].interval for w in worlds]
        error = [[a - s[0] for a, s in zip(x, spans, strict=True)], [s[1] - a for a, s in zip(x, spans, strict=True)]]
        panel.errorbar(x, y, xerr=error, fmt="o", ms=4, lw=1, color=plt.cm.viridis(i / len(lengths)), label=f"{n} sets")
    for which, mark, name in ((0, "x", "six-vector, covariances as stated"), (1, "+", "six-vector, one scale factor")):
        x = [max(rival[w][which].percent, 0.5) for w in worlds]
        panel.plot(x, range(len(worlds)), mark, color="tab:red", ms=8, mew=1.5, label=f"rival: {name}, 20 sets")
    panel.axvline(100 * settings.level, color="0.3", lw=1, ls="--")
    panel.set_xscale("log")
    panel.set_xlim(0.4, 110)
    panel.set_xticks([0.5, 1, 2, 5, 10, 20, 50, 100], ["0.5", "1", "2", "5", "10", "20", "50", "100"])
    panel.set_yticks(range(len(worlds)), [_folded(w) for w in worlds], fontsize=8)
    panel.invert_yaxis()
    panel.set_xlabel("reported though nothing changed, %; dashed: the level promised")
    panel.grid(axis="x", lw=0.3)
    left.legend(fontsize=7, loc="outside upper center", ncols=4, frameon=False)
    panels = right.subplots(2, 2, sharex=True, sharey=True)
    names = list(dict.fromkeys(name for name, _ in curves))
    for one, name in zip(panels.flat, names, strict=True):
        for k, n in enumerate(sorted({n for _, n in curves})):
            shares = curves[name, n]
            x = [100 * s for s in sizes]
            colour = f"C{k}"
            one.fill_between(
                x, [s.interval[0] for s in shares], [s.interval[1] for s in shares], color=colour, alpha=0.2, lw=0
            )
            one.plot(x, [s.percent for s in shares], "o-", ms=3, color=colour, label=f"{n} sets")
        one.axhline(90, color="0.3", lw=0.8, ls=":")
        one.set_title(name, fontsize=9)
        one.grid(lw=0.3)
        one.set_ylim(0, 102)
    panels[0, 0].legend(fontsize=8, loc="lower right")
    right.supxlabel("size of the change, % of the parameter", fontsize=9)
    right.supylabel("reported, %; dotted: 90 %", fontsize=9)
    figure.savefig(path, dpi=90, metadata={"Software": None})
    plt.close(figure)


def _folded(text: str, width: int = 30) -> str:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
