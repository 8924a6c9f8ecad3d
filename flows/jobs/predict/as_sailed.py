"""The measured manoeuvres of a vessel as they were really sailed: beginning, shaft and wind, rudder and headings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen, choose
from kempf.flows.jobs.identify.lasting_noise import with_lasting_noise
from kempf.flows.jobs.identify.loads_of_logs import loads_beside
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.jobs.predict.predicted import SetPrediction
from kempf.flows.jobs.predict.prediction_basis import Basis
from kempf.flows.jobs.predict.spiral_ways import orders_of
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.filtered_beginning import start_of, steady_wind, usual_force
from kempf.pipeline.manoeuvre.initial_conditions import InitialConditions, initial_conditions
from kempf.pipeline.manoeuvre.pull_out import PredictedPullOut
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.ship import Start
from kempf.pipeline.manoeuvre.spiral import PredictedSpiral
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.errors import NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import notes
from kempf.warehouse.tables.parameter_set import Bounds
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True, eq=False)
class AsSailed:
    """One measured manoeuvre, ready to be sailed by a model."""

    segment: Segment
    #: With the rudder as it was held, and for a zigzag the headings at which it was ordered over.
    manoeuvre: Manoeuvre
    speed_m_s: float
    #: The wind counted from the course of the approach.
    initial: InitialConditions
    #: Steady wind force and its standard error: of a zigzag as the filter finds it; of what no filter passes, none
    #: with the size that it has in the zigzags of the set.
    wind_force_m_s2: tuple[float, float]
    arm_per_m: float
    #: ``fitted`` where the set was identified from it, ``held_out`` else.
    sample: str
    #: How the ship was laden, see `pipeline.estimate.record.loads`; None where no run says.
    load: float | None = None

    def on_the_day(self, model: Identified, basis: Basis) -> Identified:
        """Return a model as it was on the day of this manoeuvre."""
        kept, (ratio, std), shaft = basis.kept_m, basis.surge.settled, self.initial.shaft_per_s
        waters = replace(
            model.waters,
            approach_m_s=self.speed_m_s,
            wind_force_m_s2=self.wind_force_m_s2[0],
            wind_arm_per_m=self.arm_per_m,
            true_wind_m_s=self.initial.wind_m_s,
            true_wind_from_rad=self.initial.wind_from_rad,
            air=self.initial.air,
            settled_m_s=None if shaft is None or kept is None else ratio * kept * shaft,
            start=self.initial.start,
            day=model.waters.day if self.load is None else self.load,
        )
        # the gear is that of the logs, whatever other one a prediction was asked for
        own = replace(model, waters=waters, rudder_rate=basis.rudder_rate)
        return replace(
            own,
            wind_force_std_m_s2=self.wind_force_m_s2[1],
            start_std=self.initial.start_std,
            settled_std=std / ratio,
        )


def as_sailed(
    warehouse: Warehouse,
    predicted: SetPrediction,
    pairs: Sequence[tuple[Segment, Manoeuvre]],
    progress: Progress = silent,
) -> list[AsSailed]:
    """Return measured manoeuvres as they were sailed.

    Parameters
    ----------
    predicted : SetPrediction
        Whose set finds the wind of each zigzag, and the motion with which it began.
    pairs : sequence of (Segment, Manoeuvre)
        What was measured, and what of it is to be sailed.
    """
    zigzags = [segment for segment, manoeuvre in pairs if isinstance(manoeuvre, PredictedZigzag)]
    runs = _runs(warehouse, predicted, zigzags, progress) if zigzags else {}
    usual = _usual_wind(predicted) if len(runs) < len(pairs) else (0.0, 0.0)
    sailed, logs = [], _Logs(warehouse)
    for done, (segment, manoeuvre) in enumerate(pairs):
        progress(done, len(pairs), f"reading {segment.segment_id}")
        sailed.append(_one(predicted, manoeuvre, segment, logs.of(segment), runs.get(segment.segment_id), usual))
    progress(len(pairs), len(pairs), "read")
    return sailed


def _one(
    predicted: SetPrediction,
    manoeuvre: Manoeuvre,
    segment: Segment,
    log: Instruments,
    run: RunFilter | None,
    without_run: tuple[float, float],
) -> AsSailed:
    speed_m_s = float(run.run.approach_m_s if run else segment.detail.get("approach_speed_m_s") or predicted.speed_m_s)
    passed = _passed(run, predicted) if run else None
    executes = segment.executes_utc_ns or (segment.start_utc_ns,)
    beginning = initial_conditions(log, executes[0], segment.end_utc_ns, predicted.basis.scale_m / speed_m_s)
    if run is not None:
        start, std = _start(run, passed, segment)
        beginning = replace(beginning, start=start, start_std=replace(std, forward_m_s=beginning.start_std.forward_m_s))
    held = set(predicted.parameter_set.convergence.get("held_out") or ())
    fitted = segment.segment_id in predicted.parameter_set.segment_ids and segment.segment_id not in held
    return AsSailed(
        segment=segment,
        manoeuvre=_as_ordered(manoeuvre, segment),
        speed_m_s=speed_m_s,
        initial=beginning.counted_from(radians(segment.base_heading_deg)),
        wind_force_m_s2=steady_wind(run, passed) if run and passed else without_run,
        arm_per_m=(run.run if run else predicted.basis.runs.runs[0]).ship.arm_per_m,
        sample="fitted" if fitted else "held_out",
        load=run.run.load if run else None,
    )


def _usual_wind(predicted: SetPrediction) -> tuple[float, float]:
    """Return no wind force, with the root mean square of those that the filter finds in the manoeuvres of the set.

    A manoeuvre on which the set is not fitted has a wind of its own, from any side. What wanders about the steady force
    averages out in a turn; where the model lacks something it is that, too.
    """
    basis = predicted.basis
    model = _with_its_noise(predicted)
    filters = [RunFilter(run, model, basis.runs.spec) for run in basis.runs.runs]
    passes = [(one, _passed(one, predicted)) for one in filters]
    return 0.0, usual_force([steady_wind(one, passed) for one, passed in passes if passed])


class _Logs:
    """The channels of the log that was read last: manoeuvres come log by log."""

    def __init__(self, warehouse: Warehouse) -> None:
        self._warehouse, self._ingest = warehouse, ""

    def of(self, segment: Segment) -> Instruments:
        if segment.ingest_id != self._ingest:
            self._instruments, self._ingest = channels_of(self._warehouse, segment.ingest_id), segment.ingest_id
        return self._instruments


def _runs(
    warehouse: Warehouse, predicted: SetPrediction, zigzags: list[Segment], progress: Progress
) -> dict[str, RunFilter]:
    """Return every zigzag whose log can be used, by its id, under the model of the set."""
    chosen, names = choose(warehouse, predicted.vessel), {segment.segment_id for segment in zigzags}
    kept = tuple(segment for segment in chosen.segments if segment.segment_id in names)
    if not kept:
        return {}
    basis, model = predicted.basis, _with_its_noise(predicted)
    # those of the set are laid out already
    own = {bounds: name for name, bounds in basis.bounds.items()}
    named = {s.segment_id: own.get(Bounds(s.log_id, s.start_utc_ns, s.end_utc_ns)) for s in kept}
    laid = {run.name: run for run in basis.runs.runs}
    runs = [replace(laid[name], name=segment_id) for segment_id, name in named.items() if name in laid]
    others = tuple(segment for segment in kept if named[segment.segment_id] is None)
    try:
        runs += _beside_the_set(warehouse, predicted, replace(chosen, segments=others), progress) if others else ()
    except NotFound as error:
        # a manoeuvre that is no run is sailed without the wind and the first motion that a run would give
        if error.code != "no_runs":
            raise
    return {run.name: RunFilter(run, model, basis.runs.spec) for run in runs}


def _with_its_noise(predicted: SetPrediction) -> EffectModel:
    """Return the model of a set with the lasting noise that was found with it."""
    model = predicted.prediction.models[0].model.waters.model
    return with_lasting_noise(predicted.parameter_set, model, np.zeros(len(model.names)))[0]


def _beside_the_set(
    warehouse: Warehouse, predicted: SetPrediction, chosen: Chosen, progress: Progress
) -> tuple[GridRun, ...]:
    """Return runs of further manoeuvres as those of the set are: profile, step, slip and load on the set's scale."""
    basis, parameter_set = predicted.basis, predicted.parameter_set
    inputs: dict[str, Any] = dict(parameter_set.provenance.get("inputs") or {})
    logs, others = {s.log_id for s in chosen.segments}, [(s.segment_id, s) for s in chosen.segments]
    noted = notes.draughts_m(notes.of_vessel(warehouse, predicted.vessel), chosen.segments)
    alike = replace(
        chosen,
        ingests={log_id: ingest_id for log_id, ingest_id in chosen.ingests.items() if log_id in logs},
        profile_sha256=str(inputs["profile_sha256"]),
        loads=loads_beside(basis.bounds.items(), inputs.get("draughts_m", {}), others, noted),
    )
    spec = ModelSpec.model_validate(dict(parameter_set.model_spec))
    return assembled(warehouse, alike, spec, progress, basis.alike).runs


def _as_ordered(manoeuvre: Manoeuvre, segment: Segment) -> Manoeuvre:
    side = 1 if segment.first_side == "starboard" else -1
    rudder = radians(float(segment.detail.get("delta0_measured_deg") or segment.delta0_deg))
    if isinstance(manoeuvre, PredictedZigzag):
        executes = list(segment.detail.get("executes", ()))[1:]
        switched = [radians(abs(float(e["heading_deg"]))) for e in executes]
        return replace(
            manoeuvre, side=side, rudder_rad=rudder, switched_rad=tuple(switched[: manoeuvre.overshoots + 1])
        )
    if isinstance(manoeuvre, PredictedSpiral):
        return replace(manoeuvre, rudder_rad=rudder, held_rad=tuple(map(radians, orders_of(segment))))
    if isinstance(manoeuvre, PredictedCircle):
        # the steady figures are means over the last turn: of as many turns as were sailed
        turned = radians(abs(float(segment.detail["heading_change_deg"])))
        return replace(manoeuvre, side=side, rudder_rad=rudder, turn_rad=turned)
    if isinstance(manoeuvre, PredictedPullOut):
        after = float(segment.detail["rudder_after_deg"])
        return replace(manoeuvre, side=side, rudder_rad=rudder, after_rad=radians(after))
    return replace(manoeuvre, side=side, rudder_rad=rudder)  # type: ignore[type-var]


def _passed(run: RunFilter, predicted: SetPrediction) -> Passed | None:
    """Return a manoeuvre passed through the filter of the set, None for a set without noise levels."""
    levels: Mapping[str, Any] = predicted.parameter_set.convergence.get("levels") or {}
    if not levels:
        return None
    every = np.array(list(levels.values()), dtype=np.float64)
    own = np.array(levels[run.run.name], dtype=np.float64) if run.run.name in levels else np.mean(every, axis=0)
    model = predicted.prediction.models[0].model
    ship = model.waters.model
    _, values = with_lasting_noise(predicted.parameter_set, ship, np.asarray(model.effects))
    return run.run_filter(model.hull, np.exp(own), values, states=True)


def _start(run: RunFilter, passed: Passed | None, segment: Segment) -> tuple[Start, Start]:
    """Return with which speed, drift, turn and rudder a zigzag began, and standard errors as the filter has them."""
    executes = list(segment.detail.get("executes", ()))
    at = (executes[0]["time_utc_ns"] - run.run.start_utc_ns) / SECOND_NS if executes else 0.0
    rudder = radians(float(executes[0]["rudder_before_deg"])) if executes else None
    return start_of(run, passed, at, rudder)
