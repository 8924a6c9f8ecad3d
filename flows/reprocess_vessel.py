"""The job that brings one vessel up to date: logs read anew, zigzags found anew, parameter sets identified."""

from __future__ import annotations

from flows.fleet_state import VesselState, fleet_state
from flows.identify_vessel import IdentifyOutcome, Request, identify_vessel
from flows.pool_vessel import POOLED, pool_vessel
from flows.progress import Progress, silent
from flows.refresh_logs import refresh_logs
from flows.rerun_set import rerun
from flows.unforeseen import as_told
from flows.vessel_model import ALIAS, ESTIMATOR, model_of, point, standing, store_model
from flows.vessel_report import VesselReport, remember
from flows.vessel_runs import choose
from schemas.errors import KempfError
from schemas.model_spec import ModelSpec
from warehouse import aliases, code_version, logs, parameter_sets, segments
from warehouse.store import Warehouse


def reprocess_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request | None = None,
    *,
    changed_only: bool = True,
    before: VesselState | None = None,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> VesselReport:
    """Bring one vessel up to date with her profile and the code.

    A log read with the current profile and code is not read again, a set that is there is not identified again.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    request : Request, optional
        Only this model and estimator; by default every one that she was identified with before.
    changed_only : bool, optional
        False also builds every kept set again from the raw bytes and counts the verdicts.
    before : VesselState, optional
        Her state where the caller has just read it; else it is read here.
    flow_run : str, optional
    progress : Progress, optional

    Returns
    -------
    VesselReport
        Failures are in it; one bad log stops nothing.
    """
    report, left = VesselReport(vessel), None
    try:
        before = before or fleet_state(warehouse, [vessel])[vessel]
        _bring_up_to_date(warehouse, vessel, request, report, flow_run, progress)
        if not changed_only:
            _verify(warehouse, vessel, report)
        if request is None:
            left = _left(warehouse, before, report)
    except Exception as error:  # noqa: BLE001 - whatever it is, it is reported and the fleet goes on
        report.fail(vessel, as_told(error))
    estimator = request.estimator if request else None
    remember(warehouse, report, report.as_run(left, changed_only=changed_only, estimator=estimator))
    return report


def _bring_up_to_date(
    warehouse: Warehouse,
    vessel: str,
    request: Request | None,
    report: VesselReport,
    flow_run: str | None,
    progress: Progress,
) -> None:
    requests = _requests(warehouse, vessel, request)
    names = {row.ingest_id: row.file_name for row in logs.current(warehouse, vessel)}
    refreshed = refresh_logs(warehouse, vessel, progress)
    report.logs, report.reread = refreshed.logs, refreshed.reread
    for ingest, error in refreshed.failed.items():
        report.fail(names.get(ingest, ingest), error)  # another process may have added it in between
    report.segments = len(segments.current(warehouse, vessel))
    for one in requests if report.segments else ():
        outcomes = identify_vessel(
            warehouse, vessel, one, refreshed=refreshed, adopt=False, flow_run=flow_run, progress=progress
        )
        for outcome in outcomes:
            if outcome.error is not None and outcome.segment.ingest_id not in refreshed.failed:
                report.fail(outcome.segment.segment_id, outcome.error)
            report.new_sets += outcome.new
            report.kept_sets += outcome.parameter_set is not None and not outcome.new
        _pool(warehouse, vessel, one, outcomes, report, flow_run, progress)
    if report.segments and request is None:
        _model(warehouse, vessel, report, flow_run, progress)
    _withdraw(warehouse, vessel, report)


def _left(warehouse: Warehouse, before: VesselState, report: VesselReport) -> str | None:
    """Return the digest of the state in which nothing is left to do, None where that is not sure.

    Not sure: a failure that another attempt may mend; a log, a profile or a set that somebody else added meanwhile.
    """
    if not all(failure["lasting"] for failure in report.failures):
        return None
    after = fleet_state(warehouse, [report.vessel])[report.vessel]
    made = len(set(after.set_ids) - set(before.set_ids))
    return after.digest if after.inputs == before.inputs and made == report.new_sets else None


def _requests(warehouse: Warehouse, vessel: str, default: Request | None) -> list[Request]:
    """Return every model and estimator that the vessel was ever identified with: all of them are kept up to date."""
    if default is not None:
        return [default]
    asked: dict[str, Request] = {}
    known = parameter_sets.models(warehouse, vessel)
    for spec, estimator in known:
        if estimator in (POOLED, ESTIMATOR):
            continue  # the one comes of the separate ones, the other is a model of all runs at once
        request = Request(ModelSpec.model_validate(spec), estimator)
        asked.setdefault(f"{request.spec.sha256} {request.estimator}", request)
    return [asked[key] for key in sorted(asked)] if known else [Request()]


def _pool(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    outcomes: list[IdentifyOutcome],
    report: VesselReport,
    flow_run: str | None,
    progress: Progress,
) -> None:
    """Pool what was identified; that segments have nothing in common is no failure of the separate ones."""
    try:
        pooled = pool_vessel(warehouse, vessel, request, outcomes, flow_run=flow_run, progress=progress)
    except KempfError as error:
        report.fail(POOLED, error)
        return
    if pooled is not None:
        report.new_sets += pooled[1]
        report.kept_sets += not pooled[1]


def _model(warehouse: Warehouse, vessel: str, report: VesselReport, flow_run: str | None, progress: Progress) -> None:
    """Bring the model with effects that the vessel stands at up to date; where that fails she stands where she was."""
    now = standing(warehouse, vessel)
    if now is None:
        return
    spec, own = model_of(now)
    try:
        made, new = store_model(warehouse, choose(warehouse, vessel), spec, own, progress, flow_run)
    except KempfError as error:
        report.fail(ALIAS, error)
        return
    point(warehouse, made)
    report.new_sets += new
    report.kept_sets += not new


def _withdraw(warehouse: Warehouse, vessel: str, report: VesselReport) -> None:
    """Withdraw ``current`` where its set is of a profile or code that no longer stands."""
    pointed = aliases.of_vessel(warehouse, vessel).get(aliases.CURRENT)
    if pointed is None:
        return
    standing = {row.ingest_id for row in logs.current(warehouse, vessel)}
    if not standing.intersection(parameter_sets.get(warehouse, pointed).provenance["ingest_ids"]):
        aliases.withdraw(warehouse, vessel)
        report.withdrawn = pointed


def _verify(warehouse: Warehouse, vessel: str, report: VesselReport) -> None:
    code = code_version.fingerprint()
    for name in parameter_sets.summaries(warehouse, vessel)["parameter_set_id"].to_list():
        if parameter_sets.get(warehouse, name).provenance["code_version"] != code:
            continue
        try:
            verdict = rerun(warehouse, name).verdict
        except KempfError as error:
            report.fail(name, error)
            continue
        report.verified[verdict] = report.verified.get(verdict, 0) + 1
