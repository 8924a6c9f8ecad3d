"""A prediction held against the vessel's own zigzags, brought to them and its parameters scattering where it misses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from kempf.flows.jobs.as_sailed import AsSailed
from kempf.flows.jobs.compare_predicted import beside, figures_of, own_zigzags
from kempf.flows.jobs.predict_vessel import Predicted, PredictRequest, limits_of, predict_vessel
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.conditioned import OwnZigzag, conditioned
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.own_zigzags import held_against, missed, scatter
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.warehouse.store import Warehouse

_FIRST_TWO = ("overshoots_deg.0", "overshoots_deg.1")


def predict_checked(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> Predicted:
    """Predict a manoeuvre, and the first two overshoots of every zigzag of the vessel to see what the errors miss.

    Parameters and errors are those of `kempf.flows.jobs.predict_vessel.predict_vessel`.
    """
    made = predict_vessel(warehouse, vessel, request, progress, count)
    zigzags = own_zigzags(warehouse, made, progress)
    own = _overshoots(made, zigzags)
    before = held_against(_rows(own), len(zigzags))
    if not missed(_rows(own)):
        return replace(made, own_zigzags=before)
    fitted = [one for one in zigzags if one.sample == "fitted"]
    nearer = _with_models(made, lambda model: _brought(model, made, fitted))
    own = _overshoots(nearer, zigzags)
    alone = _overshoots(_with_models(nearer, lambda model: model.scattered_alone()), zigzags)
    both = [name for name in own if name in alone]
    share = scatter(_rows({name: own[name] for name in both}), _rows({name: alone[name] for name in both}))
    models = [one.model.scattered(share) for one in nearer.prediction.models]
    asked, length_m = made.prediction.manoeuvre, made.basis.profile.length_m
    prediction = predict(models, asked, made.basis.logs, length_m, count)
    prediction = replace(prediction, run_away=(*made.prediction.run_away, *prediction.run_away))
    brought = any(one.model.conditioned for one in nearer.prediction.models)
    after = replace(held_against(_rows(own), len(zigzags)), scatter=share, before=before if brought else None)
    limits = limits_of(prediction, made.parameter_set)
    return replace(made, prediction=prediction, limits=limits, own_zigzags=after)


def _brought(model: Identified, made: Predicted, zigzags: Sequence[AsSailed]) -> Identified:
    measured = []
    for one in zigzags:
        wanted = {name: value for name, value in figures_of(one.segment).items() if name in _FIRST_TWO}
        measured.append(OwnZigzag(one.on_the_day(model, made.basis), one.manoeuvre, wanted))
    return conditioned(model, measured)


def _with_models(made: Predicted, changed: Callable[[Identified], Identified]) -> Predicted:
    models = tuple(replace(one, model=changed(one.model)) for one in made.prediction.models)
    return replace(made, prediction=replace(made.prediction, models=models))


def _overshoots(made: Predicted, zigzags: Sequence[AsSailed]) -> dict[tuple[str, str], list[float]]:
    """Return measured, predicted and the ends of the interval, by zigzag and figure."""
    found: dict[tuple[str, str], list[float]] = {}
    for zigzag in (beside(made, one) for one in zigzags):
        for figure in zigzag.figures:
            value, low, high = figure.predicted.value, figure.predicted.low, figure.predicted.high
            if value is not None and low is not None and high is not None:
                found[zigzag.segment_id, figure.name] = [figure.measured, value, low, high]
    return found


def _rows(columns: dict[tuple[str, str], list[float]]) -> Float:
    return np.array(list(columns.values()), dtype=np.float64).reshape(-1, 4)
