"""The Prefect flows: ``ingest``, ``identify``, ``reprocess``, ``diagnose``. Few fat tasks; all leave a table artifact.

The work is in the jobs beside this file; here it is only put into batches, retried and reported.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import UUID

from kempf.flows.fleet.engine import task_runner, workers  # isort: skip - before Prefect, which reads its settings once

from prefect import flow, get_run_logger, task
from prefect.artifacts import (
    create_markdown_artifact,
    create_progress_artifact,
    create_table_artifact,
    update_progress_artifact,
)
from prefect.client.schemas.objects import State
from prefect.futures import as_completed
from prefect.runtime import flow_run
from prefect.states import Completed, Failed

from kempf.flows.fleet import arrivals, plan
from kempf.flows.fleet import report as fleet_report
from kempf.flows.fleet.diagnosis_summary import summary
from kempf.flows.fleet.hooks import HOOKS
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.identify.pool_vessel import not_pooled, pool_vessel
from kempf.flows.jobs.inbox.take_inbox import InboxRun, NeedsAPerson, take_inbox
from kempf.flows.jobs.ingest import ingest_logs
from kempf.flows.jobs.ingest.files import logs_in, read_profiles, read_quality
from kempf.flows.jobs.reprocess.vessel_report import VesselReport
from kempf.flows.jobs.state.vessel_state import responsible_code
from kempf.flows.process.configuration import setting
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.schemas.instants import iso_utc
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.quality import NO_LIMITS
from kempf.warehouse.sources.source_folder import SourceFolder
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels as vessel_table
from kempf.warehouse.tables.parameter_set import ParameterSet


@task(name="ingest-batch", retries=1, retry_delay_seconds=5)
def ingest_batch(warehouse: str, paths: list[str], vessel: str | None, profiles: list[str]) -> list[dict[str, Any]]:
    """Take a batch of logs in."""
    logs, beside = logs_in([Path(p) for p in paths])
    files = [Path(p) for p in profiles] or list(beside)
    profile = read_profiles(files) if files else None
    outcomes = ingest_logs.ingest(Warehouse(warehouse), logs, vessel, profile)
    return [outcome.as_json() for outcome in outcomes]


@task(name="take-inbox", retries=1, retry_delay_seconds=5)
def inbox_task(warehouse: str, folder: str) -> InboxRun:
    """Ingest what is new in an inbox."""
    log = get_run_logger()
    run = take_inbox(
        Warehouse(warehouse),
        SourceFolder(folder),
        lambda done, of, what: log.info("%s, %d of %d", what, done, of),
    )
    for file in run.quarantined:
        log.warning("quarantined: %s: %s %s", file.address, file.message, file.next_step)
    for file in run.removed:
        log.warning("removed before: %s: %s %s", file.address, file.message, file.next_step)
    for remark in run.remarks:
        log.warning("%s: %s", run.address, remark)
    return run


@flow(name="ingest", **HOOKS)
def ingest(
    paths: list[str], warehouse: str = "kempf-data", vessel: str | None = None, profiles: Sequence[str] = ()
) -> list[dict[str, Any]] | State[Any]:
    """Take raw logs in: those of one vessel, or what is new in inboxes. Ends as Failed where a log did not get in.

    Parameters
    ----------
    paths : list of str
        Raw logs and folders of them; where neither a vessel nor a profile is given, inboxes.
    warehouse : str, optional
        Its address.
    vessel : str, optional
        Whose they are; else the profile says so.
    profiles : sequence of str, optional
        Profile files.

    Returns
    -------
    list of dict or State
        One outcome a log; where the run ends as Failed a caller gets the error, `arrivals.LogsFailed` or
        `kempf.flows.jobs.inbox.take_inbox.NeedsAPerson`, which has them too.
    """
    if vessel is None and not profiles:
        runs = [inbox_task(warehouse, folder) for folder in paths]
        outcomes = [outcome.as_json() for run in runs for outcome in run.ingested]
        others = [file for run in runs for file in (*run.removed, *run.quarantined)]
        _show_logs(outcomes + [arrivals.not_ingested(file) for file in others])
        waiting = [run for run in runs if run.quarantined]
        if waiting:
            errors = [NeedsAPerson(run) for run in waiting]
            return Failed(message=" ".join(error.message for error in errors), data=errors[0])
        said = [arrivals.sentence(outcomes), *(remark for run in runs for remark in run.remarks)]
        return Completed(message=". ".join(said), data=outcomes)
    outcomes = ingest_batch(warehouse, paths, vessel, list(profiles))
    _show_logs(outcomes)
    failed = [outcome for outcome in outcomes if "error" in outcome]
    if failed:
        error = arrivals.LogsFailed(outcomes)
        return Failed(message=error.message, data=error)
    return Completed(message=arrivals.sentence(outcomes), data=outcomes)


def _show_logs(outcomes: Sequence[dict[str, Any]]) -> None:
    create_table_artifact(key="kempf-ingest", table=arrivals.table(outcomes), description="Logs taken in")


@task(name="identify-vessel", retries=1, retry_delay_seconds=5)
def identify_task(warehouse: str, vessel: str, estimator: str, spec: dict[str, Any]) -> list[dict[str, Any]]:
    """Identify every manoeuvre of one vessel."""
    request = Request(_model(warehouse, vessel, spec), estimator)
    run = flow_run.get_id()
    run_id = str(run) if run else None
    outcomes = identify_vessel(Warehouse(warehouse), vessel, request, flow_run=run_id)
    pooled: ParameterSet | KempfError | None
    try:
        result = pool_vessel(Warehouse(warehouse), vessel, request, outcomes, flow_run=run_id)
        pooled = result[0] if result else None
    except KempfError as error:
        # that zigzags have nothing in common is no failure of the separate sets
        pooled = error
    alone = not_pooled(Warehouse(warehouse), vessel, request, outcomes, pooled)
    return [
        {
            "segment": o.segment.segment_id,
            "start": iso_utc(o.segment.start_utc_ns),
            "parameter_set": o.parameter_set.parameter_set_id if o.parameter_set else None,
            "converged": bool(o.parameter_set and o.parameter_set.convergence.get("converged")),
            "error": o.error.message if o.error else "",
            "not_pooled": alone.get(o.segment.segment_id, ""),
        }
        for o in outcomes
    ]


@flow(name="identify", **HOOKS)
def identify(
    vessel: str, warehouse: str = "kempf-data", estimator: str = "ml", spec: dict[str, Any] | None = None
) -> list[dict[str, Any]]:
    """Identify a model from every zigzag of one vessel.

    Parameters
    ----------
    vessel : str
        Her name.
    warehouse : str, optional
        Its address.
    estimator : str, optional
        One of `kempf.pipeline.estimate.names.NAMES`.
    spec : dict, optional
        Model specification; by default the plain one, or that of her surroundings.
    """
    rows = identify_task(warehouse, vessel, estimator, spec or {})
    create_table_artifact(key="kempf-identify", table=rows, description=vessel)
    return rows


def _model(warehouse: str, vessel: str, spec: dict[str, Any]) -> ModelSpec:
    """Return the model that is asked for, where none is that of the vessel's surroundings."""
    return ModelSpec.model_validate(spec) if spec else default_model_of(Warehouse(warehouse), vessel)


def _names(warehouse: str, vessels: Sequence[str] | None) -> list[str]:
    """Return the vessels asked for, or all of a warehouse that must be there; sorted."""
    store = Warehouse(warehouse)
    store.require()
    return sorted(set(vessels)) if vessels else vessel_table.names(store)


@task(name="reprocess-batch", retries=1, retry_delay_seconds=5, persist_result=False, result_serializer="json")
def reprocess_batch(
    warehouse: str, vessels: list[str], changed_only: bool, run: str | None, code: list[str] | None = None
) -> list[dict[str, Any]]:
    """Bring a batch of vessels up to date; a vessel that fails is reported, the others are done."""
    log = get_run_logger()

    def done(report: VesselReport) -> None:
        log.info("%s: %s", report.vessel, report.status)
        for failure in report.failures:
            log.warning("%s, %s: %s", report.vessel, failure["what"], failure["error"]["message"])
        for finding in report.findings:
            log.warning("%s: %s", report.vessel, finding["words"])

    return plan.do_batch(
        Warehouse(warehouse),
        vessels,
        changed_only=changed_only,
        flow_run=run,
        code=code,
        progress=done,
    )


@dataclass(frozen=True)
class _Run:
    """What is the same for every batch of one run."""

    warehouse: str
    changed_only: bool
    run: str | None

    def do(self, batches: Sequence[list[str]], progress: Callable[[int], None]) -> list[dict[str, Any]]:
        """Run batches as tasks, report how many vessels are done; those of a lost batch are reported as failed."""
        code = responsible_code()
        futures: dict[Any, list[str]] = {
            reprocess_batch.submit(self.warehouse, batch, self.changed_only, self.run, code): batch for batch in batches
        }
        reports: list[dict[str, Any]] = []
        for future in as_completed(list(futures)):
            try:
                reports += future.result()
            except Exception as error:  # noqa: BLE001 - a worker that died must not take the others' work with it
                reports += plan.lost(futures[future], error)
            progress(len(reports))
        return reports


@flow(name="reprocess", task_runner=task_runner(), persist_result=False, result_serializer="json", **HOOKS)
def reprocess(
    warehouse: str = "kempf-data",
    vessels: list[str] | None = None,
    changed_only: bool = True,
    quality: str | None = None,
) -> list[dict[str, Any]] | State[Any]:
    """Bring the fleet up to date with its profiles and the code.

    Vessels whose inputs did not change since their last run are not looked at again. The run ends as Failed where a
    vessel failed in a way that is new, or that another attempt may overcome; all others are done all the same. Failures
    that the run before reported already, of data that are refused, leave it Completed. It ends as Failed, too, for as
    long as a vessel has more findings on her logs and models than a file of limits allows.

    Parameters
    ----------
    warehouse : str, optional
        Its address.
    vessels : list of str, optional
        Only these; the whole fleet by default.
    changed_only : bool, optional
        False also verifies every kept parameter set from the raw bytes.
    quality : str, optional
        File of limits, `kempf.schemas.quality.FleetLimits`; without one any number of findings is allowed.

    Returns
    -------
    list of dict or State
        One report a vessel, sorted by name; where the run ends as Failed a caller gets the error
        `kempf.flows.fleet.report.VesselsFailed`, which has them too.
    """
    run_id = flow_run.get_id()
    limits = read_quality(Path(quality)) if quality else NO_LIMITS
    run = _Run(warehouse, changed_only, str(run_id) if run_id else None)
    todo = plan.plan(Warehouse(warehouse), vessels, changed_only=changed_only)
    get_run_logger().info("%d vessels, %d with something to do", todo.vessels, len(todo.due))
    shown = create_progress_artifact(_percent_done(len(todo.kept), todo.vessels), "kempf-progress", _PROGRESS)
    assert isinstance(shown, UUID)  # it is a coroutine only where a loop runs

    def progress(done: int) -> None:
        update_progress_artifact(shown, _percent_done(len(todo.kept) + done, todo.vessels))

    reports = {report["vessel"]: report for report in todo.kept}
    if todo.due:
        reports |= {report["vessel"]: report for report in run.do(todo.batches(workers()), progress)}
    # each alone: a vessel that takes her worker down takes no other with her
    for report in run.do([[name] for name in plan.to_try_again(reports.values())], lambda done: None):
        reports[report["vessel"]] = plan.together(reports[report["vessel"]], report)
    ordered = [reports[name] for name in sorted(reports)]
    sentence = fleet_report.sentence(ordered, limits)
    create_table_artifact(key="kempf-reprocess", table=fleet_report.table(ordered), description=sentence)
    page = fleet_report.markdown(ordered, limits, setting("workbench.url"))
    create_markdown_artifact(key="kempf-fleet", markdown=page, description=sentence)
    if any(fleet_report.needs_a_person(report, limits) for report in ordered):
        return Failed(message=sentence, data=fleet_report.VesselsFailed(ordered, limits))
    return Completed(message=sentence, data=ordered)


def reports_of(
    warehouse: str, vessels: list[str] | None = None, *, changed_only: bool = True, quality: str | None = None
) -> list[dict[str, Any]]:
    """Run the flow `reprocess` and return its reports, whichever way it ended."""
    state = reprocess(warehouse, vessels, changed_only, quality, return_state=True)
    result: Any = state.result(raise_on_failure=False)
    if isinstance(result, fleet_report.VesselsFailed):
        result = result.details["reports"]
    if isinstance(result, Exception):
        raise result
    reports: list[dict[str, Any]] = result
    return reports


_PROGRESS = "Vessels that are up to date, percent"


def _percent_done(done: int, total: int) -> float:
    return 100.0 * done / total if total else 100.0


@task(name="diagnose-batch", retries=1, retry_delay_seconds=5)
def diagnose_batch(warehouse: str, vessels: Sequence[str], spec: dict[str, Any]) -> list[dict[str, Any]]:
    """Diagnose vessels one after the other, each on all cores; one that fails is reported, the others are done."""
    documents = []
    for vessel in vessels:
        try:
            diagnosis, _ = diagnose_vessel(Warehouse(warehouse), vessel, _model(warehouse, vessel, spec))
            documents.append(diagnosis.as_json())
        except Exception as error:  # noqa: BLE001 - whatever it is, the next vessel must not pay for it
            documents.append({"vessel": vessel, "verdict": "failed", "error": wrapped(error).as_json()["error"]})
        get_run_logger().info("%s: %s", vessel, documents[-1]["verdict"])
    return documents


@flow(name="diagnose", **HOOKS)
def diagnose(
    warehouse: str = "kempf-data", vessels: list[str] | None = None, spec: dict[str, Any] | None = None
) -> list[dict[str, Any]]:
    """Find what the models of the fleet lack.

    Parameters
    ----------
    warehouse : str, optional
        Its address.
    vessels : list of str, optional
        Only these; the whole fleet by default.
    spec : dict, optional
        Model to begin from; by default the plain one, or that of the vessel's surroundings.

    Returns
    -------
    list of dict
        One row an effect and vessel, see `kempf.flows.fleet.diagnosis_summary.summary`.
    """
    names = _names(warehouse, vessels)
    rows = summary(diagnose_batch(warehouse, names, spec or {}))
    create_table_artifact(key="kempf-diagnose", table=rows, description="What the models of the fleet lack")
    return rows
