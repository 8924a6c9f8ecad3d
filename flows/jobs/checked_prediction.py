"""A prediction held against the vessel's own zigzags, its parameters scattering by what the errors miss of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from kempf.flows.jobs.compare_predicted import MeasuredManoeuvre, own_zigzags_beside
from kempf.flows.jobs.predict_vessel import Predicted, PredictRequest, limits_of, predict_vessel
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.own_zigzags import missed, own_zigzags, scatter
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.warehouse.store import Warehouse


def predict_checked(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> Predicted:
    """Predict a manoeuvre, and the first two overshoots of every zigzag of the vessel to see what the errors miss.

    Parameters and errors are those of `kempf.flows.jobs.predict_vessel.predict_vessel`.
    """
    made = predict_vessel(warehouse, vessel, request, progress, count)
    zigzags = own_zigzags_beside(warehouse, made, progress)
    own = _columns(zigzags)
    overshoots = np.array(list(own.values()), dtype=np.float64).reshape(-1, 4)
    checked = own_zigzags(overshoots, len(zigzags))
    if not missed(overshoots):
        return replace(made, own_zigzags=checked)
    alone = _columns(own_zigzags_beside(warehouse, _with_models(made, lambda one: one.scattered_alone()), progress))
    both = [name for name in own if name in alone]
    share = scatter(*(np.array([columns[name] for name in both]).reshape(-1, 4) for columns in (own, alone)))
    models = [one.model.scattered(share) for one in made.prediction.models]
    asked, length_m = made.prediction.manoeuvre, made.basis.profile.length_m
    prediction = predict(models, asked, made.basis.logs, length_m, count)
    limits = limits_of(prediction, made.parameter_set)
    return replace(made, prediction=prediction, limits=limits, own_zigzags=replace(checked, scatter=share))


def _with_models(made: Predicted, changed: Callable[[Identified], Identified]) -> Predicted:
    models = tuple(replace(one, model=changed(one.model)) for one in made.prediction.models)
    return replace(made, prediction=replace(made.prediction, models=models))


def _columns(zigzags: tuple[MeasuredManoeuvre, ...]) -> dict[tuple[str, str], list[float]]:
    """Return measured, predicted and the ends of the interval, by zigzag and figure."""
    found: dict[tuple[str, str], list[float]] = {}
    for zigzag in zigzags:
        for figure in zigzag.figures:
            value, low, high = figure.predicted.value, figure.predicted.low, figure.predicted.high
            if value is not None and low is not None and high is not None:
                found[zigzag.segment_id, figure.name] = [figure.measured, value, low, high]
    return found
