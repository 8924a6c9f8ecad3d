"""Ranked effects: score, expected change over its standard error, and what the model swallows of each already."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.workbench.figures.diagnosis_style import OTHER, SET_COLOURS, new_figure, style
from kempf.workbench.report.content import RankedEffect
from kempf.workbench.report.numbers import with_interval

_SHOWN = 14
#: expected changes further from 0 than this many standard errors are drawn at the edge
_WIDEST = 25.0


def draw_effects(ranked: Sequence[RankedEffect]) -> Any:
    """Draw the effects with the highest scores, the highest on top.

    Parameters
    ----------
    ranked : sequence of RankedEffect

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.ticker import NullFormatter

    shown = [one for one in ranked if np.isfinite(one.score)][:_SHOWN][::-1]
    with style():
        figure = new_figure(1.3 + 0.32 * len(shown))
        score, size, swallowed = figure.subplots(1, 3, sharey=True, width_ratios=(1.6, 2.9, 1.0))
        colours = [_colour(one) for one in shown]
        at = np.arange(len(shown))
        score.barh(at, [max(one.score, 0.1) for one in shown], color=colours, height=0.65)
        score.set_xscale("log")
        score.xaxis.set_minor_formatter(NullFormatter())
        score.set_xlim(1.0, max([20.0, *(1.3 * one.score for one in shown)]))
        score.set_yticks(at, [_label(one) for one in shown])
        score.set_xlabel("score (LM)")
        score.set_title("evidence")
        size.axvline(0.0, color="black", lw=0.8)
        widest = 0.0
        for y, (one, colour) in enumerate(zip(shown, colours, strict=True)):
            # one row an effect: parameters beside each other a little apart
            for k, (name, change, std, unit) in enumerate(_made(one)):
                z = float(np.clip(change / std, -_WIDEST, _WIDEST))
                widest = max(widest, abs(z) + 2.5)
                shift = 0.0 if len(_made(one)) == 1 else 0.22 - 0.44 * k
                size.errorbar(
                    [z], [y + shift], xerr=1.96, fmt="o", ms=4, color=colour, ecolor="0.35", elinewidth=1, capsize=2
                )
                side = -1 if z > 0.0 else 1
                size.annotate(
                    f"{name} = {with_interval(change, std, unit)}",
                    (0.0, y + shift),
                    (5 * side, 0),
                    textcoords="offset points",
                    fontsize=7,
                    va="center",
                    ha="right" if side < 0 else "left",
                )
        size.set_xlim(-max(widest, 12.0), max(widest, 12.0))
        size.set_xlabel("in standard errors; bars 95 %")
        size.set_title("expected change, with 95 % interval")
        swallowed.barh(at, [100.0 * one.absorption for one in shown], color="0.6", height=0.45)
        swallowed.set_xlim(0.0, 100.0)
        swallowed.set_xlabel("absorption, %")
        swallowed.set_title("imitated")
        for panel in (score, size, swallowed):
            panel.grid(visible=False, axis="y")
            panel.tick_params(axis="y", length=0)
        return figure


def _made(one: RankedEffect) -> list[tuple[str, float, float, str]]:
    return [change for change in one.changes if np.isfinite(change[2]) and change[2] > 0.0]


def _colour(one: RankedEffect) -> str:
    return OTHER if one.set_id is None else SET_COLOURS[(int(one.set_id[1:]) - 1) % len(SET_COLOURS)]


def _label(one: RankedEffect) -> str:
    return f"{one.title}  [{one.set_id}]" if one.set_id else one.title


def describe_effects(ranked: Sequence[RankedEffect]) -> str:
    """Return the figure in words, for those who do not see it.

    Parameters
    ----------
    ranked : sequence of RankedEffect
    """
    shown = [one for one in ranked if np.isfinite(one.score)][:3]
    told = "; ".join(
        f"{one.title}: score {one.score:.3g}, expected change "
        + ", ".join(f"{name} = {with_interval(change, std, unit)}" for name, change, std, unit in _made(one))
        for one in shown
    )
    return f"Bars of the score of each effect beside the plain model, the highest three being {told}."
