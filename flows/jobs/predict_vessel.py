"""The job that predicts a standard manoeuvre from a parameter set, its rivals and the logs behind it.

Nothing is fitted but the speed's equation; what is stored are models that fit as well as that of the set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import degrees, isfinite, radians
from typing import Any, Literal

import numpy as np

from kempf.flows.jobs.chosen_set import chosen_set
from kempf.flows.jobs.leg_fit import fitted_to_legs
from kempf.flows.jobs.log_channels import channels_of
from kempf.flows.jobs.rival_models import rivals_of
from kempf.flows.jobs.ship_model import ShipOfSet, ship_of_set
from kempf.flows.jobs.vessel_runs import LENGTH_M, VesselRuns, assemble
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.record.left_out import left_out
from kempf.pipeline.manoeuvre.covered import covered
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.own_zigzags import OwnZigzags
from kempf.pipeline.manoeuvre.prediction import Prediction, predict
from kempf.pipeline.manoeuvre.pull_out import PullOut
from kempf.pipeline.manoeuvre.rudder_rate import RudderRate, rudder_rate
from kempf.pipeline.manoeuvre.sailed import Manoeuvre, Reach
from kempf.pipeline.manoeuvre.ship import Waters
from kempf.pipeline.manoeuvre.spiral import Spiral
from kempf.pipeline.manoeuvre.surge.identify import surge_of
from kempf.pipeline.manoeuvre.surge.surge_fit import SurgeFit
from kempf.pipeline.manoeuvre.turning_circle import TurningCircle
from kempf.pipeline.manoeuvre.widening import widening
from kempf.pipeline.manoeuvre.zigzag import Zigzag
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.errors import DataRejected, NotFound, UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse import logs, vessels
from kempf.warehouse.parameter_set import Bounds, ParameterSet
from kempf.warehouse.store import Warehouse

Kind = Literal["turning-circle", "zigzag", "pull-out", "spiral"]
#: rudder of a manoeuvre where none is asked for, deg
USUAL_RUDDER_DEG: dict[Kind, float] = {"turning-circle": 35.0, "pull-out": 20.0, "spiral": 20.0}
#: what is taken of a channel that a manoeuvre in calm water has not
_TAKEN = {
    "wind_speed": "calm air",
    "wind_angle": "calm air",
    "water_depth": "deep water",
    "roll": "no heel",
    "shaft_speed": "the shaft turning as on the approach",
}
#: a widening from which it is said
_SAID = 1.05
_INSTRUMENTS = {"lateral_speed", "yaw_rate", "heading"}


@dataclass(frozen=True)
class PredictRequest:
    """What is asked for."""

    kind: Kind
    #: Parameter set by id or alias; None takes the vessel's current one.
    set_id: str | None = None
    #: Magnitude; None takes the usual one of the manoeuvre.
    rudder_deg: float | None = None
    #: Heading and rudder of a zigzag.
    angles_deg: tuple[float, float] = (20.0, 20.0)
    #: Of the turn, or of the first execute.
    side: Literal["starboard", "port"] = "starboard"
    #: Of the approach; None takes the mean of those that were sailed.
    speed_m_s: float | None = None
    #: Of another steering gear; None takes the rudder's rate that the logs show.
    rudder_rate_deg_s: float | None = None


@dataclass(frozen=True, eq=False)
class Basis:
    """What a set's own manoeuvres say beside the set."""

    profile: VesselProfile
    runs: VesselRuns
    surge: SurgeFit
    rudder_rate: RudderRate
    #: How far out the manoeuvres go.
    logs: Reach
    #: Length by which her time scale goes.
    scale_m: float

    @property
    def kept_m(self) -> float | None:
        """Way that a turn of the shaft keeps on a straight course, m, as models take it; None without a shaft speed."""
        logged = [run for run in self.runs.runs if "shaft_speed" in run.channels and run.approach_per_s > 0.0]
        return float(np.median([run.approach_m_s / run.approach_per_s for run in logged])) if logged else None

    @property
    def approach_m_s(self) -> float:
        """Mean speed of the approaches."""
        return float(np.mean([run.approach_m_s for run in self.runs.runs]))


@dataclass(frozen=True, eq=False)
class Predicted:
    """What the job did."""

    vessel: str
    parameter_set: ParameterSet
    basis: Basis
    speed_m_s: float
    prediction: Prediction
    #: What was taken for granted, and what limits the answer, sentences.
    assumed: tuple[str, ...]
    limits: tuple[str, ...]
    #: What the intervals were held against; None where that was not done.
    own_zigzags: OwnZigzags | None = None

    def show(self) -> dict[str, Any]:
        """Return the prediction as the command line's JSON object."""
        made, surge = self.prediction, self.basis.surge.at(self.speed_m_s)
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "manoeuvre": _manoeuvre_json(made.manoeuvre),
            "speed_m_s": self.speed_m_s,
            "figures": _grouped({name: vars(figure) for name, figure in made.figures.items()}),
            "models": [
                {
                    "parameter_set_id": one.model.name,
                    "effects": [effect.name for effect in one.model.waters.model.effects],
                    "figures": _grouped({name: vars(figure) for name, figure in one.figures.items()}),
                    "draws": len(one.drawn) + one.no_ships,
                    "no_ships": one.no_ships,
                    "errors_widened": one.model.widened,
                    "fitted_to_legs": one.model.fitted_to_legs,
                    "brought_to_own_zigzags": one.model.conditioned,
                }
                for one in made.models
            ],
            "extrapolated": [{**vars(one), "sentence": one.sentence} for one in made.extrapolated],
            "imo": [vars(one) for one in made.imo],
            "unstable_on_a_straight_course": made.share_unstable,
            "surge": {
                "time_constant_lengths": float(surge.best[0]),
                "loss_by_drift_and_turn": float(surge.best[1]),
                "loss_by_yaw_rate": float(surge.best[2]),
                "loss_by_rudder": float(surge.best[3]),
                "loss_by_wind": float(surge.best[4]),
                "std": [float(x) for x in surge.std],
            },
            "rudder_rate_deg_s": {
                "value": degrees(made.models[0].model.rudder_rate.rad_s),
                "std": degrees(made.models[0].model.rudder_rate.std_rad_s),
                "executes": made.models[0].model.rudder_rate.executes,
            },
            "own_zigzags": None if self.own_zigzags is None else asdict(self.own_zigzags),
            "assumed": list(self.assumed),
            "limits": list(self.limits),
        }


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


def predict_vessel(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> Predicted:
    """Predict a standard manoeuvre of a vessel in calm, deep water.

    Parameters
    ----------
    count : int, optional
        Ships drawn from every model, a power of two.

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
    return predict_with(models_of_set(warehouse, vessel, request, progress), request, progress, count)


def models_of_set(
    warehouse: Warehouse, vessel: str, request: PredictRequest, progress: Progress = silent
) -> ModelsOfSet:
    """Return the models of the set that is asked for, at the speed that is asked for; errors are `predict_vessel`'s."""
    _require(request)
    one, _ = chosen_set(warehouse, vessel, request.set_id)
    basis = basis_of(warehouse, one, progress)
    speed = request.speed_m_s or basis.approach_m_s
    rivals = rivals_of(warehouse, one, progress)
    models = tuple(identified(ship_of_set(warehouse, each, speed), basis) for each in (one, *rivals.sets))
    return ModelsOfSet(vessel, one, basis, speed, models, rivals.remarks)


def predict_with(
    hers: ModelsOfSet, request: PredictRequest, progress: Progress = silent, count: int = DRAWS
) -> Predicted:
    """Predict a manoeuvre with models that are there; set and speed are theirs, errors are `predict_vessel`'s."""
    _require(request)
    models, basis = list(hers.models), hers.basis
    if request.rudder_rate_deg_s is not None:
        gear = RudderRate(radians(request.rudder_rate_deg_s), 0.0, 0, "")
        models = [replace(model, rudder_rate=gear) for model in models]
    progress(0, 1, f"sailing {len(models) * count} ships")
    made = predict(models, manoeuvre_of(request), basis.logs, basis.profile.length_m, count)
    progress(1, 1, "sailed")
    assumed = (*_assumed(request, basis, models, hers.speed_m_s), *hers.remarks)
    one = hers.parameter_set
    return Predicted(hers.vessel, one, basis, hers.speed_m_s, made, assumed, limits_of(made, one))


def _require(request: PredictRequest) -> None:
    manoeuvre_of(request)
    if request.speed_m_s is not None and not (isfinite(request.speed_m_s) and request.speed_m_s > 0.0):
        raise UsageError(
            "speed_out_of_range",
            f"The approach speed is {request.speed_m_s:g} m/s, expected more than 0.",
            "Give the speed through the water in m/s with --speed, or leave it out.",
        )
    if request.rudder_rate_deg_s is not None and not 0.0 < request.rudder_rate_deg_s < float("inf"):
        raise UsageError(
            "rudder_rate_out_of_range",
            f"The rudder's rate is {request.rudder_rate_deg_s:g} deg/s, expected more than 0.",
            "Give the rate at which the gear puts the rudder over with --rudder-rate, or leave it out.",
        )


def manoeuvre_of(request: PredictRequest) -> Manoeuvre:
    """Return the manoeuvre that is asked for.

    Raises
    ------
    UsageError
        ``rudder_out_of_range``, ``angles_out_of_range``.
    """
    side = 1 if request.side == "starboard" else -1
    if request.kind == "zigzag":
        heading, rudder = request.angles_deg
        if not (0.0 < heading <= 90.0 and 0.0 < rudder <= 60.0):
            raise UsageError(
                "angles_out_of_range",
                f"The zigzag is {heading:g}/{rudder:g}, expected a heading above 0 up to 90 deg and a rudder up to 60.",
                "Give heading and rudder in degrees, such as --angles 10/10.",
            )
        return Zigzag(radians(heading), radians(rudder), side)
    angle = USUAL_RUDDER_DEG[request.kind] if request.rudder_deg is None else request.rudder_deg
    if not 0.0 < angle <= 60.0:
        raise UsageError(
            "rudder_out_of_range",
            f"The rudder is {angle:g} deg, expected more than 0 and up to 60.",
            "Give its magnitude in degrees with --rudder; --side says to which side.",
        )
    if request.kind == "turning-circle":
        return TurningCircle(radians(angle), side)
    return PullOut(radians(angle), side) if request.kind == "pull-out" else Spiral(radians(angle))


def basis_of(warehouse: Warehouse, one: ParameterSet, progress: Progress = silent) -> Basis:
    """Return what the manoeuvres of a set say beside it.

    Raises
    ------
    NotFound
        ``logs_of_set_gone``: none of its logs is there any more, ``no_runs``.
    """
    inputs: dict[str, Any] = dict(one.provenance.get("inputs") or {})
    rows = {row.log_id: row.ingest_id for row in logs.current(warehouse, one.vessel)}
    every = list(inputs.get("segments", ()))
    # a pooled set names its segments in the order of the bounds
    names = one.settings.get("segments") or [f"{b['log_id'][:8]}-{k}" for k, b in enumerate(every)]
    bounds = [
        (name, Bounds(b["log_id"], b["start_utc_ns"], b["end_utc_ns"]))
        for name, b in zip(names, every, strict=True)
        if b["log_id"] in rows
    ]
    if not bounds:
        raise NotFound(
            "logs_of_set_gone",
            f"None of the logs that {one.parameter_set_id} was identified from is in the warehouse.",
            "Ingest them again: the speed in turns and the rudder's rate are read from them.",
        )
    wanted = list(dict.fromkeys(each.log_id for _, each in bounds))
    instruments = {}
    for done, log_id in enumerate(wanted):
        progress(done, len(wanted), "reading the logs of the set")
        instruments[log_id] = channels_of(warehouse, rows[log_id])
    profile = vessels.get(warehouse, str(inputs["profile_sha256"]))
    runs = assemble(instruments, profile, bounds, ModelSpec.model_validate(dict(one.model_spec)))
    scale = profile.length_m or _scale_m(one)
    surge = surge_of(runs.runs, scale, runs.spec.rudder_speed_exponent)
    return Basis(profile, runs, surge, rudder_rate(runs.records), covered(runs.runs, scale), scale)


def identified(ship: ShipOfSet, basis: Basis) -> Identified:
    """Return a stored model as manoeuvres take it.

    Raises
    ------
    DataRejected
        ``set_without_covariance``.
    """
    one, effects = ship.parameter_set, ship.effects
    if not np.all(np.isfinite(ship.covariance)):
        raise DataRejected(
            "set_without_covariance",
            f"{one.parameter_set_id} ({one.estimator}) has no covariance of all its parameters: there is no interval.",
            "Predict with a set of `kempf identify`, which has one; `kempf params list` names them.",
        )
    waters = Waters(
        model=effects.model if effects is not None else EffectModel(),
        length_m=basis.profile.length_m or LENGTH_M,
        draught_m=basis.profile.draught_m or 1.0,
        approach_m_s=ship.speed_m_s,
        scale_m=basis.scale_m,
        rudder_speed_exponent=ship.spec.rudder_speed_exponent,
        day=effects.day if effects is not None else 0.0,
        shaft_share=1.0 / basis.surge.settled[0] if basis.kept_m is not None else 1.0,
    )
    values = effects.values if effects is not None else np.zeros(0)
    hull, covariance, factor = ship.hull.array(), ship.covariance, 1.0
    legs = fitted_to_legs(one)
    if legs is None:
        factor = _widened(one, waters.model, basis, hull, values, covariance)
    else:
        hull, values, covariance, factor = legs
    return Identified(
        name=one.parameter_set_id,
        waters=waters,
        hull=hull,
        effects=values,
        covariance=factor**2 * covariance,
        surge=basis.surge,
        rudder_rate=basis.rudder_rate,
        widened=factor,
        fitted_to_legs=legs is not None,
    )


def _widened(
    one: ParameterSet, model: EffectModel, basis: Basis, hull: Float, values: Float, covariance: Float
) -> float:
    """Return how much wider than its covariance the errors of a pooled set are; 1 for a set of one manoeuvre."""
    levels: dict[str, Any] = dict(one.convergence.get("levels") or {})
    gross: dict[str, Any] = dict(one.convergence.get("gross_error_instants_s") or {})
    fitted = [run for run in basis.runs.runs if run.name in levels]
    filters = [RunFilter(left_out(run, gross.get(run.name, {})), model, basis.runs.spec) for run in fitted]
    own = [np.exp(np.array(levels[run.name], dtype=np.float64)) for run in fitted]
    # a covariance that is wider already by what the runs disagree about is counted twice in it
    already = float(one.convergence.get("widened", 1.0))
    return max(widening(filters, own, hull, values, covariance) / already**2, 1.0) if filters else 1.0


def _scale_m(one: ParameterSet) -> float:
    """Return the length of a ship who answers as she does: of usual hulls a22 is about -2.5 / L."""
    damping = next((abs(p.value) for p in one.parameters if p.name == "a22"), 0.0)
    return float(min(max(2.5 / damping if damping > 0.0 else LENGTH_M, 0.3), 500.0))


def _assumed(request: PredictRequest, basis: Basis, models: Sequence[Identified], speed: float) -> tuple[str, ...]:
    said = ["calm, deep water without wind, waves or current; the engine left as on the approach"]
    if request.speed_m_s is None:
        said.append(f"approach at {speed:.3g} m/s, the mean of the {len(basis.runs.runs)} manoeuvres of the set")
    rate = basis.rudder_rate
    if request.rudder_rate_deg_s is not None:
        rate = RudderRate(radians(request.rudder_rate_deg_s), 0.0, 0, "")
        said.append(f"the rudder goes over at {request.rudder_rate_deg_s:.3g} deg/s, as asked for")
    if rate.executes:
        said.append(f"the rudder goes over at {degrees(rate.rad_s):.3g} deg/s, as in {rate.executes} executes")
    said += [word for word in (rate.remark, *basis.surge.remarks) if word]
    if not all("speed_through_water" in run.channels for run in basis.runs.runs):
        said.append("the speed in turns is the one over ground along the bow where no log shows that through the water")
    if not all("shaft_speed" in run.channels for run in basis.runs.runs):
        said.append("no shaft speed in the logs: taken as constant in them")
    for model in models:
        if model.fitted_to_legs:
            said.append(
                f"parameters of {model.name} are those fitted to predict legs: the likelihood's, one step ahead, "
                "predict them worse"
            )
        if model.widened > _SAID and model.fitted_to_legs:
            said.append(
                f"errors of {model.name} widened {model.widened:.1f} times: so much worse it predicts a manoeuvre that "
                "is left out"
            )
        elif model.widened > _SAID:
            said.append(
                f"errors of {model.name} widened {model.widened:.1f} times: over a leg its prediction errors remember, "
                "as those of a model that lacks something do"
            )
    for effect in {e.name: e for model in models for e in model.waters.model.effects}.values():
        taken = dict.fromkeys(_TAKEN[c] for c in effect.needs if c in _TAKEN)
        if taken:
            said.append(f"{effect.name}: {', '.join(taken)}")
        elif effect.terms and set(effect.terms) <= _INSTRUMENTS:
            said.append(f"{effect.name} is in the instruments and does not move the ship")
    return tuple(said)


def limits_of(made: Prediction, one: ParameterSet) -> tuple[str, ...]:
    """Return what limits a prediction, sentences."""
    said = []
    if made.no_ships:
        count = made.no_ships + len(made.drawn)
        said.append(f"{made.no_ships} of {count} ships that the errors allow do not sail it and are in no interval")
    for model in made.run_away:
        said.append(f"{model.title} fits the logs as well, but its ships run away here: that model is in no interval")
    if made.share_unstable >= 0.05:
        said.append(f"unstable on a straight course with a probability of {100.0 * made.share_unstable:.0f} %")
    if not one.convergence.get("converged"):
        said.append(f"the set did not converge: {one.convergence.get('reason')}")
    return tuple(said)


def _manoeuvre_json(manoeuvre: Manoeuvre) -> dict[str, Any]:
    found: dict[str, Any] = {"kind": manoeuvre.name}
    if isinstance(manoeuvre, Zigzag):
        found["heading_deg"] = round(degrees(manoeuvre.heading_rad), 9)
    found["rudder_deg"] = round(degrees(manoeuvre.rudder_rad), 9)  # type: ignore[attr-defined]
    side = getattr(manoeuvre, "side", None)
    if side is not None:
        found["side"] = "starboard" if side > 0 else "port"
    if isinstance(manoeuvre, Spiral):
        found["orders_deg"] = [round(degrees(angle), 9) for angle in manoeuvre.orders_rad]
    return found


def _grouped(figures: dict[str, Any]) -> dict[str, Any]:
    """Return figures by name, those with a number behind it as a list."""
    found: dict[str, Any] = {}
    for name, figure in figures.items():
        base, dot, _ = name.partition(".")
        if dot:
            found.setdefault(base, []).append(figure)
        else:
            found[base] = figure
    return found
