"""Measured over predicted, one row a run: yaw rate, heading, lateral speed with fit %, badge and intervals."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kempf.pipeline.compare.comparison import ComparedRun
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.motion_channel import MOTION
from kempf.workbench.figures.drawn import save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: of Okabe & Ito (2008), which the colour-blind can distinguish: predicted, and badges of held-out and fitted runs
_PREDICTED, _HELD_OUT, _FITTED = "#0072B2", "#D55E00", "#555555"


def measured_over_predicted(runs: Sequence[ComparedRun], title: str) -> Figure:
    """Draw runs beside their predictions.

    Parameters
    ----------
    title : str
        Above the figure; names the horizon.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    there = [name for name in MOTION if any(name in run.predicted.count() for run in runs)]
    figure = Figure(figsize=(4.4 * len(there) + 0.4, 2.9 * len(runs) + 0.9), layout="constrained")
    FigureCanvasAgg(figure)
    heights = [3.0, 1.0] * len(runs)
    axes = figure.subplots(2 * len(runs), len(there), squeeze=False, height_ratios=heights)
    for k, run in enumerate(runs):
        row, strips = axes[2 * k], axes[2 * k + 1]
        for name, panel, strip in zip(there, row, strips, strict=True):
            _panel(panel, run, name)
            _strip(strip, run, name)
            strip.sharex(panel)
            panel.tick_params(labelbottom=False)
        badge, colour = ("held out", _HELD_OUT) if run.held_out else ("fitted", _FITTED)
        style = {"boxstyle": "round,pad=0.25", "facecolor": colour, "edgecolor": "none"}
        row[0].set_title(run.name, loc="left", fontsize=8)
        row[-1].annotate(
            *(badge, (1.0, 1.0), (0, 4), "axes fraction", "offset points"),
            **{"ha": "right", "va": "bottom", "fontsize": 8, "color": "white", "bbox": style},
        )
    for strip in axes[-1]:
        strip.set_xlabel("time, s", fontsize=8)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(title, fontsize=10)
    return figure


def _panel(panel: Any, run: ComparedRun, name: str) -> None:
    prediction, i = run.predicted, MEASUREMENTS.index(name)
    unit, factor = MOTION[name].shown
    measured = factor * run.residuals.filtered.run.measured[:, i]
    known = np.isfinite(measured)
    panel.plot(prediction.time_s[known], measured[known], color="0.55", lw=2.2, label="measured")
    predicted = factor * prediction.predicted[:, i]
    if np.isfinite(prediction.std[:, i]).any():
        width = factor * NORMAL_95 * prediction.std[:, i]
        style = {"color": _PREDICTED, "alpha": 0.25, "lw": 0, "label": "95 % interval of the prediction"}
        panel.fill_between(prediction.time_s, predicted - width, predicted + width, **style)
        # while the initial state is not known the prediction is no statement
        predicted = np.where(np.isfinite(prediction.error[:, i]), predicted, np.nan)
    panel.plot(prediction.time_s, predicted, color=_PREDICTED, lw=1.0, label="predicted")
    fit = prediction.fit_percent().get(name)
    if fit is not None:
        panel.set_title(f"fit {fit:.1f} %", fontsize=8)
    panel.set_ylabel(f"{MOTION[name].words}, {unit}", fontsize=8)
    panel.tick_params(labelsize=7)
    panel.grid(lw=0.3)


def _strip(strip: Any, run: ComparedRun, name: str) -> None:
    """Draw measured less predicted, with its interval where the model gives one."""
    prediction, i = run.predicted, MEASUREMENTS.index(name)
    error, width = (
        MOTION[name].shown[1] * column for column in (prediction.error[:, i], NORMAL_95 * prediction.std[:, i])
    )
    if np.isfinite(width).any():
        strip.fill_between(prediction.time_s, -width, width, color=_PREDICTED, alpha=0.25, lw=0)
    strip.plot(prediction.time_s, error, color="black", lw=0.7)
    known = error[np.isfinite(error)]
    if known.size:
        # one wild reading must not flatten the rest
        reach = 1.3 * max(float(np.percentile(np.abs(known), 99.0)), 1e-12)
        strip.set_ylim(-reach, reach)
    strip.set_ylabel("error", fontsize=8)
    strip.tick_params(labelsize=7)
    strip.grid(lw=0.3)


def as_png(figure: Figure) -> bytes:
    """Return a figure as the bytes of a PNG, the same every time."""
    data = BytesIO()
    figure.savefig(data, format="png", dpi=90, metadata={"Software": None})
    return data.getvalue()


def draw_measured_over_predicted(runs: Sequence[ComparedRun], path: Path, title: str) -> None:
    """Draw `measured_over_predicted` into a file.

    Parameters
    ----------
    path : Path
        Ending ``.png``, ``.svg`` or ``.pdf``.
    """
    save(measured_over_predicted(runs, title), path, 90)
