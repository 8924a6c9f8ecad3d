"""A prediction held against the vessel's own zigzags, brought to them and its parameters scattering where it misses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kempf.flows.jobs.as_sailed import AsSailed
from kempf.flows.jobs.compare_predicted import beside, figures_of, own_zigzags
from kempf.flows.jobs.predict_request import PredictRequest
from kempf.flows.jobs.predict_vessel import models_of_set, predict_with
from kempf.flows.jobs.predicted import Predicted, limits_of
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.conditioned import OwnZigzag, conditioned
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.own_zigzags import OwnZigzags, held_against, missed, scatter
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.warehouse.store import Warehouse

_FIRST_TWO = ("overshoots_deg.0", "overshoots_deg.1")


def predict_checked(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> Predicted:
    """Predict a manoeuvre, and the first two overshoots of every zigzag of the vessel to see what the errors miss.

    Parameters and errors are those of `kempf.flows.jobs.predict_vessel.predict_vessel`.
    """
    return CheckedPredictions(warehouse, vessel, request, progress).predict(request, progress, count)


class CheckedPredictions:
    """Predictions of several manoeuvres with one set at one speed, what they share made once.

    Parameters
    ----------
    warehouse, vessel, progress
        As `kempf.flows.jobs.predict_vessel.predict_vessel` takes them.
    request : PredictRequest
        Says which set and which speed.
    """

    def __init__(self, warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent) -> None:
        self._warehouse = warehouse
        self._hers = models_of_set(warehouse, vessel, request, progress)
        self._checks: dict[tuple[str, ...], _Check] = {}

    def predict(self, request: PredictRequest, progress: Progress = silent, count: int = DRAWS) -> Predicted:
        """Predict one, see `predict_checked`; set and speed are those of the first request."""
        made = predict_with(self._hers, request, progress, count)
        # a model whose ships do not sail the manoeuvre is left out, of the check too
        names = tuple(one.model.name for one in made.prediction.models)
        if names not in self._checks:
            self._checks[names] = _check(self._warehouse, made, progress)
        check = self._checks[names]
        if not check.models:
            return replace(made, own_zigzags=check.own)
        gear = made.prediction.models[0].model.rudder_rate
        models = [replace(model, rudder_rate=gear) for model in check.models]
        asked, length_m = made.prediction.manoeuvre, made.basis.profile.length_m
        prediction = predict(models, asked, made.basis.logs, length_m, count)
        prediction = replace(prediction, run_away=(*made.prediction.run_away, *prediction.run_away))
        limits = limits_of(prediction, made.parameter_set)
        return replace(made, prediction=prediction, limits=limits, own_zigzags=check.own)


@dataclass(frozen=True, eq=False)
class _Check:
    """What the own zigzags say of some models."""

    own: OwnZigzags
    #: Those that miss no more than chance; empty where the models as they are do not.
    models: tuple[Identified, ...] = ()


def _check(warehouse: Warehouse, made: Predicted, progress: Progress) -> _Check:
    zigzags = own_zigzags(warehouse, made, progress)
    own = _overshoots(made, zigzags)
    before = held_against(_rows(own), len(zigzags))
    if not missed(_rows(own)):
        return _Check(before)
    fitted = [one for one in zigzags if one.sample == "fitted"]
    nearer = _with_models(made, lambda model: _brought(model, made, fitted))
    own = _overshoots(nearer, zigzags)
    alone = _overshoots(_with_models(nearer, lambda model: model.scattered_alone()), zigzags)
    both = [name for name in own if name in alone]
    share = scatter(_rows({name: own[name] for name in both}), _rows({name: alone[name] for name in both}))
    models = tuple(one.model.scattered(share) for one in nearer.prediction.models)
    brought = any(one.model.conditioned for one in nearer.prediction.models)
    after = replace(held_against(_rows(own), len(zigzags)), scatter=share, before=before if brought else None)
    return _Check(after, models)


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
