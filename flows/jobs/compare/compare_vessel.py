"""The job that puts a vessel's runs beside what a parameter set predicts of them. Nothing is stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.compare.bound_runs import BoundRuns, bound
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Mask
from kempf.pipeline.compare.compared_run import compare_run
from kempf.pipeline.compare.comparison import FITTED, HELD_OUT, ComparedRun, judged, summary
from kempf.pipeline.compare.evidence import Evidence
from kempf.pipeline.compare.marks import marks
from kempf.pipeline.compare.misfit import where
from kempf.pipeline.compare.overshoot import StoredOvershoot, turns_of
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.horizon import Horizon, horizon_of
from kempf.pipeline.predict.run_residuals import RunResiduals, phases_s
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.warehouse.tables.segments import Segment

#: what a comparison says of a manoeuvre, beside how it was predicted
_SAILED = ("kind", "psi0_deg", "delta0_deg", "start", "end")


@dataclass(frozen=True, eq=False)
class Comparison:
    """A vessel's runs beside what a parameter set predicts of them."""

    vessel: str
    parameter_set: ParameterSet
    #: By which the set was chosen; None where it was named.
    alias: str | None
    horizon: Horizon
    #: In order of time.
    runs: tuple[ComparedRun, ...]
    #: One a run.
    found: tuple[Segment, ...]
    #: Why a segment is not among them, by its id.
    skipped: dict[str, str]

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as the command line's JSON object."""
        sample, error = judged(self.runs)
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "alias": self.alias,
            "estimator": self.parameter_set.estimator,
            "effects": list(self.parameter_set.model_spec.get("effects", ())),
            "horizon": self.horizon.name,
            "horizon_words": self.horizon.words,
            "runs": [
                {**run.as_json(), **{name: sailed[name] for name in _SAILED}}
                for run, sailed in zip(self.runs, (segment.as_json("") for segment in self.found), strict=True)
            ],
            "summary": summary(self.runs),
            "judged": {"sample": sample, "free_run_error_percent": error},
            "skipped": self.skipped,
        }

    def where(self) -> dict[str, Any]:
        """Say where the model fails, on fitted and on held-out runs apart; None where there are no such runs."""
        misfits: dict[str, Any] = {}
        for sample in (FITTED, HELD_OUT):
            residuals = self._of(sample)
            misfits[sample] = where(residuals) if residuals else None
        return misfits

    def marks(self, evidence: Sequence[Evidence]) -> dict[str, dict[str, Mask]]:
        """Return at which instants what speaks against the model shows, see `kempf.pipeline.compare.marks.marks`."""
        masks: dict[str, dict[str, Mask]] = {}
        for sample in (FITTED, HELD_OUT):
            own = [item for item in evidence if item.sample == sample]
            masks |= marks(self._of(sample), own) if own else {}
        return masks

    def _of(self, sample: str) -> list[RunResiduals]:
        return [run.residuals for run in self.runs if run.sample == sample]


def compare_vessel(
    warehouse: Warehouse,
    vessel: str,
    set_id: str | None = None,
    horizon: str = "free",
    progress: Progress = silent,
) -> Comparison:
    """Put every usable run of a vessel beside what a parameter set predicts of it.

    Parameters
    ----------
    set_id : str, optional
        Parameter set, by id or alias; by default the current one.
    horizon : str, optional
        See `kempf.pipeline.predict.horizon.horizon_of`.

    Raises
    ------
    NotFound
        ``no_parameter_set``, ``no_runs``, ``no_segments``, ``effect_unknown``.
    UsageError
        ``set_of_another_vessel``, ``horizon_unknown``.
    DataRejected
        ``set_without_parameters``, ``nothing_to_compare``.
    """
    asked = horizon_of(horizon)
    return compared(bound(warehouse, vessel, set_id, progress), asked, progress)


def compared(bound_runs: BoundRuns, horizon: Horizon, progress: Progress = silent) -> Comparison:
    """Predict every run at a horizon; errors are those of `compare_vessel`.

    Where predictions with the set take the likelihood's parameters, a free run is with these.
    """
    if bound_runs.legs is None and horizon.name == "legs":
        horizon = horizon_of("free")
    runs, segments, skipped = [], [], dict(bound_runs.skipped)
    for k, bound_run in enumerate(bound_runs.runs):
        progress(k, len(bound_runs.runs), f"predicting {bound_run.segment.segment_id}")
        try:
            run = compare_run(
                *(bound_run.filtered, Point(bound_runs.hull, bound_runs.values, bound_run.levels.foreseen), horizon),
                held_out=bound_run.held_out,
                legs=bound_runs.legs,
                levels_from=bound_run.levels.source,
                own_levels=bound_run.levels.own,
                phases=phases_s(bound_run.segment.detail.get("phases", ()), bound_run.filtered.run.start_utc_ns),
                turns=_turns(bound_run.segment, bound_run.filtered.run),
            )
        except DataRejected as error:
            skipped[bound_run.segment.segment_id] = error.message
            continue
        runs.append(run)
        segments.append(bound_run.segment)
    progress(len(bound_runs.runs), len(bound_runs.runs), "predicted")
    if not runs:
        raise DataRejected(
            "nothing_to_compare",
            f"{bound_runs.parameter_set.parameter_set_id} predicts none of the {len(bound_runs.runs)} manoeuvres of "
            f"{bound_runs.vessel!r}: " + "; ".join(f"{name}: {why}" for name, why in sorted(skipped.items())[:3]),
            "Ask for another horizon, or compare another parameter set with --set.",
            {"skipped": skipped},
        )
    return Comparison(
        bound_runs.vessel, bound_runs.parameter_set, bound_runs.alias, horizon, tuple(runs), tuple(segments), skipped
    )


def _turns(segment: Segment, run: GridRun) -> tuple[StoredOvershoot, ...]:
    def seconds(ns: int) -> float:
        return (ns - run.start_utc_ns) / SECOND_NS

    overshoots = [
        (o["number"], 1 if o["side"] == "starboard" else -1, seconds(o["peak_utc_ns"]), o["beyond_nominal_deg"])
        for o in segment.detail.get("overshoots", ())
    ]
    return turns_of(overshoots, [seconds(t) for t in segment.executes_utc_ns], seconds(segment.end_utc_ns))
