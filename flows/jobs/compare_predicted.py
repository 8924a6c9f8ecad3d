"""The measured manoeuvres of a vessel beside what is predicted of each: its own angles, side, approach and wind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import Any

import numpy as np

from kempf.flows.jobs.chosen_manoeuvres import choose
from kempf.flows.jobs.log_channels import channels_of
from kempf.flows.jobs.predict_vessel import Predicted
from kempf.flows.jobs.vessel_runs import assembled
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import SECOND_NS
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.manoeuvre.began import Began, began
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.prediction import Figure, predict
from kempf.pipeline.manoeuvre.pull_out import PullOut
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.ship import Start
from kempf.pipeline.manoeuvre.spiral import Spiral
from kempf.pipeline.manoeuvre.turning_circle import TurningCircle
from kempf.pipeline.manoeuvre.zigzag import Zigzag
from kempf.pipeline.model.chain import F, R, V
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse import segments
from kempf.warehouse.segments import Segment
from kempf.warehouse.store import Warehouse

_KINDS = {TurningCircle: "turning_circle", Zigzag: "zigzag", PullOut: "pull_out", Spiral: "spiral"}
#: a force that changes faster is no wind that is steady over a manoeuvre
_STEADY_PER_S = 0.01
#: ships drawn for each measured manoeuvre
_DRAWS = 128
#: rudder angles that differ by less are the same order, deg
_SAME_DEG = 0.6


@dataclass(frozen=True)
class Beside:
    """One figure, measured and predicted."""

    name: str
    measured: float
    #: measured_low, measured_high: 95 % interval of the measurement, None where it is not known.
    measured_low: float | None
    measured_high: float | None
    predicted: Figure

    def show(self) -> dict[str, Any]:
        """Return it as JSON content."""
        low, high = self.predicted.low, self.predicted.high
        inside = None if low is None or high is None else low <= self.measured <= high
        measured = {"measured": self.measured, "measured_low": self.measured_low, "measured_high": self.measured_high}
        return {"figure": self.name, **measured, **vars(self.predicted), "inside": inside}


@dataclass(frozen=True)
class MeasuredManoeuvre:
    """A measured manoeuvre beside its prediction."""

    segment_id: str
    side: str
    speed_m_s: float
    #: Steady wind of the manoeuvre, as the filter finds it.
    wind_force_m_s2: float
    #: ``fitted`` where the set was identified from it, ``held_out`` else.
    sample: str
    figures: tuple[Beside, ...]
    #: Why there is no prediction; empty where there is one.
    why: str = ""

    def show(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {**vars(self), "figures": [one.show() for one in self.figures]}


def measured_beside(
    warehouse: Warehouse, predicted: Predicted, progress: Progress = silent
) -> tuple[MeasuredManoeuvre, ...]:
    """Lay the prediction over the measured manoeuvres of the same kind and angles, to both sides.

    Each is predicted with its own side, with the speed and the turn that it really began with, the shaft speed and the
    true wind of its log, and the rudder as it was held; a zigzag also in the steady wind that the filter finds, the
    rudder ordered over at the headings at which it was, so that wind and helmsman are in both numbers.

    Parameters
    ----------
    predicted : Predicted
        Says which kind and angles.
    """
    asked = predicted.prediction.manoeuvre
    wanted = [s for s in segments.every(warehouse, predicted.vessel) if _same_order(s, asked)]
    return _all_beside(warehouse, predicted, [(segment, asked) for segment in wanted], progress)


def own_zigzags_beside(
    warehouse: Warehouse, predicted: Predicted, progress: Progress = silent
) -> tuple[MeasuredManoeuvre, ...]:
    """Lay predictions over all zigzags of the vessel, whatever their angles, each as `measured_beside` does it."""
    every = [s for s in segments.current(warehouse, predicted.vessel) if s.kind == "zigzag"]
    pairs = [(s, Zigzag(radians(s.psi0_deg), radians(s.delta0_deg), overshoots=2)) for s in every]
    return _all_beside(warehouse, predicted, pairs, progress)


def _all_beside(
    warehouse: Warehouse, predicted: Predicted, pairs: Sequence[tuple[Segment, Manoeuvre]], progress: Progress
) -> tuple[MeasuredManoeuvre, ...]:
    zigzags = [segment for segment, asked in pairs if isinstance(asked, Zigzag)]
    runs = _runs(warehouse, predicted, zigzags, progress) if zigzags else {}
    found, logs = [], _Logs(warehouse)
    for done, (segment, asked) in enumerate(pairs):
        progress(done, len(pairs), f"predicting {segment.segment_id}")
        found.append(_beside(predicted, asked, segment, logs.of(segment), runs.get(segment.segment_id)))
    progress(len(pairs), len(pairs), "predicted")
    return tuple(found)


class _Logs:
    """The channels of the log that was read last: manoeuvres come log by log."""

    def __init__(self, warehouse: Warehouse) -> None:
        self._warehouse, self._ingest = warehouse, ""

    def of(self, segment: Segment) -> Instruments:
        if segment.ingest_id != self._ingest:
            self._instruments, self._ingest = channels_of(self._warehouse, segment.ingest_id), segment.ingest_id
        return self._instruments


def _same_order(segment: Segment, asked: Manoeuvre) -> bool:
    if segment.kind != _KINDS[type(asked)]:
        return False
    rudder = radians(segment.delta0_deg)
    same = abs(rudder - asked.rudder_rad) < radians(_SAME_DEG)  # type: ignore[attr-defined]
    if isinstance(asked, Zigzag):
        return same and abs(radians(segment.psi0_deg) - asked.heading_rad) < radians(_SAME_DEG)
    return same or isinstance(asked, Spiral)


def _runs(
    warehouse: Warehouse, predicted: Predicted, wanted: list[Segment], progress: Progress
) -> dict[str, RunFilter]:
    """Return every zigzag whose log can be used, by its id, under the model of the set."""
    chosen, names = choose(warehouse, predicted.vessel), {segment.segment_id for segment in wanted}
    kept = tuple(segment for segment in chosen.segments if segment.segment_id in names)
    if not kept:
        return {}
    logs = {segment.log_id for segment in kept}
    fewer = replace(chosen, segments=kept, ingests={k: v for k, v in chosen.ingests.items() if k in logs})
    spec = ModelSpec.model_validate(dict(predicted.parameter_set.model_spec))
    made, model = assembled(warehouse, fewer, spec, progress), predicted.prediction.models[0].model.waters.model
    return {run.name: RunFilter(run, model, made.spec) for run in made.runs}


def _beside(
    predicted: Predicted, asked: Manoeuvre, segment: Segment, log: Instruments, run: RunFilter | None
) -> MeasuredManoeuvre:
    speed_m_s = float(run.run.approach_m_s if run else segment.detail.get("approach_speed_m_s") or predicted.speed_m_s)
    passed = _passed(run, predicted) if run else None
    force, force_std = _steady_wind(run, passed) if run and passed else (0.0, 0.0)
    executes = segment.executes_utc_ns or (segment.start_utc_ns,)
    seen = began(log, executes[0], segment.end_utc_ns, predicted.basis.scale_m / speed_m_s)
    if run is not None:
        seen = replace(seen, start=_start(run, passed, segment))
    held = set(predicted.parameter_set.convergence.get("held_out") or ())
    fitted = segment.segment_id in predicted.parameter_set.segment_ids and segment.segment_id not in held
    sample = "fitted" if fitted else "held_out"
    manoeuvre = _as_sailed(asked, segment)
    arm = run.run.ship.arm_per_m if run else 0.0
    models = [
        _on_the_day(one.model, predicted, speed_m_s, (force, force_std), arm, _turned(seen, segment))
        for one in predicted.prediction.models
    ]
    try:
        basis = predicted.basis
        made = predict(models, manoeuvre, basis.logs, basis.profile.length_m, _DRAWS)
    except KempfError as error:
        about = (segment.segment_id, segment.first_side, speed_m_s, force, sample)
        return MeasuredManoeuvre(*about, (), error.message)
    beside = tuple(
        Beside(name, *_measured(figure), made.figures[name])
        for name, figure in _figures_of(segment).items()
        if name in made.figures and _measured(figure)[0] is not None
    )
    return MeasuredManoeuvre(segment.segment_id, segment.first_side, speed_m_s, force, sample, beside)


def _as_sailed(asked: Manoeuvre, segment: Segment) -> Manoeuvre:
    side = 1 if segment.first_side == "starboard" else -1
    rudder = radians(float(segment.detail.get("delta0_measured_deg") or segment.delta0_deg))
    if isinstance(asked, Zigzag):
        executes = list(segment.detail.get("executes", ()))[1:]
        switched = [radians(abs(float(e["heading_deg"]))) for e in executes]
        return replace(asked, side=side, rudder_rad=rudder, switched_rad=tuple(switched[: asked.overshoots + 1]))
    if isinstance(asked, Spiral):
        return replace(asked, rudder_rad=rudder)
    return replace(asked, side=side, rudder_rad=rudder)  # type: ignore[type-var]


def _turned(seen: Began, segment: Segment) -> Began:
    """Return a beginning with the wind counted from the course of the approach."""
    return replace(seen, wind_from_rad=seen.wind_from_rad - radians(segment.base_heading_deg))


def _on_the_day(
    model: Identified, predicted: Predicted, speed_m_s: float, force: tuple[float, float], arm: float, seen: Began
) -> Identified:
    kept, (ratio, std) = predicted.basis.kept_m, predicted.basis.surge.settled
    shaft = seen.shaft_per_s if kept is not None else None
    waters = replace(
        model.waters,
        approach_m_s=speed_m_s,
        wind_force_m_s2=force[0],
        wind_arm_per_m=arm,
        true_wind_m_s=seen.wind_m_s,
        true_wind_from_rad=seen.wind_from_rad,
        settled_m_s=None if shaft is None or kept is None else ratio * kept * shaft,
        start=seen.start,
    )
    return replace(model, waters=waters, wind_force_std_m_s2=force[1], settled_std=std / ratio)


def _passed(run: RunFilter, predicted: Predicted) -> Passed | None:
    """Return a manoeuvre passed through the filter of the set, None for a set without noise levels."""
    levels: Mapping[str, Any] = predicted.parameter_set.convergence.get("levels") or {}
    if not levels:
        return None
    every = np.array(list(levels.values()), dtype=np.float64)
    own = np.array(levels[run.run.name], dtype=np.float64) if run.run.name in levels else np.mean(every, axis=0)
    model = predicted.prediction.models[0].model
    return run.run_filter(model.hull, np.exp(own), model.effects, states=True)


def _start(run: RunFilter, passed: Passed | None, segment: Segment) -> Start:
    """Return with which speed, drift, turn and rudder a zigzag began."""
    executes = list(segment.detail.get("executes", ()))
    at = (executes[0]["time_utc_ns"] - run.run.start_utc_ns) / SECOND_NS if executes else 0.0
    speed = float(np.interp(at, run.run.time_s, run.run.speed_m_s))
    if passed is None or not np.all(np.isfinite(passed.states)):
        return Start(forward_m_s=speed)
    lateral, rate = (float(np.interp(at, run.run.time_s, passed.states[:, i])) for i in (V, R))
    rudder = radians(float(executes[0]["rudder_before_deg"])) if executes else None
    return Start(speed, lateral, rate, rudder)


def _steady_wind(run: RunFilter, passed: Passed) -> tuple[float, float]:
    """Return the wind force that the filter comes to in a manoeuvre, m/s^2, with its standard error and wandering.

    Both are 0 where the model's force is no steady wind.
    """
    if run.spec.wind == "none" or run.spec.wind_correlation_rate_per_s > _STEADY_PER_S:
        return 0.0, 0.0
    # the first half is what it takes to find it
    late = slice(len(passed.states) // 2, None)
    force, wander = float(np.mean(passed.states[late, F])), float(np.var(passed.states[late, F]))
    std = float(np.sqrt(wander + np.mean(passed.spread[late, F])))
    return (force, std) if np.isfinite(force + std) else (0.0, 0.0)


def _figures_of(segment: Segment) -> Mapping[str, Any]:
    if segment.kind == "zigzag":
        overshoots = segment.detail.get("overshoots", ())
        return {f"overshoots_deg.{o['number'] - 1}": o["beyond_nominal_deg"] for o in overshoots}
    figures: Mapping[str, Any] = segment.detail.get("figures", {})
    return figures


def _measured(figure: Any) -> tuple[Any, float | None, float | None]:
    if isinstance(figure, Mapping):
        return figure.get("value"), figure.get("low"), figure.get("high")
    return figure, None, None
