"""The ladder: free-run error, fitted and held out, and disturbances that each model needs, against effects added."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.schemas.diagnosis_evidence import FittedModel
from kempf.schemas.enumeration import as_words
from kempf.workbench.figures.diagnosis_style import FULL, INK, LIMIT, PLAIN, new_figure, style

_MARKERS = (("o", "-"), ("s", "--"), ("^", ":"))
_SHADES = (INK, "#009e73", LIMIT)
#: of a name under the panels, all models together
_LETTERS = 56
#: beyond so many times the largest mean a free run is drawn at the edge
_EDGE = 3.0


def draw_ladder(ladder: Sequence[FittedModel], first: str) -> Any:
    """Draw the ladder, one place a model.

    Parameters
    ----------
    first : str
        What the first is called.
    """
    with style():
        figure = new_figure(3.4)
        error, drive = figure.subplots(1, 2)
        at = np.arange(len(ladder))
        middle = "median" if any(model.leg_parameters for model in ladder) else "mean"
        # a free run that runs off is drawn at the edge
        means = 100.0 * np.array([[model.fitted_error, model.held_out_error] for model in ladder], dtype=np.float64)
        edge = _EDGE * float(np.nanmax(means)) if np.isfinite(means).any() else np.inf
        for name, colour, marker, line, shift in (
            ("fitted", PLAIN, "o", "--", -0.06),
            ("held_out", FULL, "s", "-", 0.06),
        ):
            runs = [_finite(100.0 * getattr(model, f"{name}_errors")) for model in ladder]
            if not runs[0].size:
                continue
            for k, values in enumerate(runs):
                x, y = np.full(values.size, k + shift), np.minimum(values, edge)
                error.plot(x, y, marker, ms=3, color=colour, alpha=0.45, mec="none", ls="")
            label = f"{as_words(name)} ({middle} of {runs[0].size})"
            mean = [100.0 * getattr(model, f"{name}_error") for model in ladder]
            error.plot(at + shift, mean, color=colour, ls=line, marker=marker, ms=6, label=label)
            for x, y, model in zip(at + shift, mean, ladder, strict=True):
                if not np.isfinite(y):
                    continue
                above = y >= 100.0 * np.nanmax([model.fitted_error, model.held_out_error])
                error.annotate(
                    f"{y:.1f}",
                    (x, y),
                    (0, 9 if above else -9),
                    textcoords="offset points",
                    fontsize=8,
                    ha="center",
                    va="center",
                    color=colour,
                )
        error.set_ylim(0.0, 1.12 * error.get_ylim()[1])
        error.set_ylabel("free-run error, % of the motion")
        error.set_title("prediction of whole manoeuvres")
        ends: list[float] = []
        for k, disturbance in enumerate(ladder[0].disturbances):
            share = [100.0 * model.disturbances[k].share for model in ladder]
            marker, line = _MARKERS[k % 3]
            drive.plot(at, share, color=_SHADES[k % 3], marker=marker, ls=line, ms=5, label=disturbance.name)
            ends.append(share[-1])
        _label_ends(drive, float(at[-1]), ends)
        drive.set_ylim(0.0, max(108.0, 1.08 * drive.get_ylim()[1]))
        drive.set_ylabel(f"intensity, % of the {first}'s")
        drive.set_title("disturbances that the model needs")
        for panel in (error, drive):
            names = [f"+ {model.added}" if model.added else first for model in ladder]
            panel.set_xticks(at, [_wrapped(name, len(ladder)) for name in names])
            panel.set_xlim(-0.45, len(ladder) - 0.55)
            panel.grid(visible=False, axis="x")
            panel.legend(loc="best")
        return figure


def _finite(values: Float) -> Float:
    """Return values, NaN where a free run diverges."""
    result: Float = np.where(np.isfinite(values), values, np.nan)
    return result


def _label_ends(panel: Any, x: float, ends: Sequence[float]) -> None:
    """Write the last values beside their marks, those that lie close a little apart."""
    lowest = -np.inf
    for value in sorted(ends):
        place = max(value, lowest + 5.5)
        panel.annotate(f"{value:.0f}", (x, place), (7, 0), textcoords="offset points", fontsize=8, va="center")
        lowest = place


def _wrapped(text: str, many: int) -> str:
    """Return a name in lines that leave room for as many beside it."""
    from textwrap import fill

    return fill(text, max(8, _LETTERS // many))


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %" if np.isfinite(share) else "diverges"


def describe_ladder(ladder: Sequence[FittedModel], first: str) -> str:
    """Return the figure in words.

    Parameters
    ----------
    first : str
        What the first is called.
    """
    parts = []
    for model in ladder:
        held = f", held out {_percent(model.held_out_error)}" if model.held_out_errors.size else ""
        parts.append(f"{model.added or first}: fitted {_percent(model.fitted_error)}{held}")
    return f"Free-run error of the manoeuvres by model, in percent of the motion. {'; '.join(parts)}."
