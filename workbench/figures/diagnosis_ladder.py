"""The ladder: free-run error, fitted and held out, and what the disturbances must explain, against effects added."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.workbench.figures.diagnosis_style import FULL, PLAIN, new_figure, style
from kempf.workbench.report.content import Rung

_MARKERS = (("o", "-"), ("s", "--"), ("^", ":"))
_SHADES = ("black", "#009E73", "#CC79A7")


def draw_ladder(ladder: Sequence[Rung]) -> Any:
    """Draw the ladder, one place a model.

    Parameters
    ----------
    ladder : sequence of Rung

    Returns
    -------
    matplotlib.figure.Figure
    """
    with style():
        figure = new_figure(3.4)
        error, drive = figure.subplots(1, 2)
        at = np.arange(len(ladder))
        for name, colour, marker, line, shift in (
            ("in_sample", PLAIN, "o", "--", -0.06),
            ("held_out", FULL, "s", "-", 0.06),
        ):
            runs = [_finite(100.0 * getattr(rung, name)) for rung in ladder]
            if not runs[0].size:
                continue
            for k, values in enumerate(runs):
                error.plot(
                    np.full(values.size, k + shift), values, marker, ms=3, color=colour, alpha=0.45, mec="none", ls=""
                )
            words = "fitted" if name == "in_sample" else "held out"
            label = f"{words} (mean of {runs[0].size})"
            mean = [float(np.mean(values)) for values in runs]
            error.plot(at + shift, mean, color=colour, ls=line, marker=marker, ms=6, label=label)
            for x, y, rung in zip(at + shift, mean, ladder, strict=True):
                if not np.isfinite(y):
                    continue
                above = y >= max(float(np.mean(one)) for one in (rung.in_sample, rung.held_out) if one.size)
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
        for k, name in enumerate(ladder[0].intensities):
            share = [100.0 * rung.intensities[name] / ladder[0].intensities[name] for rung in ladder]
            marker, line = _MARKERS[k % 3]
            drive.plot(at, share, color=_SHADES[k % 3], marker=marker, ls=line, ms=5, label=name.split(",")[0])
            ends.append(share[-1])
        _label_ends(drive, float(at[-1]), ends)
        drive.set_ylim(0.0, max(108.0, 1.08 * drive.get_ylim()[1]))
        drive.set_ylabel("intensity, % of the plain model's")
        drive.set_title("what disturbances must explain")
        for panel in (error, drive):
            panel.set_xticks(at, [_wrapped(k, rung.added) for k, rung in enumerate(ladder)])
            panel.set_xlim(-0.45, len(ladder) - 0.55)
            panel.grid(visible=False, axis="x")
            panel.legend(loc="best")
        return figure


def _finite(values: Float) -> Float:
    """Return values, NaN where a free run ran away."""
    result: Float = np.where(np.isfinite(values), values, np.nan)
    return result


def _label_ends(panel: Any, x: float, ends: Sequence[float]) -> None:
    """Write the last values beside their marks, those that lie close a little apart."""
    lowest = -np.inf
    for value in sorted(ends):
        place = max(value, lowest + 5.5)
        panel.annotate(f"{value:.0f}", (x, place), (7, 0), textcoords="offset points", fontsize=8, va="center")
        lowest = place


def _wrapped(number: int, text: str) -> str:
    from textwrap import fill

    return fill(text if number == 0 else f"+ {text}", 18)


def describe_ladder(ladder: Sequence[Rung]) -> str:
    """Return the figure in words.

    Parameters
    ----------
    ladder : sequence of Rung
    """
    parts = []
    for rung in ladder:
        held = f", held out {100 * np.mean(rung.held_out):.1f} %" if rung.held_out.size else ""
        parts.append(f"{rung.added}: fitted {100 * np.mean(rung.in_sample):.1f} %{held}")
    return f"Free-run error of the manoeuvres by model, in percent of the motion. {'; '.join(parts)}."
