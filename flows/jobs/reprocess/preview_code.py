"""The job that says which parameter sets the present code would move, and by how much, before it is adopted.

It is the very job of `kempf.flows.jobs.reprocess.reprocess_vessel`, done in a warehouse that is thrown away: what
adopting the code would do is done, not guessed. The warehouse that is asked about is only read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from kempf.flows.jobs.reprocess.parameter_changes import Move, NewSet, paired
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.flows.jobs.state.out_of_date import unsearched
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError, NotFound
from kempf.warehouse.code import code_version
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.canonical import canonical_json, plain
from kempf.warehouse.storage.keys import ingest_id
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, corrections, examinations, logs, parameter_sets, raw, readings, segments
from kempf.warehouse.tables import vessels as vessel_table
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.examinations import StoredExamination
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True)
class VesselPreview:
    """What adopting the present code would do to the parameter sets of one vessel that stand."""

    vessel: str
    #: Sets that stand: those of the logs as they were read last.
    sets: int
    #: Of these, made by the present code already.
    up_to_date: int
    #: Of the others, those that would say the same, bit for bit.
    identical: int = 0
    #: One a parameter of each of the others.
    moves: tuple[Move, ...] = ()
    #: Sets that would come with no counterpart, such as those of a zigzag that was not found before.
    new: tuple[NewSet, ...] = ()
    #: Sets that would have no counterpart any more.
    gone: tuple[str, ...] = ()
    #: How many logs were read and looked through anew, and those of them in which something else was found.
    logs: int = 0
    logs_otherwise: tuple[str, ...] = ()
    #: What the present code cannot do that is to be done, each with the error's JSON.
    failures: tuple[dict[str, Any], ...] = field(default=())

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content, without the moves, which stand together for all vessels."""
        return {
            "vessel": self.vessel,
            "sets": self.sets,
            "up_to_date": self.up_to_date,
            "identical": self.identical,
            "moved": len({move.parameter_set_id for move in self.moves}),
            "new": [new_set.as_json() for new_set in self.new],
            "gone": list(self.gone),
            "logs": self.logs,
            "logs_otherwise": list(self.logs_otherwise),
            "failures": list(self.failures),
        }


def preview_all(warehouse: Warehouse, vessels: Sequence[str] = (), progress: Progress = silent) -> list[VesselPreview]:
    """Say what the present code would make of the parameter sets that stand; nothing is stored.

    Parameters
    ----------
    warehouse : Warehouse
        Only read.
    vessels : sequence of str, optional
        Only these; all by default.

    Returns
    -------
    list of VesselPreview
        Sorted by name. A vessel that cannot be done says why; the others are done.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    warehouse.require()
    for vessel in vessels:
        vessel_table.require(warehouse, vessel)
    names = sorted(set(vessels)) or vessel_table.names(warehouse)
    previews = []
    for done, vessel in enumerate(names):
        progress(done, len(names), f"{vessel}: comparing with the present code")
        try:
            previews.append(_preview(warehouse, vessel))
        except Exception as error:  # noqa: BLE001 - whatever it is, the next vessel must not pay for it
            previews.append(VesselPreview(vessel, 0, 0, failures=(_failure(vessel, wrapped(error)),)))
    progress(len(names), len(names), "done")
    return previews


def _preview(warehouse: Warehouse, vessel: str) -> VesselPreview:
    """Say what the present code would make of the parameter sets of one vessel that stand; nothing is stored."""
    vessel_table.require(warehouse, vessel)
    code, present = code_of(warehouse, "estimate"), code_version.fingerprint("estimate")
    stand = standing_sets(warehouse, vessel)
    old = [stored for stored in stand if stored.provenance["code_version"] != code]
    ready = len(stand) - len(old)
    rows = logs.current(warehouse, vessel)
    read = all(row.code_version == code_of(warehouse, "ingest") for row in rows)
    if not old and read and not unsearched(warehouse, rows):
        return VesselPreview(vessel, ready, ready)
    with _scratch() as scratch:
        failures = _seed(warehouse, scratch, vessel)
        report = reprocess_vessel(scratch, vessel)
        otherwise = _otherwise(warehouse, scratch, vessel)
        now = [stored for stored in standing_sets(scratch, vessel) if stored.provenance["code_version"] == present]
    same = _built_again(warehouse, old)
    old = [stored for stored in old if stored.parameter_set_id not in same]
    # in the other warehouse nothing is there to be brought forward: all manoeuvres are fitted at once
    now = [stored for stored in now if (stored.model_sha256, stored.estimator) not in same.values()]
    there = set(parameter_sets.summaries(warehouse, vessel)["parameter_set_id"].to_list())
    pairs = paired(old, now)
    return VesselPreview(
        vessel,
        sets=len(stand),
        up_to_date=ready,
        identical=pairs.identical + len(same),
        moves=pairs.moves,
        new=tuple(stored for stored in pairs.new if stored.parameter_set_id not in there),
        gone=pairs.gone,
        logs=len(rows),
        logs_otherwise=otherwise,
        failures=(*failures, *report.failures),
    )


def _built_again(warehouse: Warehouse, old: Sequence[ParameterSet]) -> dict[str, tuple[str, str]]:
    """Return model and estimator, by id, of sets that rest on others and are built again with these, bit for bit."""
    models = {}
    for stored in old:
        if stored.updates is None:
            continue
        try:
            again = rerun(warehouse, stored.parameter_set_id)
        except KempfError:
            continue  # compared with what comes of all manoeuvres, like any other set
        if {again.verdict, *again.rests_on.values()} == {"bit-identical"}:
            models[stored.parameter_set_id] = stored.model_sha256, stored.estimator
    return models


def standing_sets(warehouse: Warehouse, vessel: str) -> list[ParameterSet]:
    """Return the parameter sets of a vessel that are not superseded, by start, then id."""
    return parameter_sets.get_all(warehouse, vessel, standing_ids(warehouse, vessel))


@contextmanager
def _scratch() -> Iterator[Warehouse]:
    with TemporaryDirectory(prefix="kempf-preview-", ignore_cleanup_errors=True) as name:
        scratch = Warehouse(str(Path(name) / "warehouse"))
        scratch.create()
        yield scratch


def _seed(warehouse: Warehouse, scratch: Warehouse, vessel: str) -> list[dict[str, Any]]:
    """Put into an empty warehouse what reprocessing starts from: profiles, logs, corrections, sets, aliases."""
    failures = []
    versions = vessel_table.versions(warehouse, vessel)
    vessel_table.register_all(scratch, [(vessel, version.profile) for version in versions])
    kept = []
    for row in logs.current(warehouse, vessel):
        try:
            with raw.opened(warehouse, row.log_id) as log:
                raw.put(scratch, log)
            # as read by no code: what the present one has read there has no readings here
            kept.append(replace(row, ingest_id=ingest_id(row.log_id, row.profile_sha256, ""), code_version=""))
        except KempfError as error:
            failures.append(_failure(row.file_name, error))
    logs.record(scratch, kept)
    for entry in corrections.all_of(warehouse, [row.log_id for row in kept]):
        corrections.add(scratch, entry.log_id, entry.segment_id, entry.correction)
    # those that no longer stand, too: their models are brought up to date with the others
    parameter_sets.insert(scratch, parameter_sets.all_as_stored(warehouse, vessel))
    pointed = aliases.of_vessel(warehouse, vessel)
    if aliases.WITHDRAWN in pointed:
        # of a vessel that was renamed it is a set of the earlier name
        with suppress(NotFound):
            set_before = parameter_sets.stored_anywhere(warehouse, pointed[aliases.WITHDRAWN], vessel)
            parameter_sets.insert(scratch, [set_before])
    aliases.point_all(scratch, {(vessel, alias): name for alias, name in pointed.items()})
    return failures


def _otherwise(warehouse: Warehouse, scratch: Warehouse, vessel: str) -> tuple[str, ...]:
    """Return the names of logs in which something else was read or found in the other warehouse, sorted."""
    there = {row.log_id: row for row in logs.current(scratch, vessel)}
    findings, findings_there = _found_in(warehouse, vessel), _found_in(scratch, vessel)
    return tuple(
        sorted(
            row.file_name
            for row in logs.current(warehouse, vessel)
            if row.log_id not in there
            or findings[row.log_id] != findings_there[row.log_id]
            or not readings.read(warehouse, row.ingest_id).equals(readings.read(scratch, there[row.log_id].ingest_id))
        )
    )


def _found_in(warehouse: Warehouse, vessel: str) -> dict[str, str]:
    """Return what was counted, examined and found in a vessel's logs, as text by log, but for the code that did it."""
    rows = logs.current(warehouse, vessel)
    examined = examinations.of_ingests(warehouse, [row.ingest_id for row in rows], [vessel])
    by_log: dict[str, list[Any]] = {row.log_id: [vars(row.tally), row.notes] for row in rows}
    for row in rows:
        by_log[row.log_id].append(_without_code(examined[row.ingest_id]) if row.ingest_id in examined else None)
    for segment in segments.found_in(warehouse, vessel):
        by_log[segment.log_id].append(_without_code(segment))
    return {name: canonical_json(plain(content)) for name, content in by_log.items()}


def _without_code(row: StoredExamination | Segment) -> dict[str, Any]:
    return {key: value for key, value in vars(row).items() if key not in ("ingest_id", "code_version")}


def _failure(what: str, error: KempfError) -> dict[str, Any]:
    return {"what": what, **error.as_json()}
