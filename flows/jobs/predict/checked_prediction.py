"""A prediction held against the vessel's own zigzags, brought to them and its parameters scattering where it misses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kempf.flows.jobs.predict.as_sailed import AsSailed
from kempf.flows.jobs.predict.compare_predicted import beside, figures_of, own_zigzags
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.flows.jobs.predict.predict_vessel import models_of_set, predict_with
from kempf.flows.jobs.predict.predicted import SetPrediction, limits_of
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.conditioned import OwnZigzag, conditioned
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.own_zigzags import OwnZigzags, held_against, missed, scatter
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.warehouse.storage.store import Warehouse

_FIRST_TWO = ("overshoots_deg.0", "overshoots_deg.1")


def predict_checked(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent
) -> SetPrediction:
    """Predict a manoeuvre, and the first two overshoots of every zigzag of the vessel to see what the errors miss.

    Parameters and errors are those of `kempf.flows.jobs.predict.predict_vessel.models_of_set`.
    """
    return CheckedPredictions(warehouse, vessel, request, progress).predict(request, progress)


class CheckedPredictions:
    """Predictions of several manoeuvres with one set at one speed, what they share made once.

    Parameters
    ----------
    warehouse, vessel, progress
        As `kempf.flows.jobs.predict.predict_vessel.models_of_set` takes them.
    request : PredictRequest
        Says which set and which speed.
    """

    def __init__(self, warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent) -> None:
        self._warehouse = warehouse
        self._set_models = models_of_set(warehouse, vessel, request, progress)
        self._checks: dict[tuple[str, ...], _Check] = {}

    def predict(self, request: PredictRequest, progress: Progress = silent, count: int = DRAWS) -> SetPrediction:
        """Predict one, see `predict_checked`; set and speed are those of the first request."""
        predicted = predict_with(self._set_models, request, progress, count)
        # a model whose ships do not sail the manoeuvre is left out, of the check too
        names = tuple(member.model.name for member in predicted.prediction.models)
        if names not in self._checks:
            self._checks[names] = _check(self._warehouse, predicted, progress)
        check = self._checks[names]
        if not check.models:
            return replace(predicted, own_zigzags=check.own)
        gear = predicted.prediction.models[0].model.rudder_rate
        models = [replace(model, rudder_rate=gear) for model in check.models]
        basis = predicted.basis
        prediction = predict(models, predicted.prediction.manoeuvre, basis.logs, basis.particulars, count)
        prediction = replace(prediction, run_away=(*predicted.prediction.run_away, *prediction.run_away))
        limits = limits_of(prediction, predicted.parameter_set)
        return replace(predicted, prediction=prediction, limits=limits, own_zigzags=check.own)


@dataclass(frozen=True, eq=False)
class _Check:
    """What the own zigzags say of some models."""

    own: OwnZigzags
    #: Those that miss no more than chance; empty where the models as they are do not.
    models: tuple[Identified, ...] = ()


def _check(warehouse: Warehouse, predicted: SetPrediction, progress: Progress) -> _Check:
    zigzags = own_zigzags(warehouse, predicted, progress)
    own = _overshoots(predicted, zigzags)
    before = held_against(_rows(own), len(zigzags))
    if not missed(_rows(own)):
        return _Check(before)
    fitted = [zigzag for zigzag in zigzags if zigzag.sample == "fitted"]
    nearer = _with_models(predicted, lambda model: _brought(model, predicted, fitted))
    own = _overshoots(nearer, zigzags)
    alone = _overshoots(_with_models(nearer, lambda model: model.scattered_alone()), zigzags)
    both = [name for name in own if name in alone]
    share = scatter(_rows({name: own[name] for name in both}), _rows({name: alone[name] for name in both}))
    models = tuple(member.model.scattered(share) for member in nearer.prediction.models)
    brought = any(member.model.conditioned for member in nearer.prediction.models)
    after = replace(held_against(_rows(own), len(zigzags)), scatter=share, before=before if brought else None)
    return _Check(after, models)


def _brought(model: Identified, predicted: SetPrediction, zigzags: Sequence[AsSailed]) -> Identified:
    measured = []
    for zigzag in zigzags:
        figures = {name: value for name, value in figures_of(zigzag.segment).items() if name in _FIRST_TWO}
        measured.append(OwnZigzag(zigzag.on_the_day(model, predicted.basis), zigzag.manoeuvre, figures))
    return conditioned(model, measured)


def _with_models(predicted: SetPrediction, changed: Callable[[Identified], Identified]) -> SetPrediction:
    models = tuple(replace(member, model=changed(member.model)) for member in predicted.prediction.models)
    return replace(predicted, prediction=replace(predicted.prediction, models=models))


def _overshoots(predicted: SetPrediction, zigzags: Sequence[AsSailed]) -> dict[tuple[str, str], list[float]]:
    """Return measured, predicted and the ends of the interval, by zigzag and figure."""
    overshoots: dict[tuple[str, str], list[float]] = {}
    for manoeuvre in (beside(predicted, zigzag) for zigzag in zigzags):
        for figure in manoeuvre.figures:
            value, low, high = figure.predicted.value, figure.predicted.low, figure.predicted.high
            if value is not None and low is not None and high is not None:
                overshoots[manoeuvre.segment_id, figure.name] = [figure.measured, value, low, high]
    return overshoots


def _rows(columns: dict[tuple[str, str], list[float]]) -> Float:
    return np.array(list(columns.values()), dtype=np.float64).reshape(-1, 4)
