"""Ranked effects: score, expected size over its standard error, and how much of each the model absorbs already."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.schemas.confidence import NORMAL_95
from kempf.workbench.effect_row import EffectRow
from kempf.workbench.figures.diagnosis_style import INK, SET_COLOURS, new_figure, style
from kempf.workbench.numbers import with_error

_SHOWN, _OTHER = 14, "#a5a6a8"
#: expected sizes further from 0 than this many standard errors are drawn at the edge
_WIDEST = 25.0


def draw_effects(ranked: Sequence[EffectRow]) -> Any:
    """Draw the effects with the highest scores, the highest on top."""
    from matplotlib.ticker import NullFormatter

    shown = [row for row in ranked if row.tested][:_SHOWN][::-1]
    with style():
        figure = new_figure(1.3 + 0.32 * len(shown))
        score, size, absorbed = figure.subplots(1, 3, sharey=True, width_ratios=(1.6, 2.9, 1.0))
        sets = [int(row.set_id[1:]) - 1 if row.set_id else None for row in shown]
        colours = [_OTHER if k is None else SET_COLOURS[k % len(SET_COLOURS)] for k in sets]
        at = np.arange(len(shown))
        score.barh(at, [max(row.score, 0.1) for row in shown], color=colours, height=0.65)
        score.set_xscale("log")
        score.xaxis.set_minor_formatter(NullFormatter())
        score.set_xlim(1.0, max([20.0, *(1.3 * row.score for row in shown)]))
        score.set_yticks(at, [f"{row.title}  [{row.set_id}]" if row.set_id else row.title for row in shown])
        score.set_xlabel("score (LM)")
        score.set_title("evidence")
        size.axvline(0.0, color=INK, lw=0.8)
        widest = 0.0
        for y, (row, colour) in enumerate(zip(shown, colours, strict=True)):
            # one row an effect: parameters beside each other a little apart
            changes = [change for change in row.changes if np.isfinite(change.std) and change.std > 0.0]
            for k, change in enumerate(changes):
                z = float(np.clip(change.value / change.std, -_WIDEST, _WIDEST))
                widest = max(widest, abs(z) + 2.5)
                shift = 0.0 if len(changes) == 1 else 0.22 - 0.44 * k
                bars = {"xerr": NORMAL_95, "fmt": "o", "ms": 4, "ecolor": INK, "elinewidth": 1, "capsize": 2}
                size.errorbar([z], [y + shift], color=colour, **bars)
                side = -1 if z > 0.0 else 1
                size.annotate(
                    f"{change.name} = {with_error(change.value, change.std, change.unit)}",
                    (0.0, y + shift),
                    (5 * side, 0),
                    textcoords="offset points",
                    fontsize=7,
                    va="center",
                    ha="right" if side < 0 else "left",
                )
        size.set_xlim(-max(widest, 12.0), max(widest, 12.0))
        size.set_xlabel("in standard errors; bars 95 %")
        size.set_title("expected size ± 1 s.e.")
        absorbed.barh(at, [100.0 * row.absorption for row in shown], color=_OTHER, height=0.45)
        absorbed.set_xlim(0.0, 100.0)
        absorbed.set_xlabel("absorption, %")
        absorbed.set_title("absorbed")
        for panel in (score, size, absorbed):
            panel.grid(visible=False, axis="y")
            panel.tick_params(axis="y", length=0)
        return figure


def describe_effects(ranked: Sequence[EffectRow], first: str) -> str:
    """Return the figure in words, for those who do not see it.

    Parameters
    ----------
    first : str
        What the model is called that they are tried beside.
    """
    highest = "; ".join(
        f"{row.title}: score {row.score:.3g}, expected "
        + ", ".join(f"{change.name} = {with_error(change.value, change.std, change.unit)}" for change in row.changes)
        for row in [row for row in ranked if row.tested][:3]
    )
    return f"Bars of the score of each effect beside the {first}, the highest three (± 1 s.e.) being {highest}."
