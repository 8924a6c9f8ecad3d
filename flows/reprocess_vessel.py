"""The job that brings one vessel up to date: logs read anew, zigzags found anew, parameter sets identified."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from flows.identify_vessel import Request, identify_vessel
from flows.ingest_logs import ingest_bytes
from flows.progress import Progress, silent
from flows.rerun_set import rerun
from schemas.errors import KempfError
from warehouse import code_version, logs, parameter_sets, raw, runs, segments, vessels
from warehouse.store import Warehouse


@dataclass
class VesselReport:
    """What reprocessing did for one vessel.

    Attributes
    ----------
    vessel : str
    logs, reread, segments, new_sets, kept_sets : int
        Logs in all, logs read anew, zigzags found, parameter sets made and kept.
    verified : dict of str to int
        Verdicts on the kept sets, where everything was asked for.
    failures : list of dict
        What failed, each with the error's JSON; the rest was done all the same.
    """

    vessel: str
    logs: int = 0
    reread: int = 0
    segments: int = 0
    new_sets: int = 0
    kept_sets: int = 0
    verified: dict[str, int] = field(default_factory=dict)
    failures: list[dict[str, Any]] = field(default_factory=list)

    @property
    def status(self) -> str:
        """``failed`` where something did, else ``changed`` or ``unchanged``."""
        if self.failures:
            return "failed"
        return "changed" if self.reread or self.new_sets else "unchanged"

    def show(self) -> dict[str, Any]:
        """Return the report as JSON content."""
        return {"vessel": self.vessel, "status": self.status, **{k: v for k, v in vars(self).items() if k != "vessel"}}

    def fail(self, what: str, error: KempfError) -> None:
        """Write down a failure and go on."""
        self.failures.append({"what": what, **error.to_json()})


def reprocess_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request = Request(),  # noqa: B008 - frozen
    *,
    changed_only: bool = True,
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
    changed_only : bool, optional
        False also builds every kept set again from the raw bytes and counts the verdicts.
    flow_run : str, optional
    progress : Progress, optional

    Returns
    -------
    VesselReport
        Failures are in it; one bad log stops nothing.
    """
    report = VesselReport(vessel)
    try:
        _read_anew(warehouse, vessel, report, progress)
        report.segments = len(segments.current(warehouse, vessel))
        if report.segments:
            outcomes = identify_vessel(warehouse, vessel, request, flow_run=flow_run, progress=progress)
            for outcome in outcomes:
                if outcome.error is not None:
                    report.fail(outcome.segment.segment_id, outcome.error)
                report.new_sets += outcome.new
                report.kept_sets += outcome.parameter_set is not None and not outcome.new
        if not changed_only:
            _verify(warehouse, vessel, report)
    except KempfError as error:
        report.fail(vessel, error)
    counts = {k: v for k, v in vars(report).items() if isinstance(v, int)}
    inputs = {"vessel": vessel, "changed_only": changed_only, "estimator": request.estimator}
    runs.record(
        warehouse,
        runs.Run(
            runs.run_id("reprocess", inputs), "reprocess", vessel, report.status, counts, {"failures": report.failures}
        ),
    )
    return report


def _read_anew(warehouse: Warehouse, vessel: str, report: VesselReport, progress: Progress) -> None:
    profile = vessels.current(warehouse, vessel)
    hers, code = logs.current(warehouse, vessel), code_version.fingerprint()
    report.logs = len(hers)
    for done, row in enumerate(hers):
        if (row.profile_sha256, row.code_version) == (profile.sha256, code):
            continue
        progress(done, len(hers), f"reading {row.file_name}")
        try:
            data = raw.get(warehouse, row.log_id)
            ingest_bytes(warehouse, vessel, row.file_name, data, profile, row.file_name)
            report.reread += 1
        except KempfError as error:
            report.fail(row.file_name, error)


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
