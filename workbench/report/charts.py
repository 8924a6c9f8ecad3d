"""A manoeuvre as linked charts that can be zoomed in the report itself: measured, and predicted by both models."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.schemas.diagnosis_evidence import ManoeuvreEvidence
from kempf.schemas.instants import iso_utc
from kempf.schemas.units import SECOND_NS
from kempf.workbench.charts.bins import Shown
from kempf.workbench.charts.channels import LATERAL, derived, entry
from kempf.workbench.charts.frames import encoded
from kempf.workbench.report.content import ChartBlock, PictureBlock

_RUDDER = "rudder_angle"
#: columns of what a model predicts
_PREDICTED = (LATERAL, "yaw_rate", "heading")


def chart_of(shown: ManoeuvreEvidence, label: str, picture: PictureBlock) -> ChartBlock:
    """Return the charts of a manoeuvre; the heading is that from the first one.

    Parameters
    ----------
    label : str
        Of the manoeuvre.
    picture : PictureBlock
        What is seen where no script runs, and in print.
    """
    series = {_RUDDER: shown.rudder}
    models = (shown.before,) if shown.after is None else (shown.before, shown.after)
    for i, name in enumerate(_PREDICTED):
        measured = shown.measured[:, i]
        if not np.isfinite(measured).any():
            continue
        series[name] = measured
        for kind, model in zip(("predicted",) if len(models) == 1 else ("before", "predicted"), models, strict=True):
            series[f"{name}:{kind}"] = model.free_run[:, i]
    begin, end = shown.start_utc_ns, shown.start_utc_ns + round(float(shown.time_s[-1]) * SECOND_NS)
    frame = encoded(begin, end, {name: _whole(shown.time_s, values) for name, values in series.items()})
    logged = [name for name in (_RUDDER, "heading", "yaw_rate") if name in series]
    offered = [*(entry(name, "the log", shown=True) for name in logged), *([derived()] if LATERAL in series else [])]
    return ChartBlock(label, picture, frame, offered, (iso_utc(begin), iso_utc(end)))


def _whole(time_s: Float, values: Float) -> Shown:
    known = int(np.count_nonzero(np.isfinite(values)))
    return Shown(time_s, values, known, known)
