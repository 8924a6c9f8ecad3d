"""The job that says which zigzag to sail next: what would part models that fit alike, or narrow the parameters most.

Nothing is fitted or stored but models that fit as well as the set's and were not stored before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, degrees, floor, inf, log10, radians
from typing import Any

import numpy as np

from kempf.flows.jobs.compare.bound_runs import BoundRuns, bound
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.flows.jobs.predict.predict_vessel import models_of_set, predict_with
from kempf.flows.jobs.predict.predicted import SetPrediction
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.steps.confusion_sets import WINDOW
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.ship import SailedTrack
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.next_trial.planned_run import as_predicted, planned
from kempf.pipeline.next_trial.worth import Known, apart, information, narrowed, probability, times_to_halve
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.covariance import covariance_of
from kempf.warehouse.tables.parameter_set import ParameterSet

#: heading and rudder of the zigzags that are looked at, deg: those of the standards, then what else gears do
ANGLES_DEG = (
    (5.0, 5.0),
    (10.0, 10.0),
    (20.0, 20.0),
    (10.0, 20.0),
    (20.0, 10.0),
    (15.0, 25.0),
    (30.0, 30.0),
    (35.0, 35.0),
)
#: probability below which one trial more of the kind is no way to part models
_WORTH_REPEATING = 0.05
#: probability with which a trial that is said to part models does
_SURE = 0.9
#: rudder beyond that which was sailed of which nothing is said, deg
_FURTHER_DEG = 1.0


@dataclass(frozen=True, eq=False)
class ProposedZigzag:
    """A zigzag that could be sailed, and what it is worth."""

    angles_deg: tuple[float, float]
    #: From the first order until the last leg has ended, s.
    duration_s: float
    #: Along the approach and across it, m.
    sea_room_m: tuple[float, float]
    #: Standard error after it by that before, by parameter of the ship.
    narrowed: dict[str, float]
    #: How often it must be sailed to halve the parameter's standard error that is asked for; None: more than 64 times.
    times_to_halve: int | None
    #: Whether its rudder goes beyond what was sailed.
    beyond: bool
    #: Of every two models, true one first: the probability that the trial parts them.
    parts: dict[tuple[str, str], float]

    @property
    def probability(self) -> float | None:
        """That whichever model is true is parted from every other; None where there is but one."""
        return min(self.parts.values(), default=None)

    @property
    def mean_narrowed(self) -> float:
        """Geometric mean over the parameters."""
        return float(np.exp(np.mean(np.log(list(self.narrowed.values())))))


@dataclass(frozen=True, eq=False)
class NextTrial:
    """Which zigzag to sail next."""

    vessel: str
    parameter_set: ParameterSet
    #: Effects by parameter set, that of the set first.
    models: dict[str, tuple[str, ...]]
    speed_m_s: float
    #: Whose interval is to be halved; None where all count.
    parameter: str | None
    #: The best first.
    trials: tuple[ProposedZigzag, ...]
    #: Of the best by the set's model and those that fit as well.
    predicted: SetPrediction
    #: What was taken for granted, sentences.
    remarks: tuple[str, ...]

    @property
    def parting(self) -> bool:
        """Whether models are to be parted, not an interval to be halved."""
        return len(self.models) > 1 and self.parameter is None

    def as_json(self) -> dict[str, Any]:
        """Return it as the command line's JSON object."""
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "aim": "part" if self.parting else "narrow",
            "parameter": self.parameter,
            "models": [{"parameter_set_id": name, "effects": list(own)} for name, own in self.models.items()],
            "speed_m_s": self.speed_m_s,
            "trials": [_show(trial) for trial in self.trials],
            "order": self.order(),
            "expected": self.predicted.as_json()["figures"],
            "sentences": self.sentences(),
        }

    def order(self) -> list[str]:
        """Return the best trial as a sailing order, one sentence a step."""
        best = self.trials[0]
        heading, rudder = best.angles_deg
        along, across = best.sea_room_m
        overshoots = [
            f"{f.value:.1f} ({f.low:.1f} to {f.high:.1f})"
            for name, f in self.predicted.prediction.figures.items()
            if name.startswith("overshoots_deg.") and f.value is not None
        ]
        return [
            f"Zigzag {heading:g}/{rudder:g}. Sea room of {along:g} m along the approach and {across:g} m "
            "across it, current and wind not counted; deep water.",
            f"Steady on a straight course at {self.speed_m_s:.3g} m/s through the water for a minute or more; the "
            "engine is left as it is from then on.",
            f"Rudder {rudder:g} deg to starboard. When the heading has changed by {heading:g} deg: rudder {rudder:g} "
            "deg to port; when it is as far on the other side: to starboard again; five executes in all.",
            f"It takes about {_minutes(best.duration_s)}. Overshoots to be expected, with 95 % intervals: "
            f"{', '.join(overshoots)} deg."
            if overshoots
            else f"It takes about {_minutes(best.duration_s)}.",
            "Log heading, yaw rate, rudder angle, speed through the water and GNSS velocity as in the trials before, "
            "from a minute before the first order on.",
        ]

    def _alike(self) -> str:
        """Return what is to be parted, in words: by the effects that not all models have."""
        shared = set.intersection(*(set(own) for own in self.models.values()))
        own = [" + ".join(name for name in effects if name not in shared) for effects in self.models.values()]
        return f"the {len(own)} models that fit alike ({' or '.join(names or 'none beside' for names in own)})"

    def sentences(self) -> list[str]:
        """Return what was found, the answer first."""
        best = self.trials[0]
        name = "{:g}/{:g}".format(*best.angles_deg)
        sentences = []
        if self.parting:
            alike, sure = self._alike(), best.probability or 0.0
            if sure >= _SURE:
                sentences.append(
                    f"One zigzag {name} more parts {alike} with a probability of {_percent(sure)}, whichever is true."
                )
            else:
                often = "Sail it more than once, or" if sure >= _WORTH_REPEATING else "Sail"
                sentences.append(
                    f"None of the {len(self.trials)} zigzags parts {alike} with a probability of {_percent(_SURE)}; "
                    f"the best, {name}, with {_percent(sure)}. {often} a turning circle, by which models are compared "
                    "(`kempf predict --compare`)."
                )
            sentences.append(
                "The probability holds where one of the models is the whole truth; where neither is, less."
            )
        elif self.parameter is not None:
            share = best.narrowed[self.parameter]
            times = best.times_to_halve
            sentences.append(
                f"One zigzag {name} more brings the standard error of {self.parameter} to {100 * share:.0f} % of what "
                f"it is; {_halving(times)}."
            )
        else:
            sentences.append(
                f"One zigzag {name} more brings the standard errors of the {len(best.narrowed)} parameters to "
                f"{100 * best.mean_narrowed:.0f} % of what they are, their geometric mean; all trials are below."
            )
        if best.beyond:
            sentences.append("Its rudder goes beyond what was sailed: what is expected of it is extrapolated.")
        return [*sentences, *self.remarks]


def next_trial(
    warehouse: Warehouse,
    vessel: str,
    set_id: str | None = None,
    parameter: str | None = None,
    progress: Progress = silent,
) -> NextTrial:
    """Find the zigzag to sail next.

    Parameters
    ----------
    set_id : str, optional
        Parameter set, by id or alias; by default the current one.
    parameter : str, optional
        Whose interval is to be halved; by default models that fit alike are to be parted, or where there are none, all
        parameters to be narrowed.

    Raises
    ------
    UsageError
        ``parameter_unknown``; what `kempf.flows.jobs.predict.predict_vessel.models_of_set` raises.
    NotFound
        ``no_parameter_set``, ``no_runs``.
    DataRejected
        ``predicts_no_ship``: by the set's model she can sail none of the zigzags; ``set_without_covariance``.
    """
    request = PredictRequest("zigzag", set_id)
    set_models = models_of_set(warehouse, vessel, request, progress)
    models = [_model(bound(warehouse, vessel, model.name, progress), model) for model in set_models.models]
    of_ship = [name for name in models[0].known_names if name in _names_of_ship(set_models.models[0])]
    if parameter is not None and parameter not in of_ship:
        raise UsageError(
            "parameter_unknown",
            f"{parameter!r} is no parameter of {set_models.parameter_set.parameter_set_id} with a standard error.",
            f"Name one of {', '.join(of_ship)}.",
            {"expected": of_ship},
        )
    trials = []
    for done, angles in enumerate(ANGLES_DEG):
        progress(done, len(ANGLES_DEG), "sailing zigzag {:g}/{:g}".format(*angles))
        trial = _trial(angles, models, set_models.basis.logs.rudder_rad, parameter, of_ship)
        if trial is not None:
            trials.append(trial)
    if not trials:
        raise DataRejected(
            "predicts_no_ship",
            f"By {set_models.parameter_set.parameter_set_id} she runs away in every one of the {len(ANGLES_DEG)} "
            "zigzags.",
            "Choose another set; `kempf params list` names them.",
        )
    trials.sort(key=lambda trial: _rank(trial, parameter))
    predicted = predict_with(set_models, replace(request, angles_deg=trials[0].angles_deg), progress)
    effects = {model.name: tuple(effect.name for effect in model.waters.model.effects) for model in set_models.models}
    remarks = (
        *(f"{remark[0].upper()}{remark[1:]}." for remark in set_models.remarks),
        "A turning circle or a pull-out is not among them: models are held against these, never fitted.",
    )
    return NextTrial(
        vessel, set_models.parameter_set, effects, set_models.speed_m_s, parameter, tuple(trials), predicted, remarks
    )


def _rank(trial: ProposedZigzag, parameter: str | None) -> tuple[float, float]:
    """Return what the best trial has least of."""
    if parameter is not None:
        # one run may narrow more than another by which the error never halves
        return trial.times_to_halve or inf, trial.narrowed[parameter]
    return (trial.mean_narrowed if trial.probability is None else -trial.probability), 0.0


@dataclass(frozen=True, eq=False)
class _TrialModel:
    """A model of the ship, ready to sail and to be filtered over what another one sails."""

    identified: Identified
    #: Over the longest of her runs.
    like: RunFilter
    #: Where it stands, with the mean levels of the runs that it was fitted to.
    point: Point
    #: A parameter without an error is taken as it is.
    known: Known
    #: Of the parameters in ``known``.
    known_names: tuple[str, ...]

    def over(self, track: SailedTrack) -> RunFilter:
        """Return its filter over a planned run as it predicts that itself."""
        run = planned(track, self.identified.ship, self.like.run, self.like.spec)
        filtered = replace(self.like, run=run)
        return replace(filtered, run=as_predicted(filtered, self.point))


def _model(bound_runs: BoundRuns, identified: Identified) -> _TrialModel:
    covariance = covariance_of(bound_runs.parameter_set, bound_runs.names)
    index = np.flatnonzero(np.diag(covariance) > 0.0)
    levels: Float = np.mean(
        [each.levels.own for each in bound_runs.runs if not each.held_out] or [bound_runs.runs[0].levels.own], axis=0
    )
    return _TrialModel(
        identified,
        max((each.filtered for each in bound_runs.runs), key=lambda each: each.run.measured.shape[0]),
        Point(bound_runs.hull, bound_runs.values, levels),
        Known(tuple(index.tolist()), covariance[np.ix_(index, index)]),
        tuple(bound_runs.names[k] for k in index),
    )


def _names_of_ship(model: Identified) -> tuple[str, ...]:
    """Return the parameters that are the ship's and not those of an instrument's lasting noise."""
    return (*HULL_PARAMETERS, *model.waters.model.names)


def _trial(
    angles: tuple[float, float],
    models: Sequence[_TrialModel],
    sailed_rad: float,
    parameter: str | None,
    of_ship: list[str],
) -> ProposedZigzag | None:
    """Return what one zigzag is worth; None where the ship of the first model cannot sail it.

    Parameters
    ----------
    sailed_rad : float
        Largest rudder that was sailed.
    """
    zigzag = PredictedZigzag(radians(angles[0]), radians(angles[1]))
    tracks = [zigzag.track(model.identified.ship) for model in models]
    over = [model.over(t) if t.how == motion.SAILED else None for model, t in zip(models, tracks, strict=True)]
    first, track = models[0], tracks[0]
    if over[0] is None:
        return None
    gained = information(over[0], first.point)
    shares = dict(zip(first.known_names, narrowed(first.known, gained).tolist(), strict=True))
    parts = {}
    for true, run in zip(models, over, strict=True):
        for other in models:
            if run is not None and other is not true:
                D = apart(replace(other.like, run=run.run), other.point, other.known)
                parts[true.identified.name, other.identified.name] = probability(D, WINDOW)
    return ProposedZigzag(
        angles_deg=angles,
        duration_s=float(track.column(motion.TIME)[-1]),
        sea_room_m=(
            _upwards(np.ptp(track.column(motion.NORTH)).item()),
            _upwards(np.ptp(track.column(motion.EAST)).item()),
        ),
        narrowed={name: shares[name] for name in of_ship},
        times_to_halve=None
        if parameter is None
        else times_to_halve(first.known, gained, first.known_names.index(parameter)),
        beyond=degrees(zigzag.rudder_rad - sailed_rad) > _FURTHER_DEG,
        parts=parts,
    )


def _show(trial: ProposedZigzag) -> dict[str, Any]:
    return {
        "manoeuvre": {"kind": "zigzag", "heading_deg": trial.angles_deg[0], "rudder_deg": trial.angles_deg[1]},
        "duration_s": trial.duration_s,
        "sea_room_m": list(trial.sea_room_m),
        "probability": trial.probability,
        "parts": [{"true": a, "other": b, "probability": p} for (a, b), p in trial.parts.items()],
        "narrowed": trial.narrowed,
        "mean_narrowed": trial.mean_narrowed,
        "times_to_halve": trial.times_to_halve,
        "beyond_what_was_sailed": trial.beyond,
    }


def _upwards(metres: float) -> float:
    """Return a length to two digits, upwards."""
    unit = 10.0 ** (floor(log10(max(metres, 1.0))) - 1)
    return float(f"{ceil(metres / unit) * unit:.2g}")


def _halving(times: int | None) -> str:
    if times == 1:
        return "that one halves it"
    return f"{'more than 64' if times is None else times} of them would halve it"


def _percent(share: float) -> str:
    if share > 0.995:
        return "more than 99 %"
    return f"{100.0 * share:.0f} %" if share >= 0.005 else "less than 1 %"


def _minutes(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} minutes" if seconds >= 90.0 else f"{seconds:.0f} s"
