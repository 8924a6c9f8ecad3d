"""The job that builds every stored parameter set again from the raw bytes and writes down each verdict.

A verdict is a run in the table ``runs``, under the set, the code, the packages and the tolerance it was reached with:
so a job that was interrupted goes on where it stopped. A log is read once for all the sets of its segments.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from os import cpu_count
from typing import Any

from kempf.flows.jobs.identify.standing_model import POOLED
from kempf.flows.jobs.reprocess.rerun_set import Rerun, code_changed, inputs_of, judged, raw_inputs, rebuilt
from kempf.flows.jobs.state.vessel_state import code_of_sets
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.warehouse.code import code_version
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, purges, runs
from kempf.warehouse.tables import vessels as vessel_table
from kempf.warehouse.tables.parameter_set import ParameterSet

FLOW = "rerun"
#: Besides the three verdicts: it could not be built again, and why; not written down, so that it is tried again.
FAILED = "failed"
VERDICTS = ("bit-identical", "equal within tolerance", "different", FAILED)
#: Differences of one set that are written down; the rest is counted.
_FIELDS_SHOWN = 20


@dataclass(frozen=True)
class RerunVerdict:
    """What became of one parameter set."""

    vessel: str
    parameter_set_id: str
    #: One of `VERDICTS`.
    verdict: str
    #: Whether other code made the set.
    code_changed: bool
    #: Whether an earlier call had reached the verdict.
    known_before: bool = False
    #: Fields that differ.
    differences: int = 0
    #: The first of these fields, as JSON content.
    fields: tuple[dict[str, Any], ...] = ()
    #: Versions then and now, of those that differ.
    packages_changed: dict[str, list[str | None]] | None = None
    #: Why it could not be built again.
    error: KempfError | None = None

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set_id,
            "verdict": self.verdict,
            "code_changed": self.code_changed,
            "packages_changed": self.packages_changed or {},
            "differing_fields": self.differences,
            "differences": list(self.fields),
            **(self.error.as_json() if self.error else {}),
        }


@dataclass(frozen=True)
class Verification:
    """Every verdict, sorted by vessel, start and id."""

    verdicts: tuple[RerunVerdict, ...]
    #: Sets that rest on a log that was purged: nobody can build them again.
    of_purged_logs: tuple[str, ...] = ()

    def counts(self, *, code_changed: bool | None = None) -> dict[str, int]:
        """Return how many sets there are of each verdict, of all or of those whose code is, or is not, another now."""
        of = Counter(v.verdict for v in self.verdicts if code_changed is None or v.code_changed == code_changed)
        return {verdict: of[verdict] for verdict in VERDICTS}

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content; sets that are bit-identical are counted and not listed."""
        return {
            "sets": len(self.verdicts),
            "known_before": sum(v.known_before for v in self.verdicts),
            "verdicts": self.counts(),
            "of_this_code": self.counts(code_changed=False),
            "of_other_code": self.counts(code_changed=True),
            "of_purged_logs": list(self.of_purged_logs),
            "not_identical": [v.as_json() for v in self.verdicts if v.verdict != VERDICTS[0]],
        }


def verify_all(
    warehouse: Warehouse,
    vessels: Sequence[str] = (),
    tolerance: float = 1e-9,
    *,
    afresh: bool = False,
    progress: Progress = silent,
) -> Verification:
    """Build every parameter set again from the raw bytes; the verdicts are written down, nothing else is stored.

    Parameters
    ----------
    vessels : sequence of str, optional
        Only theirs; all by default.
    tolerance : float, optional
        Largest relative difference that still counts as equal.
    afresh : bool, optional
        Also sets on which this code, with these packages, has reached a verdict before.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    for vessel in vessels:
        vessel_table.require(warehouse, vessel)
    listed = parameter_sets.summaries(warehouse).select("vessel", "parameter_set_id").rows()
    purged = _of_purged_logs(warehouse)
    pairs = [(vessel, name) for vessel, name in listed if not vessels or vessel in vessels]
    out = tuple(name for _, name in pairs if name in purged)
    pairs = [(vessel, name) for vessel, name in pairs if name not in purged]
    by_id = {} if afresh else {run.run_id: run for run in runs.all_runs(warehouse, FLOW)}
    by_name: dict[str, RerunVerdict] = {}
    for _, name in pairs:
        before = by_id.get(_run_id(name, tolerance))
        if before is not None:
            by_name[name] = _remembered(before)
    done = len(by_name)
    for vessel, vessel_pairs in groupby(pairs, key=lambda pair: pair[0]):
        names = [name for _, name in vessel_pairs if name not in by_name]
        for group in _groups(parameter_sets.all_as_stored(warehouse, vessel, names)):
            progress(done, len(pairs), f"{vessel}: building {len(group)} parameter sets again")
            verdicts = _verify(warehouse, group, tolerance)
            # what is finished is kept even if the next moment is the last
            runs.record_all(warehouse, [_as_run(v, tolerance) for v in verdicts if v.error is None])
            by_name.update((v.parameter_set_id, v) for v in verdicts)
            done += len(group)
    progress(len(pairs), len(pairs), "done")
    return Verification(tuple(by_name[name] for _, name in pairs), out)


def _of_purged_logs(warehouse: Warehouse) -> set[str]:
    """Return the sets that rest on a log that was deleted for good."""
    gone = set(purges.of_logs(warehouse))
    if not gone:
        return set()
    rows = delta.read(warehouse, "parameter_sets", columns=("parameter_set_id", "log_ids")).rows()
    return {name for name, log_ids in rows if not gone.isdisjoint(log_ids)}


def _groups(sets: Sequence[ParameterSet]) -> Iterator[list[ParameterSet]]:
    """Give sets of the same logs together, a few at a time."""
    batch = 4 * (cpu_count() or 1)

    def sources(stored: ParameterSet) -> tuple[str, ...]:
        return (str(stored.provenance["inputs"]["profile_sha256"]), *map(str, stored.provenance["ingest_ids"]))

    for _, same in groupby(sorted(sets, key=sources), key=sources):
        together = list(same)
        for first in range(0, len(together), batch):
            yield together[first : first + batch]


def _verify(warehouse: Warehouse, group: Sequence[ParameterSet], tolerance: float) -> list[RerunVerdict]:
    """Build sets of the same logs again, one a thread: the likelihood runs outside the interpreter's lock."""
    try:
        instruments, profile = raw_inputs(warehouse, group[0])
    except Exception as error:  # noqa: BLE001 - whatever it is, the other logs must not pay for it
        return [_failed(stored, wrapped(error)) for stored in group]

    def verdict_on(stored: ParameterSet) -> RerunVerdict:
        try:
            return _verdict(stored, judged(stored, rebuilt(warehouse, stored, instruments, profile), tolerance))
        except Exception as error:  # noqa: BLE001 - whatever it is, the other sets must not pay for it
            return _failed(stored, wrapped(error))

    if group[0].estimator == POOLED:  # such a set takes all cores for itself
        return [verdict_on(stored) for stored in group]
    workers = ThreadPoolExecutor(max_workers=cpu_count())
    try:
        return list(workers.map(verdict_on, group))
    finally:
        workers.shutdown(cancel_futures=True)


def _verdict(stored: ParameterSet, result: Rerun) -> RerunVerdict:
    fields = tuple(difference.as_json() for difference in result.differences[:_FIELDS_SHOWN])
    count = len(result.differences)
    return RerunVerdict(
        vessel=stored.vessel,
        parameter_set_id=stored.parameter_set_id,
        verdict=result.verdict,
        code_changed=result.code_changed,
        differences=count,
        fields=fields,
        packages_changed=result.packages_changed,
    )


def _failed(stored: ParameterSet, error: KempfError) -> RerunVerdict:
    return RerunVerdict(
        stored.vessel,
        stored.parameter_set_id,
        FAILED,
        code_changed(inputs_of(stored), stored.provenance.get("made_by")),
        error=error,
    )


def _run_id(parameter_set_id: str, tolerance: float) -> str:
    """Return the id of the run that judges a set with the present code and packages."""
    inputs = {"parameter_set_id": parameter_set_id, "tolerance": tolerance}
    return runs.run_id(FLOW, {**inputs, "code": code_of_sets(), "packages": code_version.packages()})


def _as_run(verdict: RerunVerdict, tolerance: float) -> runs.FlowRun:
    message = {
        "parameter_set_id": verdict.parameter_set_id,
        "code_changed": verdict.code_changed,
        "packages_changed": verdict.packages_changed or {},
        "differences": list(verdict.fields),
    }
    name = _run_id(verdict.parameter_set_id, tolerance)
    return runs.FlowRun(name, FLOW, verdict.vessel, verdict.verdict, {"differences": verdict.differences}, message)


def _remembered(run: runs.FlowRun) -> RerunVerdict:
    return RerunVerdict(
        vessel=str(run.vessel),
        parameter_set_id=str(run.message["parameter_set_id"]),
        verdict=run.status,
        code_changed=bool(run.message["code_changed"]),
        known_before=True,
        differences=run.counts["differences"],
        fields=tuple(run.message["differences"]),
        packages_changed=dict(run.message["packages_changed"]),
    )
