"""What reprocessing did for one vessel, as it is reported and as it is remembered for the next time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from kempf.schemas.errors import DataRejected, KempfError
from kempf.warehouse.storage import append_only
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs
from kempf.warehouse.tables.runs import FlowRun

#: Codes of errors that come of the storage and may be gone at the next attempt.
PASSING = ("warehouse_unreachable", "warehouse_busy", "warehouse_not_writable", "table_unreadable", "batch_lost")
FLOW = "reprocess"


@dataclass
class VesselReport:
    """What reprocessing did for one vessel."""

    vessel: str
    #: logs, reread, searched, segments, new_sets, kept_sets: Logs in all, logs read anew, logs of the others in which
    #: manoeuvres were looked for anew, manoeuvres found, parameter sets made and kept.
    logs: int = 0
    reread: int = 0
    searched: int = 0
    segments: int = 0
    new_sets: int = 0
    kept_sets: int = 0
    #: Verdicts on the kept sets, where everything was asked for.
    verified: dict[str, int] = field(default_factory=dict)
    #: Parameter set that ``current`` pointed to, where it no longer stands and nothing took its place.
    withdrawn: str | None = None
    #: Parameter set that ``current`` points to now, where it pointed to another one, or to none, before.
    current: str | None = None
    #: What failed, each with the error's JSON; the rest was done all the same. ``lasting`` says that the data were
    #: refused, so that the same data are refused again; ``known`` that the run before reported it already.
    failures: list[dict[str, Any]] = field(default_factory=list)
    #: What is wrong with her logs and models as they are stored now, `vessel_quality.Finding.as_json`.
    findings: list[dict[str, Any]] = field(default_factory=list)

    @property
    def status(self) -> str:
        """``failed`` where something did, else ``changed`` or ``unchanged``."""
        if self.failures:
            return "failed"
        changed = self.reread or self.searched or self.new_sets or self.current or self.withdrawn
        return "changed" if changed else "unchanged"

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON content."""
        return {"vessel": self.vessel, "status": self.status, **{k: v for k, v in vars(self).items() if k != "vessel"}}

    def fail(self, what: str, error: KempfError) -> None:
        """Write down a failure and go on."""
        lasting = isinstance(error, DataRejected)
        self.failures.append({"what": what, "lasting": lasting, "known": False, **error.as_json()})

    def as_run(self, state: str | None, *, changed_only: bool, estimator: str | None) -> FlowRun:
        """Return the line of the table ``runs``.

        Parameters
        ----------
        state : str or None
            Digest of the state that the vessel was left in, where nothing is left to do in it.
        estimator : str or None
            What was asked for; both are part of the run's id.
        """
        counts = {k: v for k, v in vars(self).items() if isinstance(v, int)}
        message = {"failures": self.failures, "findings": self.findings, **({"state": state} if state else {})}
        return FlowRun(
            run_id_of(self.vessel, changed_only=changed_only, estimator=estimator),
            FLOW,
            self.vessel,
            self.status,
            counts,
            message,
        )


def run_id_of(vessel: str, *, changed_only: bool, estimator: str | None = None) -> str:
    """Return the id under which the reprocessing of a vessel is remembered."""
    return runs.run_id(FLOW, {"vessel": vessel, "changed_only": changed_only, "estimator": estimator})


def remember_all(warehouse: Warehouse, pairs: Sequence[tuple[VesselReport, FlowRun]]) -> None:
    """Store runs in one commit; failures that stood there before are marked as known in the reports and in the runs.

    Parameters
    ----------
    pairs : sequence of (VesselReport, FlowRun)
        Each with the run of its `VesselReport.as_run`.
    """
    every = [
        run_id_of(report.vessel, changed_only=changed_only) for report, _ in pairs for changed_only in (True, False)
    ]
    stored = {run.run_id: run for run in runs.some(warehouse, [*every, *(run.run_id for _, run in pairs)])}
    entries = []
    for report, run in pairs:
        before = {_what(f) for f in stored[run.run_id].message["failures"]} if run.run_id in stored else set()
        for failure in report.failures:
            failure["known"] = _what(failure) in before
        entries.append(replace(run, message={**run.message, "failures": report.failures}))
        entries += _forgotten(run, stored)
    runs.record_all(warehouse, entries)


def remember_history(warehouse: Warehouse, reports: Sequence[VesselReport], flow_run: str | None) -> None:
    """Add what was done for vessels to the history of runs, in one commit; those who had nothing to do are left out."""
    rows = [
        {
            "flow": FLOW,
            "flow_run": flow_run,
            "vessel": report.vessel,
            "status": report.status,
            "new_sets": report.new_sets,
            "kept_sets": report.kept_sets,
            "reread": report.reread,
            "failures": len(report.failures),
            "findings": len(report.findings),
            "first_failure": report.failures[0]["error"]["message"] if report.failures else None,
        }
        for report in reports
        if report.status != "unchanged"
    ]
    if rows:
        append_only.add(warehouse, "run_history", *rows)


def _forgotten(run: FlowRun, stored: Mapping[str, FlowRun]) -> list[FlowRun]:
    """Return the runs of the same vessel whose state no longer says that nothing is left to do."""
    if "state" in run.message:
        return []
    names = [run_id_of(str(run.vessel), changed_only=changed_only) for changed_only in (True, False)]
    stale = [stored[name] for name in names if name in stored and name != run.run_id]
    return [
        replace(stale_run, message={k: v for k, v in stale_run.message.items() if k != "state"})
        for stale_run in stale
        if "state" in stale_run.message
    ]


def from_run(run: FlowRun) -> VesselReport:
    """Return the report of a vessel that has nothing to do, from what her last run left.

    Parameters
    ----------
    run : FlowRun
        Its failures are all lasting.
    """
    counts = run.counts
    return VesselReport(
        str(run.vessel),
        logs=counts["logs"],
        segments=counts["segments"],
        kept_sets=counts["new_sets"] + counts["kept_sets"],
        failures=[{**failure, "known": True} for failure in run.message["failures"]],
        findings=list(run.message.get("findings", ())),
    )


def _what(failure: Mapping[str, Any]) -> tuple[str, str]:
    return str(failure["what"]), str(failure["error"]["code"])
