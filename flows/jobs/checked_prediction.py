"""A prediction whose intervals are held against the vessel's own zigzags, and widened by what they miss."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.flows.jobs.compare_predicted import MeasuredManoeuvre, own_zigzags_beside
from kempf.flows.jobs.predict_vessel import Predicted, PredictRequest, predict_vessel
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.manoeuvre.draws import DRAWS
from kempf.pipeline.manoeuvre.own_zigzags import OwnZigzags, own_zigzags
from kempf.warehouse.store import Warehouse


def predict_checked(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> Predicted:
    """Predict a manoeuvre, and the first two overshoots of every zigzag of the vessel to see what the intervals miss.

    Parameters and errors are those of `kempf.flows.jobs.predict_vessel.predict_vessel`.
    """
    made = predict_vessel(warehouse, vessel, request, progress, count)
    checked = _checked(own_zigzags_beside(warehouse, made, progress))
    return replace(made, own_zigzags=checked, prediction=made.prediction.widened(checked.factor))


def _checked(zigzags: tuple[MeasuredManoeuvre, ...]) -> OwnZigzags:
    figures = [figure for zigzag in zigzags for figure in zigzag.figures if figure.predicted.value is not None]
    columns = np.array([[f.measured, f.predicted.value, f.predicted.low, f.predicted.high] for f in figures])
    return own_zigzags(columns.reshape(-1, 4).astype(np.float64), len(zigzags))
