"""The job that brings vessels up to date: logs read anew, zigzags found anew, parameter sets identified.

What is new of several vessels is stored in one commit a table: a table of a large fleet has a file for every vessel,
and each commit looks at all of them.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from shlex import quote

from kempf.flows.jobs.identify.chosen_manoeuvres import choose, out_of_date
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome, Request, identify_segments
from kempf.flows.jobs.identify.pending import PendingSets, store
from kempf.flows.jobs.identify.pool_vessel import pool_segments
from kempf.flows.jobs.identify.standing_model import POOLED, SINGLE, Own, model_of, point, standing_or_withdrawn
from kempf.flows.jobs.identify.update_model import store_up_to_date
from kempf.flows.jobs.ingest.refresh_logs import Refreshed, Stale, refresh_all, stale_logs
from kempf.flows.jobs.reprocess.rerun_set import rerun_alone
from kempf.flows.jobs.reprocess.vessel_quality import quality_of
from kempf.flows.jobs.reprocess.vessel_report import VesselReport, remember_all, remember_history
from kempf.flows.jobs.state.vessel_state import VesselState, fleet_state
from kempf.flows.process.commit_batch import together_or_each
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.estimate.names import NAMES
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, segments
from kempf.warehouse.tables.equivalents import code_of

_log = logging.getLogger("kempf.jobs")


def reprocess_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request | None = None,
    *,
    changed_only: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> VesselReport:
    """Bring one vessel up to date; parameters and result are those of `reprocess_vessels`."""
    (report,) = reprocess_vessels(
        warehouse, [vessel], request, changed_only=changed_only, flow_run=flow_run, progress=progress
    )
    return report


def reprocess_vessels(
    warehouse: Warehouse,
    vessels: Sequence[str],
    request: Request | None = None,
    *,
    changed_only: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> list[VesselReport]:
    """Bring vessels up to date with their profiles and the code.

    A log read with the current profile and code is not read again, one whose zigzags the current code has found is not
    searched again, a set that is there is not identified again.

    Parameters
    ----------
    vessels : sequence of str
        Their logs and sets are held in memory together until they are stored: some, not a fleet.
    request : Request, optional
        Only this model and estimator; by default every one that a vessel was identified with before.
    changed_only : bool, optional
        False also builds every kept set again from the raw bytes and counts the verdicts.

    Returns
    -------
    list of VesselReport
        One a vessel, in the order given. Failures are in them: one bad log stops nothing, one bad vessel no other.
    """
    job = _Reprocessing(warehouse, request, flow_run, progress)
    works = {vessel: _Work(VesselReport(vessel), PendingSets(warehouse, vessel)) for vessel in vessels}
    all_of_them = list(works.values())

    def begin() -> None:
        for vessel, state in fleet_state(warehouse, vessels).items():
            works[vessel].before = state

    def read() -> None:
        stale = {w.vessel: w.stale for w in _going(all_of_them) if w.stale is not None}
        for vessel, refreshed in refresh_all(warehouse, stale, progress).items():
            works[vessel].refreshed = refreshed

    _together(all_of_them, begin)
    _each(all_of_them, job.look)
    _together(all_of_them, read)
    try:
        _each(all_of_them, job.identify)
    finally:  # also where it is interrupted: what was identified need not be so again
        new = {vessel: work.new for vessel, work in works.items()}
        for vessel, error in together_or_each(new, partial(store, warehouse)).items():
            works[vessel].report.new_sets -= len(new[vessel].sets)
            works[vessel].stop(error)
    _each(all_of_them, job.finish)
    if not changed_only:
        _each(all_of_them, lambda work: _verify(warehouse, work.vessel, work.report))
    if request is None:
        _together(all_of_them, lambda: _leave(warehouse, _going(all_of_them)))
    estimator = request.estimator if request else None
    runs = [(w.report, w.report.as_run(w.left, changed_only=changed_only, estimator=estimator)) for w in all_of_them]
    _together(all_of_them, lambda: remember_all(warehouse, runs))
    _together(all_of_them, lambda: remember_history(warehouse, [w.report for w in all_of_them], flow_run))
    for report in (work.report for work in all_of_them):
        _log.info(
            "%s: %s; %d logs, %d read anew; %d manoeuvres to fit; %d sets made, %d kept; %d failures, %d findings",
            *(report.vessel, report.status, report.logs, report.reread, report.segments, report.new_sets),
            *(report.kept_sets, len(report.failures), len(report.findings)),
        )
    return [work.report for work in all_of_them]


@dataclass
class _Work:
    """What is known of one vessel while she is brought up to date."""

    report: VesselReport
    new: PendingSets
    before: VesselState | None = None
    requests: Sequence[Request] = ()
    stale: Stale | None = None
    refreshed: Refreshed | None = None
    #: Digest of the state in which nothing is left to do.
    left: str | None = None
    #: Whether something failed after which there is nothing more to do for her.
    over: bool = False

    @property
    def vessel(self) -> str:
        return self.report.vessel

    def stop(self, error: Exception) -> None:
        """Write a failure down after which the others go on without her."""
        self.report.fail(self.vessel, wrapped(error))
        self.over = True


def _going(works: Iterable[_Work]) -> list[_Work]:
    return [work for work in works if not work.over]


def _each(works: Iterable[_Work], step: Callable[[_Work], None]) -> None:
    """Take a step for every vessel; where it fails the others go on."""
    for work in _going(works):
        try:
            step(work)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is reported and the fleet goes on
            work.stop(error)


def _together(works: Sequence[_Work], step: Callable[[], None]) -> None:
    """Take a step for all vessels at once; where it fails it has failed for each."""
    try:
        step()
    except Exception as error:  # noqa: BLE001 - whatever it is, it is reported
        for work in _going(works):
            work.stop(error)


@dataclass(frozen=True)
class _Reprocessing:
    """What is the same for every vessel."""

    warehouse: Warehouse
    request: Request | None
    flow_run: str | None
    progress: Progress

    def look(self, work: _Work) -> None:
        """See what there is to do."""
        work.requests = _requests(self.warehouse, work.vessel, self.request)
        work.stale = stale_logs(self.warehouse, work.vessel)

    def identify(self, work: _Work) -> None:
        """Identify what is not identified yet, every segment and all of them together."""
        report, refreshed = work.report, work.refreshed
        assert refreshed is not None and work.stale is not None
        names = {row.ingest_id: row.file_name for row in work.stale.rows}
        report.logs, report.reread, report.searched = refreshed.logs, refreshed.reread, refreshed.searched
        for ingest, error in refreshed.failed.items():
            report.fail(names[ingest], error)
        report.segments = len(segments.current(self.warehouse, work.vessel))
        for request in work.requests if report.segments else ():
            outcomes = identify_segments(
                self.warehouse,
                work.vessel,
                request,
                refreshed,
                work.new,
                adopt=False,
                flow_run=self.flow_run,
                progress=self.progress,
            )
            for outcome in outcomes:
                if outcome.error is not None and outcome.segment.ingest_id not in refreshed.failed:
                    report.fail(outcome.segment.segment_id, outcome.error)
                report.new_sets += outcome.new
                report.kept_sets += outcome.set_id is not None and not outcome.new
            self._pool(work, request, outcomes)

    def _pool(self, work: _Work, request: Request, outcomes: list[IdentifyOutcome]) -> None:
        """Pool what was identified; that segments have nothing in common is no failure of the separate ones."""
        try:
            pooled = pool_segments(
                self.warehouse,
                work.vessel,
                request,
                outcomes,
                work.new,
                adopt=False,
                flow_run=self.flow_run,
                progress=self.progress,
            )
        except KempfError as error:
            work.report.fail(POOLED, error)
            return
        if pooled is not None:
            work.report.new_sets += pooled[1]
            work.report.kept_sets += not pooled[1]

    def finish(self, work: _Work) -> None:
        """Bring up to date what rests on the sets that are stored now."""
        if work.report.segments and self.request is None:
            self._model(work)
        assert work.before is not None
        now = _withdraw(self.warehouse, work.vessel, work.report)
        if now != dict(work.before.aliases).get(aliases.CURRENT):
            work.report.current = now
        work.report.findings = [finding.as_json() for finding in quality_of(self.warehouse, work.vessel)]

    def _model(self, work: _Work) -> None:
        """Bring her current model with effects up to date, or that withdrawn; where that fails it stays as it was."""
        try:
            now = standing_or_withdrawn(self.warehouse, work.vessel)
        except NotFound:
            work.report.fail(aliases.CURRENT, _model_lost(self.warehouse, work.vessel))
            return
        if now is None:
            return
        spec, own = model_of(now)
        if any(request.estimator == SINGLE and request.spec == spec for request in work.requests):
            # identified and pooled just now
            return
        try:
            chosen = choose(self.warehouse, work.vessel, out_of_date(work.refreshed) if work.refreshed else {})
            parameter_set, new = store_up_to_date(self.warehouse, chosen, spec, own, self.progress, self.flow_run)
        except KempfError as error:
            work.report.fail(aliases.CURRENT, error)
            return
        point(self.warehouse, parameter_set)
        work.report.new_sets += new
        work.report.kept_sets += not new


def _leave(warehouse: Warehouse, works: Sequence[_Work]) -> None:
    """Note the digest of the state in which nothing is left to do, where that is sure.

    Not sure: a failure that another attempt may overcome; a log, a profile or a set that somebody else added meanwhile.
    """
    sure = [work for work in works if all(failure["lasting"] for failure in work.report.failures)]
    after = fleet_state(warehouse, [work.vessel for work in sure]) if sure else {}
    for work in sure:
        assert work.before is not None
        now = after[work.vessel]
        new_sets = len(set(now.set_ids) - set(work.before.set_ids))
        if now.inputs == work.before.inputs and new_sets == work.report.new_sets:
            work.left = now.digest


def _requests(warehouse: Warehouse, vessel: str, default: Request | None) -> list[Request]:
    """Return every model and estimator that the vessel was ever identified with: all of them are kept up to date."""
    if default is not None:
        return [default]
    requests: dict[str, Request] = {}
    models = parameter_sets.models(warehouse, vessel)
    for spec, estimator, own in models:
        # a pooled set comes of the separate ones, one with effects is a model of all runs at once, and of an estimator
        # that an earlier version had the sets stay as they are
        if estimator not in NAMES:
            continue
        request = Request(ModelSpec.model_validate(spec), estimator, own=Own.from_json(own))
        requests.setdefault(f"{request.spec.sha256} {request.estimator}", request)
    return [requests[key] for key in sorted(requests)] if models else [Request(_first_model(warehouse, vessel))]


def _first_model(warehouse: Warehouse, vessel: str) -> ModelSpec:
    """Return the model of a vessel without sets: that which she had under an earlier name, but for its effects."""
    name = aliases.of_model(aliases.of_vessel(warehouse, vessel))
    try:
        stored = parameter_sets.stored_anywhere(warehouse, name, vessel) if name else None
    except NotFound:
        stored = None
    if stored is None:
        return default_model_of(warehouse, vessel)
    return ModelSpec.model_validate({**stored.model_spec, "effects": ()})


def _withdraw(warehouse: Warehouse, vessel: str, report: VesselReport) -> str | None:
    """Withdraw ``current`` where its set is of a profile or code that no longer stands; return where it points now."""
    pointed = aliases.of_vessel(warehouse, vessel).get(aliases.CURRENT)
    if pointed is None or pointed in standing_ids(warehouse, vessel):
        return pointed
    aliases.withdraw(warehouse, vessel)
    report.withdrawn = pointed
    return None


def _model_lost(warehouse: Warehouse, vessel: str) -> KempfError:
    name = aliases.of_model(aliases.of_vessel(warehouse, vessel))
    return NotFound(
        "model_lost",
        f"The current parameter set of {vessel!r}, {name}, is not in the warehouse any more, and which effects its "
        "model had is not known without it.",
        f"Choose another set with `kempf params alias current ID --vessel {quote(vessel)}`, or make the plain model "
        f"current with `kempf identify --vessel {quote(vessel)}` and add its effects with `kempf effects add`.",
        {"vessel": vessel, "parameter_set_id": name},
    )


def _verify(warehouse: Warehouse, vessel: str, report: VesselReport) -> None:
    code = code_of(warehouse, "estimate")
    for stored in parameter_sets.all_as_stored(warehouse, vessel):
        if stored.provenance["code_version"] != code:
            continue
        try:
            verdict = rerun_alone(warehouse, stored).verdict
        except KempfError as error:
            report.fail(stored.parameter_set_id, error)
            continue
        report.verified[verdict] = report.verified.get(verdict, 0) + 1
