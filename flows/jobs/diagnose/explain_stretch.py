"""The job that scores every effect on a stretch of one manoeuvre, chosen by a person. Nothing is stored."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.flows.jobs.compare.bound_runs import BoundRun, BoundRuns, bound
from kempf.flows.jobs.identify.standing_model import Own, known_effects
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.compare.run_series import instants_utc_ns
from kempf.pipeline.diagnose.stretches.stretch import Explained, explain
from kempf.pipeline.diagnose.stretches.stretch_json import as_json
from kempf.pipeline.estimate.pooled_fit import fit
from kempf.schemas.errors import DataRejected, NotFound, UsageError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet


@dataclass(frozen=True, eq=False)
class ExplainedStretch:
    """A stretch, and what every effect would explain of it."""

    vessel: str
    parameter_set: ParameterSet
    run: BoundRun
    start_utc_ns: int
    end_utc_ns: int
    found: Explained

    def as_json(self) -> dict[str, Any]:
        """Return it as the command line's JSON object."""
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "beside": list(self.parameter_set.model_spec.get("effects", ())),
            "segment_id": self.run.segment.segment_id,
            "held_out": self.run.held_out,
            "from": iso_utc(self.start_utc_ns),
            "to": iso_utc(self.end_utc_ns),
            **as_json(self.found),
        }


def explain_stretch(
    warehouse: Warehouse,
    vessel: str,
    start_utc_ns: int,
    end_utc_ns: int,
    set_id: str | None = None,
    progress: Progress = silent,
    segment_id: str | None = None,
) -> ExplainedStretch:
    """Score every effect of the catalogue that a model has not on a stretch of one manoeuvre.

    Parameters
    ----------
    start_utc_ns, end_utc_ns : int
        The stretch, UTC nanoseconds, both ends included.
    set_id : str, optional
        Model whose errors are looked at; by default the vessel's current set.
    segment_id : str, optional
        Beginning of the id of the manoeuvre, where logs share their instants.

    Raises
    ------
    UsageError
        ``window_empty``, ``stretch_over_several``: it reaches over two manoeuvres, whose noise is not the same.
    NotFound
        ``no_stretch``: no manoeuvre is there; ``no_run``: no manoeuvre of hers has this id; and what
        `kempf.flows.jobs.compare.bound_runs.bound` raises.
    DataRejected
        ``nothing_fitted``: none of the manoeuvres that the set was fitted to is left.
    """
    if end_utc_ns <= start_utc_ns:
        raise UsageError("window_empty", "The stretch ends before it begins.", "Give a later end.")
    bound_runs = bound(warehouse, vessel, set_id, progress)
    run = _run_of(bound_runs, start_utc_ns, end_utc_ns, segment_id or "")
    used = [bound_run for bound_run in bound_runs.runs if not bound_run.held_out]
    if not used:
        raise DataRejected(
            "nothing_fitted",
            f"None of the manoeuvres that {bound_runs.parameter_set.parameter_set_id} was fitted to is left.",
            "Choose another set with --set, or bring her up to date with `kempf reprocess`.",
        )
    runs = used if not run.held_out else [*used, run]
    time = instants_utc_ns(run.filtered.run)
    known = known_effects(Own.from_json(bound_runs.parameter_set.settings.get("own") or {}))
    progress(0, 1, f"scoring {len(known)} effects")
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        # no step of the search: what the set says is looked at as it is
        base = fit(
            [bound_run.filtered for bound_run in runs],
            bound_runs.hull,
            np.array([bound_run.levels.own for bound_run in runs]),
            bound_runs.values,
            workers,
            max_iterations=0,
        )
        explanation = explain(
            base,
            [not bound_run.held_out for bound_run in runs],
            runs.index(run),
            (start_utc_ns <= time) & (time <= end_utc_ns),
            known,
            workers,
        )
    progress(1, 1, "scored")
    return ExplainedStretch(vessel, bound_runs.parameter_set, run, start_utc_ns, end_utc_ns, explanation)


def _run_of(bound_runs: BoundRuns, start_utc_ns: int, end_utc_ns: int, name: str) -> BoundRun:
    """Return the manoeuvre that a stretch lies in; the stretch may reach beyond its ends."""
    spans = []
    runs = []
    named = [run for run in bound_runs.runs if run.segment.segment_id.startswith(name)]
    if not named:
        raise NotFound(
            "no_run",
            f"No manoeuvre of {bound_runs.vessel!r} that can be predicted is called {name!r}.",
            f"`kempf segments --vessel {bound_runs.vessel}` lists them.",
            {"segment_id": name},
        )
    for run in named:
        time = instants_utc_ns(run.filtered.run)
        spans.append(f"{run.segment.segment_id} {iso_utc(int(time[0]))[:19]} to {iso_utc(int(time[-1]))[:19]}")
        if int(time[0]) <= end_utc_ns and start_utc_ns <= int(time[-1]):
            runs.append(run)
    if not runs:
        raise NotFound(
            "no_stretch",
            f"No manoeuvre of {bound_runs.vessel!r} that can be predicted is between {iso_utc(start_utc_ns)} and "
            f"{iso_utc(end_utc_ns)}.",
            "Choose a stretch of one of them: " + "; ".join(spans[:10]) + ".",
        )
    if len(runs) > 1:
        names = ", ".join(run.segment.segment_id for run in runs)
        raise UsageError(
            "stretch_over_several",
            f"The stretch reaches over several manoeuvres, {names}, whose noise is not the same.",
            "Take a stretch of one of them, or say which with --segment ID.",
        )
    return runs[0]
