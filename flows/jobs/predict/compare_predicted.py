"""The measured manoeuvres of a vessel beside what is predicted of each: its own angles, side, approach and wind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, hypot, radians
from typing import Any

from kempf.flows.jobs.predict.as_sailed import AsSailed, as_sailed
from kempf.flows.jobs.predict.predicted import SetPrediction
from kempf.flows.jobs.predict.spiral_ways import SAME_ORDER_DEG, rates_of
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.manoeuvre.prediction import PredictedFigure, predict
from kempf.pipeline.manoeuvre.pull_out import PredictedPullOut
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.spiral import PredictedSpiral
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import segments
from kempf.warehouse.tables.segments import Segment

_KINDS: dict[type, str] = {
    PredictedCircle: "turning_circle",
    PredictedZigzag: "zigzag",
    PredictedPullOut: "pull_out",
    PredictedSpiral: "spiral",
}
#: ships drawn for each measured manoeuvre
_DRAWS = 128


@dataclass(frozen=True)
class ComparedFigure:
    """One figure, measured and predicted."""

    name: str
    measured: float
    #: measured_low, measured_high: 95 % interval of the measurement, None where it is not known.
    measured_low: float | None
    measured_high: float | None
    predicted: PredictedFigure

    @property
    def inside(self) -> bool | None:
        """Whether it was measured within the interval; None where there is none."""
        low, high = self.predicted.low, self.predicted.high
        return None if low is None or high is None else low <= self.measured <= high

    @property
    def agrees(self) -> bool | None:
        """Whether measured and predicted differ by no more than both intervals allow together; None without one.

        The halves towards each other, added as independent errors are; of a measurement without an interval none.
        """
        value, low, high = self.predicted.value, self.predicted.low, self.predicted.high
        if value is None or low is None or high is None:
            return None
        above = self.measured >= value
        # of a figure that too few ships of a model reach the value may lie outside
        own = max(high - value if above else value - low, 0.0)
        end = self.measured_low if above else self.measured_high
        return abs(self.measured - value) <= hypot(own, 0.0 if end is None else self.measured - end)

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        measured = {"measured": self.measured, "measured_low": self.measured_low, "measured_high": self.measured_high}
        return {"figure": self.name, **measured, **vars(self.predicted), "inside": self.inside, "agrees": self.agrees}


@dataclass(frozen=True)
class MeasuredManoeuvre:
    """A measured manoeuvre beside its prediction."""

    segment_id: str
    side: str
    speed_m_s: float
    #: wind_force_m_s2, wind_force_std_m_s2: Steady wind force of the manoeuvre and its standard error, see `AsSailed`.
    wind_force_m_s2: float
    wind_force_std_m_s2: float
    #: ``fitted`` where the set was identified from it, ``held_out`` else.
    sample: str
    figures: tuple[ComparedFigure, ...]
    #: Of a spiral: the rudder angles that it held, deg, as its figures are numbered.
    orders_deg: tuple[float, ...] = ()
    #: Why there is no prediction; empty where there is one.
    why: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {**vars(self), "figures": [figure.as_json() for figure in self.figures]}


def measured_beside(
    warehouse: Warehouse, predicted: SetPrediction, progress: Progress = silent
) -> tuple[MeasuredManoeuvre, ...]:
    """Lay the prediction over the measured manoeuvres of the same kind and angles, to both sides.

    Each is predicted with its own side, with the speed and the turn that it really began with, the shaft speed and the
    true wind of its log, and the rudder as it was held; a zigzag also in the steady wind that the filter finds, the
    rudder ordered over at the headings at which it was, so that wind and helmsman are in both numbers. Of any other the
    intervals hold a wind force as large as in the zigzags of the set.

    Parameters
    ----------
    predicted : SetPrediction
        Says which kind and angles.
    """
    manoeuvre = predicted.prediction.manoeuvre
    matches = [s for s in segments.every(warehouse, predicted.vessel) if _same_order(s, manoeuvre)]
    every = as_sailed(warehouse, predicted, [(segment, manoeuvre) for segment in matches], progress)
    return tuple(beside(predicted, sailed) for sailed in every)


def measured_kind(warehouse: Warehouse, predicted: SetPrediction) -> int:
    """Return how many manoeuvres of the kind of a prediction were measured."""
    kind = _KINDS[type(predicted.prediction.manoeuvre)]
    return sum(segment.kind == kind for segment in segments.every(warehouse, predicted.vessel))


def other_orders(warehouse: Warehouse, predicted: SetPrediction) -> dict[str, int]:
    """Return how many manoeuvres of the same kind `measured_beside` leaves out, by the option that predicts them."""
    manoeuvre = predicted.prediction.manoeuvre
    counts: dict[str, int] = {}
    for segment in segments.every(warehouse, predicted.vessel):
        if segment.kind == _KINDS[type(manoeuvre)] and not _same_order(segment, manoeuvre):
            angles = f"--angles {segment.psi0_deg:g}/{segment.delta0_deg:g}"
            option = angles if isinstance(manoeuvre, PredictedZigzag) else f"--rudder {segment.delta0_deg:g}"
            counts[option] = counts.get(option, 0) + 1
    return dict(sorted(counts.items()))


def own_zigzags(warehouse: Warehouse, predicted: SetPrediction, progress: Progress = silent) -> list[AsSailed]:
    """Return all zigzags of the vessel, whatever their angles, with their first two overshoots."""
    every = [s for s in segments.current(warehouse, predicted.vessel) if s.kind == "zigzag"]
    pairs = [(s, PredictedZigzag(radians(s.psi0_deg), radians(s.delta0_deg), overshoots=2)) for s in every]
    return as_sailed(warehouse, predicted, pairs, progress)


def _same_order(segment: Segment, manoeuvre: Manoeuvre) -> bool:
    if segment.kind != _KINDS[type(manoeuvre)]:
        return False
    rudder = radians(segment.delta0_deg)
    same = abs(rudder - manoeuvre.rudder_rad) < radians(SAME_ORDER_DEG)  # type: ignore[attr-defined]
    if isinstance(manoeuvre, PredictedZigzag):
        return same and abs(radians(segment.psi0_deg) - manoeuvre.heading_rad) < radians(SAME_ORDER_DEG)
    return same or isinstance(manoeuvre, PredictedSpiral)


def beside(predicted: SetPrediction, sailed: AsSailed) -> MeasuredManoeuvre:
    """Lay a prediction over one manoeuvre."""
    segment, basis = sailed.segment, predicted.basis
    models = [sailed.on_the_day(each.model, basis) for each in predicted.prediction.models]
    about = (segment.segment_id, segment.first_side, sailed.speed_m_s, *sailed.wind_force_m_s2, sailed.sample)
    try:
        prediction = predict(models, sailed.manoeuvre, basis.logs, basis.particulars, _DRAWS)
    except KempfError as error:
        return MeasuredManoeuvre(*about, (), why=error.message)
    figures = tuple(
        ComparedFigure(name, *_measured(figure), prediction.figures[name])
        for name, figure in figures_of(segment).items()
        if name in prediction.figures and _measured(figure)[0] is not None
    )
    held = sailed.manoeuvre.orders_rad if isinstance(sailed.manoeuvre, PredictedSpiral) else ()
    return MeasuredManoeuvre(*about, figures, tuple(round(degrees(angle), 3) for angle in held))


def figures_of(segment: Segment) -> Mapping[str, Any]:
    """Return what was measured of a manoeuvre, by the name of its figure."""
    if segment.kind == "zigzag":
        overshoots = segment.detail.get("overshoots", ())
        return {f"overshoots_deg.{o['number'] - 1}": o["beyond_nominal_deg"] for o in overshoots}
    figures: Mapping[str, Any] = segment.detail.get("figures", {})
    return {**figures, **rates_of(segment)} if segment.kind == "spiral" else figures


def _measured(figure: Any) -> tuple[Any, float | None, float | None]:
    if isinstance(figure, Mapping):
        return figure.get("value"), figure.get("low"), figure.get("high")
    return figure, None, None
