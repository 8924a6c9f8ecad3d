"""The job that predicts a standard manoeuvre from a parameter set, its rivals and the logs behind it.

Nothing is fitted but the speed's equation; what is stored are models that fit as well as that of the set.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from kempf.flows.jobs.diagnose.rival_models import rivals_of
from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.parameter_set_of import CHANNELS_OF
from kempf.flows.jobs.identify.ship_model import ship_of_set
from kempf.flows.jobs.predict.predict_request import PredictRequest, manoeuvre_of, required
from kempf.flows.jobs.predict.predicted import SetPrediction, assumed_by, limits_of
from kempf.flows.jobs.predict.prediction_basis import Basis, basis_of, identified
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet


@dataclass(frozen=True, eq=False)
class ModelsOfSet:
    """What all predictions with one set at one speed share."""

    vessel: str
    parameter_set: ParameterSet
    basis: Basis
    speed_m_s: float
    #: That of the set, then those that fit as well.
    models: tuple[Identified, ...]
    #: Of how the others were found, sentences.
    remarks: tuple[str, ...]
    #: What diagnoses and the channels of the logs say against the set, sentences.
    against: tuple[str, ...] = ()


def models_of_set(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent
) -> ModelsOfSet:
    """Return the models of the set that is asked for, at the speed that is asked for.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
        Whose models.
    request : PredictRequest
        Says which set and which speed; what it says of the manoeuvre is checked.
    progress : Progress, optional
        Told how far the search for rival models is.

    Raises
    ------
    NotFound
        ``no_parameter_set``, ``no_vessel``, ``no_runs``.
    UsageError
        ``speed_out_of_range``, ``rudder_rate_out_of_range``, ``rudder_out_of_range``, ``angles_out_of_range``,
        ``set_of_another_vessel``.
    DataRejected
        ``set_without_covariance``, ``predicts_no_ship``.
    """
    required(request)
    parameter_set, _ = chosen_set(warehouse, vessel, request.set_id)
    basis = basis_of(warehouse, parameter_set, progress)
    speed = request.speed_m_s or basis.approach_m_s
    rivals = rivals_of(warehouse, parameter_set, progress)
    models = tuple(identified(ship_of_set(warehouse, each, speed), basis) for each in (parameter_set, *rivals.sets))
    against = (*rivals.against, *(w for w in parameter_set.warnings if w.startswith(CHANNELS_OF)))
    return ModelsOfSet(vessel, parameter_set, basis, speed, models, rivals.remarks, against)


def predict_with(
    set_models: ModelsOfSet, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> SetPrediction:
    """Predict a standard manoeuvre in calm, deep water with models that are there.

    Parameters
    ----------
    set_models : ModelsOfSet
        Set and speed are theirs.
    request : PredictRequest
        Says which manoeuvre.
    progress : Progress, optional
    count : int, optional
        Ships drawn from every model, a power of two.

    Raises
    ------
    UsageError, DataRejected
        As `models_of_set`.
    """
    required(request)
    models, basis = list(set_models.models), set_models.basis
    if request.rudder_rate is not None:
        models = [replace(model, rudder_rate=request.rudder_rate) for model in models]
    progress(0, 1, f"sailing {len(models) * count} ships")
    prediction = predict(models, manoeuvre_of(request), basis.logs, basis.particulars, count)
    progress(1, 1, "sailed")
    assumed = (*assumed_by(request, basis, models, set_models.speed_m_s), *set_models.remarks)
    parameter_set = set_models.parameter_set
    return SetPrediction(
        set_models.vessel,
        parameter_set,
        basis,
        set_models.speed_m_s,
        prediction,
        assumed,
        limits_of(prediction, parameter_set),
        against=set_models.against,
    )
