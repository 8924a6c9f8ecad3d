"""A predicted manoeuvre: its figures, what was taken for granted, what limits it; and as JSON content."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from math import degrees
from typing import Any

from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.flows.jobs.predict.prediction_basis import Basis
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.own_zigzags import OwnZigzags
from kempf.pipeline.manoeuvre.prediction import Prediction
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.spiral import PredictedSpiral
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.warehouse.tables.parameter_set import ParameterSet

#: what is taken of a channel that a manoeuvre in calm water has not
_TAKEN = {
    "wind_speed": "calm air",
    "wind_angle": "calm air",
    "water_depth": "deep water",
    "roll": "no heel",
    "shaft_speed": "the shaft turning as on the approach",
}
#: a widening from which it is said; largest approach over smallest from which they are unlike
_SAID, _UNLIKE = 1.05, 1.1
_INSTRUMENTS = {"lateral_speed", "yaw_rate", "heading"}


@dataclass(frozen=True, eq=False)
class SetPrediction:
    """A manoeuvre predicted from a parameter set, and what the prediction rests on."""

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
    #: What diagnoses and the channels of the logs say against the set, sentences.
    against: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the prediction as the command line's JSON object."""
        prediction, surge = self.prediction, self.basis.surge.at(self.speed_m_s)
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "manoeuvre": _manoeuvre_json(prediction.manoeuvre),
            "speed_m_s": self.speed_m_s,
            "figures": _grouped({name: vars(figure) for name, figure in prediction.figures.items()}),
            "models": [
                {
                    "parameter_set_id": member.model.name,
                    "effects": [effect.name for effect in member.model.waters.model.effects],
                    "figures": _grouped({name: vars(figure) for name, figure in member.figures.items()}),
                    "draws": len(member.drawn) + member.no_ships,
                    "no_ships": member.no_ships,
                    "errors_widened": member.model.widened,
                    "fitted_to_legs": member.model.fitted_to_legs,
                    "brought_to_own_zigzags": member.model.conditioned,
                }
                for member in prediction.models
            ],
            "extrapolated": [{**vars(quantity), "sentence": quantity.sentence} for quantity in prediction.extrapolated],
            "imo": [vars(criterion) for criterion in prediction.imo],
            "unstable_on_a_straight_course": prediction.share_unstable,
            "surge": {
                "time_constant_lengths": float(surge.best[0]),
                "loss_by_drift_and_turn": float(surge.best[1]),
                "loss_by_yaw_rate": float(surge.best[2]),
                "loss_by_rudder": float(surge.best[3]),
                "loss_by_wind": float(surge.best[4]),
                "std": [float(x) for x in surge.std],
            },
            "rudder_rate_deg_s": {
                "value": degrees(prediction.models[0].model.rudder_rate.rad_s),
                "std": degrees(prediction.models[0].model.rudder_rate.std_rad_s),
                "executes": prediction.models[0].model.rudder_rate.executes,
            },
            "own_zigzags": None if self.own_zigzags is None else asdict(self.own_zigzags),
            "assumed": list(self.assumed),
            "limits": [*self.against, *self.limits],
        }


def assumed_by(request: PredictRequest, basis: Basis, models: Sequence[Identified], speed: float) -> tuple[str, ...]:
    """Return what a prediction takes for granted, sentences."""
    sentences = ["calm, deep water without wind, waves or current; the engine left as on the approach"]
    if request.speed_m_s is None:
        approaches = [run.approach_m_s for run in basis.runs.runs]
        count = len(approaches)
        of = f"the mean of the {count} manoeuvres that were sailed" if count > 1 else "as in the one manoeuvre sailed"
        mean = f"approach at {speed:.3g} m/s, {of}"
        if max(approaches) > _UNLIKE * min(approaches):
            mean += f", from {min(approaches):.3g} to {max(approaches):.3g} m/s; another speed can be asked for"
        sentences.append(mean)
    if basis.particulars.model_scale is not None:
        sentences.append(
            f"full scale by Froude's law, 1:{basis.particulars.model_scale:g}: what the lower Reynolds number does to "
            "the model's hull, propeller and rudder is in no interval"
        )
    rate = request.rudder_rate or basis.rudder_rate
    if request.rudder_rate is not None:
        sentences.append(f"the rudder goes over at {request.rudder_rate_deg_s:.3g} deg/s, as asked for")
    if rate.executes:
        sentences.append(f"the rudder goes over at {degrees(rate.rad_s):.3g} deg/s, as in {rate.executes} executes")
    sentences += [word for word in (rate.remark, *basis.surge.remarks) if word]
    if not all("speed_through_water" in run.channels for run in basis.runs.runs):
        sentences.append(
            "the speed in turns is the one over ground along the bow where no log shows that through the water"
        )
    if not all("shaft_speed" in run.channels for run in basis.runs.runs):
        sentences.append("no shaft speed in the logs: taken as constant in them")
    sentences += [sentence for model in models for sentence in _of_fit(model)]
    for effect in {e.name: e for model in models for e in model.waters.model.effects}.values():
        words = dict.fromkeys(_TAKEN[c] for c in effect.needs if c in _TAKEN)
        if words:
            sentences.append(f"{effect.name}: {', '.join(words)}")
        elif effect.terms and set(effect.terms) <= _INSTRUMENTS:
            sentences.append(f"{effect.name} is in the instruments and does not move the ship")
    return tuple(sentences)


def _of_fit(model: Identified) -> Iterator[str]:
    """Say which parameters a model has, and what its errors were widened by."""
    if model.fitted_to_legs:
        yield (
            f"parameters of {model.name} are those fitted to predict legs: the likelihood's, one step ahead, predict "
            "them worse"
        )
    if model.widened > _SAID:
        why = (
            "so much worse it predicts a manoeuvre that is left out"
            if model.fitted_to_legs
            else "over a leg its prediction errors remember, as those of a model that lacks something do"
        )
        yield f"errors of {model.name} widened {model.widened:.1f} times: {why}"


def limits_of(prediction: Prediction, parameter_set: ParameterSet) -> tuple[str, ...]:
    """Return what limits a prediction, sentences."""
    sentences = []
    if prediction.no_ships:
        count = prediction.no_ships + len(prediction.drawn)
        sentences.append(
            f"{prediction.no_ships} of {count} ships that the errors allow do not sail it: they are in no interval"
            f"{' and fulfil no criterion' if prediction.imo else ''}"
        )
    for model in prediction.run_away:
        sentences.append(
            f"{model.title} fits the logs as well, but its ships run away here: that model is in no interval"
        )
    if prediction.share_unstable >= 0.05:
        sentences.append(
            f"unstable on a straight course with a probability of {100.0 * prediction.share_unstable:.0f} %"
        )
    if not parameter_set.convergence.get("converged"):
        sentences.append(f"the set did not converge: {parameter_set.convergence.get('reason')}")
    return tuple(sentences)


def _manoeuvre_json(manoeuvre: Manoeuvre) -> dict[str, Any]:
    content: dict[str, Any] = {"kind": manoeuvre.name}
    if isinstance(manoeuvre, PredictedZigzag):
        content["heading_deg"] = round(degrees(manoeuvre.heading_rad), 9)
    content["rudder_deg"] = round(degrees(manoeuvre.rudder_rad), 9)  # type: ignore[attr-defined]
    side = getattr(manoeuvre, "side", None)
    if side is not None:
        content["side"] = "starboard" if side > 0 else "port"
    if isinstance(manoeuvre, PredictedSpiral):
        content["orders_deg"] = [round(degrees(angle), 9) for angle in manoeuvre.orders_rad]
    return content


def _grouped(figures: dict[str, Any]) -> dict[str, Any]:
    """Return figures by name, those with a number behind it as a list."""
    groups: dict[str, Any] = {}
    for name, figure in figures.items():
        base, dot, _ = name.partition(".")
        if dot:
            groups.setdefault(base, []).append(figure)
        else:
            groups[base] = figure
    return groups
