"""How the error fell from model to model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from markupsafe import Markup

from kempf.schemas.enumeration import as_words
from kempf.workbench.rungs import effect_names
from kempf.workbench.web.draw.scale import ticks
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _ROW, _LEFT, _RIGHT = 640.0, 46.0, 170.0, 24.0
#: error of which manoeuvres, in the order in which they are drawn
_SAMPLES = (
    ("fitted", "fitted", "circle"),
    ("left_out", "left out in turn", "square"),
    ("held_out", "held out", "diamond"),
)


def draw_ladder(rungs: Sequence[Mapping[str, Any]]) -> Markup | None:
    """Return the error one leg ahead of every rung, each manoeuvre a mark; None where no rung has it.

    Parameters
    ----------
    rungs : sequence of mapping
        JSON content of a ladder, the plain model's first.
    """
    ahead = [rung.get("one_leg_ahead") or {} for rung in rungs]
    errors = [
        {
            sample: [e for e in (figures.get(f"{sample}_percent") or {}).values() if e is not None and isfinite(e)]
            for sample, _, _ in _SAMPLES
        }
        for figures in ahead
    ]
    every = [e for by_sample in errors for group in by_sample.values() for e in group]
    if not every:
        return None
    most = 1.05 * max(every)
    height = _ROW * len(rungs) + 56.0
    parts: list[Markup] = []
    for tick in ticks(0.0, most, 6):
        x = _x(tick, most)
        parts.append(element("line", x1=x, x2=x, y1=24.0, y2=height - 30.0, class_="grid"))
        parts.append(element("text", f"{tick:g}", x=x, y=height - 16.0, text_anchor="middle", class_="label"))
    parts.append(element("text", "error one leg ahead, % of the motion", x=_LEFT, y=height - 3.0, class_="label"))
    for k, (rung, by_sample) in enumerate(zip(rungs, errors, strict=True)):
        y = 24.0 + _ROW * (k + 0.5)
        name = _first(rung) if rung["added"] is None else f"+ {as_words(rung['added'])}"
        parts.append(element("text", name, x=_LEFT - 10.0, y=y + 4.0, text_anchor="end", class_="label strong"))
        for place, (sample, words, form) in enumerate(_SAMPLES):
            for error in by_sample[sample]:
                parts.append(_mark(form, _x(error, most), y + 12.0 * (place - 1), f"{words}: {error:.3g} %"))
            if by_sample[sample]:
                mean = sum(by_sample[sample]) / len(by_sample[sample])
                x = _x(mean, most)
                parts.append(
                    element(
                        "line",
                        x1=x,
                        x2=x,
                        y1=y + 12.0 * (place - 1) - 6.0,
                        y2=y + 12.0 * (place - 1) + 6.0,
                        class_=f"mean {form}",
                    )
                )
    for place, (_, words, form) in enumerate(_SAMPLES):
        x = _LEFT + 130.0 * place
        parts += [_mark(form, x + 5.0, 11.0, words), element("text", words, x=x + 14.0, y=15.0, class_="label")]
    return drawing(
        _WIDTH, height, "Error one leg ahead, a row a model, a mark a manoeuvre, a stroke their mean", *parts
    )


def _first(rung: Mapping[str, Any]) -> str:
    """Return what the first model is called: a diagnosis may begin from one that has effects."""
    has = effect_names(rung)
    return f"model with {len(has)} effects" if len(has) > 1 else f"with {as_words(has[0])}" if has else "plain model"


def _x(error: float, most: float) -> float:
    return _LEFT + (_WIDTH - _LEFT - _RIGHT) * error / most


def _mark(form: str, x: float, y: float, words: str) -> Markup:
    title = element("title", words)
    if form == "circle":
        return element("circle", title, cx=x, cy=y, r=4, class_=f"mark {form}")
    if form == "square":
        return element("rect", title, x=x - 3.5, y=y - 3.5, width=7, height=7, class_=f"mark {form}")
    return element("path", title, d=f"M{x:.1f} {y - 5:.1f} l5 5 l-5 5 l-5 -5 z", class_=f"mark {form}")
