"""Which vessels of a fleet have something to do, and how the work is cut into batches. Knows no engine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessels
from kempf.flows.jobs.reprocess.vessel_report import FLOW, PASSING, VesselReport, from_run, run_id_of
from kempf.flows.jobs.state.vessel_state import VesselState, fleet_state, responsible_code
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs
from kempf.warehouse.tables.runs import FlowRun

#: With so many logs a batch is full: a minute or two of work, beside which what an engine asks for a task and the
#: tables for a commit is small, and little enough that a lost worker costs no more and progress is seen.
LOGS_A_BATCH = 60
#: A batch takes this part of a worker's even share of what is left, so that the last ones are small and no worker waits
#: long for another; but it is never smaller than this part of the first.
OF_SHARE, OF_FIRST = 1 / 2, 1 / 4

Report = dict[str, Any]


@dataclass(frozen=True)
class Plan:
    """What a run over the fleet has to do."""

    #: Vessels that have something to do with the number of their logs, the heavier ones first.
    due: tuple[tuple[str, int], ...]
    #: Reports of the others.
    kept: tuple[Report, ...]

    @property
    def vessels(self) -> int:
        """How many vessels there are in all."""
        return len(self.due) + len(self.kept)

    def batches(self, workers: int) -> list[list[str]]:
        """Return the vessels that are due in batches, the heavier vessels first and the smaller batches last.

        Parameters
        ----------
        workers : int
            That will share them.

        References
        ----------
        Polychronopoulos, C. D. and Kuck, D. J. (1987): Guided self-scheduling: a practical scheduling scheme for
        parallel supercomputers. IEEE Transactions on Computers C-36(12), 1425-1439.
        """
        # a vessel without any log is looked at, too
        weights = [(name, max(logs, 1)) for name, logs in self.due]
        left = sum(weight for _, weight in weights)
        first = size = min(LOGS_A_BATCH, OF_SHARE * left / workers)
        batches: list[list[str]] = []
        batch: list[str] = []
        held = 0
        for name, weight in weights:
            batch.append(name)
            held += weight
            if held >= size:
                batches.append(batch)
                left -= held
                batch, held = [], 0
                size = max(min(LOGS_A_BATCH, OF_SHARE * left / workers), OF_FIRST * first)
        return [*batches, batch] if batch else batches


def plan(warehouse: Warehouse, names: Sequence[str] | None = None, *, changed_only: bool = True) -> Plan:
    """Say which vessels have something to do, and write down that the others have not.

    A vessel has nothing to do where her state is the one that her last run left, and nothing failed in it that another
    attempt may overcome.

    Parameters
    ----------
    names : sequence of str, optional
        Only these; the whole fleet by default.
    changed_only : bool, optional
        False: all of them have.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    states = fleet_state(warehouse, sorted(set(names)) if names else None)
    settled = _settled(warehouse, states) if changed_only else {}
    due = sorted((len(state.log_ids), name) for name, state in states.items() if name not in settled)
    reports = [from_run(run) for run in settled.values()]
    again = [report.as_run(states[report.vessel].digest, changed_only=True, estimator=None) for report in reports]
    runs.record_all(warehouse, again)
    return Plan(tuple((name, logs) for logs, name in reversed(due)), tuple(report.as_json() for report in reports))


def _settled(warehouse: Warehouse, states: Mapping[str, VesselState]) -> dict[str, FlowRun]:
    """Return the run that left each vessel in the state that she is in."""
    by_id = {run.run_id: run for run in runs.all_runs(warehouse, FLOW)}
    settled = {}
    for name, state in states.items():
        for changed_only in (True, False):
            run = by_id.get(run_id_of(name, changed_only=changed_only))
            if run is not None and run.message.get("state") == state.digest:
                settled[name] = run
                break
    return settled


def do_batch(
    warehouse: Warehouse,
    batch: Sequence[str],
    *,
    changed_only: bool,
    flow_run: str | None = None,
    code: Sequence[str] | None = None,
    progress: Callable[[VesselReport], None] = lambda report: None,
) -> list[Report]:
    """Bring a batch of vessels up to date, in common commits; one that fails is reported, the others are done.

    Parameters
    ----------
    code : sequence of str, optional
        `responsible_code` of the machine that asks; where it is not that of this one, nothing is done.
    progress : callable, optional
        Called with the report of every vessel once they are done.

    Returns
    -------
    list of dict
        One report a vessel.
    """
    try:
        _refuse_other_code(code)
        reports = reprocess_vessels(warehouse, batch, changed_only=changed_only, flow_run=flow_run)
    except Exception as error:  # noqa: BLE001 - whatever it is, the next batch must not pay for it
        reports = [VesselReport(vessel) for vessel in batch]
        for report in reports:
            report.fail(report.vessel, wrapped(error))
    for report in reports:
        progress(report)
    return [report.as_json() for report in reports]


def _refuse_other_code(code: Sequence[str] | None) -> None:
    """Do nothing unless another machine asks that runs other code: two versions would undo each other's work."""
    own = responsible_code()
    if code is not None and list(code) != own:
        raise KempfError(
            "other_code",
            f"This worker runs code {' '.join(own)}; the flow that asks runs {' '.join(code)}.",
            "Install the same version of kempf on every machine, and start the workers again.",
            {"worker": own, "flow": list(code)},
        )


def lost(batch: Sequence[str], error: BaseException) -> list[Report]:
    """Return the reports of a batch whose worker did not come back.

    Parameters
    ----------
    error : BaseException
        What the engine says.
    """
    reports = []
    for vessel in batch:
        report = VesselReport(vessel)
        failure = KempfError(
            "batch_lost",
            f"The worker that had {vessel!r} in a batch of {len(batch)} did not come back: {error}.",
            "Run it again; look at the worker's log, and at its memory.",
        )
        report.fail(vessel, failure)
        reports.append(report.as_json())
    return reports


def to_try_again(reports: Iterable[Report]) -> list[str]:
    """Return the vessels that failed in a way that may be gone at the next attempt, sorted."""
    return sorted(
        report["vessel"]
        for report in reports
        if any(failure["error"]["code"] in PASSING for failure in report["failures"])
    )


def together(first: Report, second: Report) -> Report:
    """Return the report of two attempts on one vessel: what both did, and what the second left."""
    sums = {key: first[key] + second[key] for key in ("new_sets", "reread", "searched")}
    kept = max(second["kept_sets"] - first["new_sets"], 0)
    current = second["current"] or first["current"]
    some = any(sums.values()) or current or first["withdrawn"]
    changed = "changed" if second["status"] == "unchanged" and some else second["status"]
    return {**second, "status": changed, "kept_sets": kept, "current": current, **sums}


def do_fleet(
    warehouse: Warehouse, names: Sequence[str] | None = None, *, changed_only: bool = True, progress: Progress = silent
) -> list[Report]:
    """Bring the fleet up to date in this process, a batch a thread and a thread a core; no engine, no server.

    Parameters
    ----------
    names : sequence of str, optional
        Only these; the whole fleet by default.
    changed_only : bool, optional
        False also verifies every kept parameter set from the raw bytes.
    progress : Progress, optional
        Called after every batch.

    Returns
    -------
    list of dict
        One report a vessel, sorted by name.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    todo = plan(warehouse, names, changed_only=changed_only)
    reports = {report["vessel"]: report for report in todo.kept}
    progress(len(reports), todo.vessels, "reprocessing")
    with ThreadPoolExecutor(max_workers=usable()) as pool:
        batches = todo.batches(usable())
        futures = [pool.submit(do_batch, warehouse, batch, changed_only=changed_only) for batch in batches]
        try:
            for future in as_completed(futures):
                for report in future.result():
                    reports[report["vessel"]] = report
                    progress(len(reports), todo.vessels, f"{report['vessel']}: {report['status']}")
        except BaseException:  # interrupted: what has begun is finished, the rest is left for the next run
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    for report in do_batch(warehouse, to_try_again(reports.values()), changed_only=changed_only):
        reports[report["vessel"]] = together(reports[report["vessel"]], report)
    return [reports[name] for name in sorted(reports)]
