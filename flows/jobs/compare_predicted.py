"""The measured manoeuvres of a vessel beside what is predicted of each: its own angles, side and approach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import radians
from typing import Any

from kempf.flows.jobs.chosen_manoeuvres import choose
from kempf.flows.jobs.predict_vessel import Predicted
from kempf.flows.jobs.vessel_runs import assembled
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.prediction import Figure, predict
from kempf.pipeline.manoeuvre.pull_out import PullOut
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.spiral import Spiral
from kempf.pipeline.manoeuvre.turning_circle import TurningCircle
from kempf.pipeline.manoeuvre.zigzag import Zigzag
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse import segments
from kempf.warehouse.segments import Segment
from kempf.warehouse.store import Warehouse

_KINDS = {TurningCircle: "turning_circle", Zigzag: "zigzag", PullOut: "pull_out", Spiral: "spiral"}
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

    Each is predicted with its own side, approach speed and rudder as it was held; the rudder of a zigzag is ordered
    over at the headings at which it was, so that a late helmsman is in both numbers.

    Parameters
    ----------
    predicted : Predicted
        Says which kind and angles.
    """
    asked = predicted.prediction.manoeuvre
    wanted = [s for s in segments.current(warehouse, predicted.vessel) if _same_order(s, asked)]
    approaches = _approaches(warehouse, predicted, wanted, progress) if isinstance(asked, Zigzag) else {}
    found = []
    for done, segment in enumerate(wanted):
        progress(done, len(wanted), f"predicting {segment.segment_id}")
        speed = approaches.get(segment.segment_id) or segment.detail.get("approach_speed_m_s") or predicted.speed_m_s
        found.append(_beside(predicted, asked, segment, float(speed)))
    progress(len(wanted), len(wanted), "predicted")
    return tuple(found)


def _same_order(segment: Segment, asked: Manoeuvre) -> bool:
    if segment.kind != _KINDS[type(asked)]:
        return False
    rudder = radians(segment.delta0_deg)
    same = abs(rudder - asked.rudder_rad) < radians(_SAME_DEG)  # type: ignore[attr-defined]
    if isinstance(asked, Zigzag):
        return same and abs(radians(segment.psi0_deg) - asked.heading_rad) < radians(_SAME_DEG)
    return same or isinstance(asked, Spiral)


def _approaches(
    warehouse: Warehouse, predicted: Predicted, wanted: list[Segment], progress: Progress
) -> dict[str, float]:
    """Return the approach speed of every zigzag whose log can be used, by its id."""
    chosen, names = choose(warehouse, predicted.vessel), {segment.segment_id for segment in wanted}
    kept = tuple(segment for segment in chosen.segments if segment.segment_id in names)
    if not kept:
        return {}
    logs = {segment.log_id for segment in kept}
    fewer = replace(chosen, segments=kept, ingests={k: v for k, v in chosen.ingests.items() if k in logs})
    spec = ModelSpec.model_validate(dict(predicted.parameter_set.model_spec))
    return {run.name: run.approach_m_s for run in assembled(warehouse, fewer, spec, progress).runs}


def _beside(predicted: Predicted, asked: Manoeuvre, segment: Segment, speed_m_s: float) -> MeasuredManoeuvre:
    held = set(predicted.parameter_set.convergence.get("held_out") or ())
    fitted = segment.segment_id in predicted.parameter_set.segment_ids and segment.segment_id not in held
    sample = "fitted" if fitted else "held_out"
    manoeuvre = _as_sailed(asked, segment)
    models = [_at_speed(one.model, speed_m_s) for one in predicted.prediction.models]
    try:
        basis = predicted.basis
        made = predict(models, manoeuvre, basis.logs, basis.profile.length_m, _DRAWS)
    except KempfError as error:
        return MeasuredManoeuvre(segment.segment_id, segment.first_side, speed_m_s, sample, (), error.message)
    beside = tuple(
        Beside(name, *_measured(figure), made.figures[name])
        for name, figure in _figures_of(segment).items()
        if name in made.figures and _measured(figure)[0] is not None
    )
    return MeasuredManoeuvre(segment.segment_id, segment.first_side, speed_m_s, sample, beside)


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


def _at_speed(model: Identified, speed_m_s: float) -> Identified:
    return replace(model, waters=replace(model.waters, approach_m_s=speed_m_s))


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
