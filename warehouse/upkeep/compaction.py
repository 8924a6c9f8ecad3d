"""Putting the many small files that single commits leave into few, and deleting what no version that counts needs.

What the tables say stays the same, now and as of any time; what a parameter set's provenance names stays readable.
"""

from __future__ import annotations

import json
from bisect import bisect_right
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, seals, written
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, purges

if TYPE_CHECKING:
    from deltalake import DeltaTable

#: Tables of whole logs, with a folder a vessel and month: of the files there one is made.
_LARGE = ("readings", "rejected")
#: Tables that grow by single rows.
_SMALL = (
    *("vessels", "logs", "lost", "segments", "examinations", "parameter_sets"),
    *("diagnoses", "diagnosis_evidence", "aliases", "inbox"),
    *("runs", "run_history", "corrections", "notes", "equivalents", "purges"),
)
#: Tables that ``history --as-of`` reads at any time there ever was: every version of them is kept.
ALWAYS = ("logs", "segments", "parameter_sets")
#: A writer that has not committed yet is at most so old, hours; its files must not be taken from under it.
RETENTION_HOURS = 168.0


@dataclass(frozen=True)
class Cleared:
    """What vacuuming deleted, or would delete, in one table."""

    table: str
    #: files, size_bytes: Files of no version that is kept, and what they take.
    files: int
    size_bytes: int
    #: Versions that stay readable.
    kept_versions: int

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


def compact(warehouse: Warehouse, more_files_than: int = 50) -> tuple[str, ...]:
    """Compact the tables that have many files. Earlier versions stay readable: nothing is deleted.

    A table that is not kept a folder a vessel is sorted by vessel, in small groups of rows, so that reading one
    vessel skips the others. Readings become one file a vessel and month, or few of a month of very long logs. A table
    of many files is given a checkpoint, which opens several times as fast as its commits.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    more_files_than : int, optional
        Tables with fewer files are left alone.

    Returns
    -------
    tuple of str
        Names of the tables that were compacted.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``disk_full``, ``warehouse_not_writable``.
    """
    warehouse.require()
    purges.note_all(warehouse)  # of purges from before receipts were kept twice
    return tuple(name for name in TABLES if with_retry(partial(_one, warehouse, name, more_files_than)))


def _one(warehouse: Warehouse, name: str, more_files_than: int) -> bool:
    from deltalake import WriterProperties

    table = delta.open_table(warehouse, name)
    if table is None:
        return False
    written.note(warehouse, name)  # of tables from before that was kept
    if len(table.file_uris()) <= more_files_than:
        return False
    properties = WriterProperties(compression="ZSTD", max_row_group_size=delta.ROW_GROUP)
    sortable = "vessel_key" in {c.name for c in TABLES[name].columns} - set(table.metadata().partition_columns)
    with delta.refusals_as_errors(warehouse.address(name)):
        removed = 0
        if name in _SMALL and sortable:
            removed = table.optimize.z_order(["vessel_key"], writer_properties=properties)["numFilesRemoved"]
        elif name in (*_SMALL, *_LARGE):
            removed = table.optimize.compact(writer_properties=properties)["numFilesRemoved"]
        if warehouse.size_of(name, "_delta_log", f"{table.version():020d}.checkpoint.parquet") is None:
            table.create_checkpoint()
        seals.seal(table)
        seals.seal_checkpoint(table)
    return int(removed) > 0


def pinned(warehouse: Warehouse) -> dict[str, tuple[int, ...]]:
    """Return the versions of every table that the provenance of some parameter set names, in order.

    Where a table was lost and made anew, sets that were stored before that name versions of the lost one: these are
    left out.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    sets = delta.read(warehouse, "parameter_sets", columns=("parameter_set_id", "provenance_json"))
    texts = sets.select(
        "parameter_set_id", sets["provenance_json"].str.json_path_match("$.table_versions")
    ).drop_nulls()
    anew = {name: at for name in TABLES if (at := written.made_anew_at_ms(warehouse, name)) is not None}
    stored = parameter_sets.stored_at_ms(warehouse) if anew and not texts.is_empty() else {}
    versions: dict[str, set[int]] = {}
    for set_id, text in texts.rows():
        for name, version in json.loads(text).items():
            if stored.get(set_id, 0) >= anew.get(name, 0):
                versions.setdefault(name, set()).add(int(version))
    return {name: tuple(sorted(versions[name])) for name in sorted(versions)}


def vacuum(
    warehouse: Warehouse, older_than_hours: float = RETENTION_HOURS, *, dry_run: bool = False
) -> tuple[Cleared, ...]:
    """Delete the files that no version that is kept needs, and what writers that died left behind.

    Kept are the newest version of every table, every one that a parameter set's provenance names, every one that was
    the newest at some moment of the last ``older_than_hours``, and of `ALWAYS` every one there ever was. Files younger
    than that are never deleted, whoever they belong to.

    Parameters
    ----------
    dry_run : bool, optional
        Only say what would be deleted.

    Returns
    -------
    tuple of Cleared
        One a table that was ever written, in the order of `schemas.tables.TABLES`, no commit where there is nothing to
        delete; last ``raw``, for raw logs that were never whole.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``version_lost``: a version that is to be kept cannot be read any more; then nothing is deleted.
        ``warehouse_not_writable``.
    """
    named = pinned(warehouse)
    opened = {name: delta.open_table(warehouse, name) for name in TABLES}
    tables = {name: table for name, table in opened.items() if table is not None}
    kept = {name: _kept(table, name, named.get(name, ()), older_than_hours) for name, table in tables.items()}
    cleared = [
        _vacuumed(warehouse, name, tables[name], kept[name], older_than_hours, dry_run=dry_run) for name in tables
    ]
    halves = _half_written(warehouse, older_than_hours)
    size = sum(path.stat().st_size for path in halves)
    for path in () if dry_run else halves:
        path.unlink(missing_ok=True)
    return (*cleared, Cleared("raw", len(halves), size, 0))


def _half_written(warehouse: Warehouse, older_than_hours: float) -> list[Path]:
    """Return the files that a writer was killed over before it gave them their name; an object store has none."""
    if warehouse.folder is None:
        return []
    before = datetime.now(UTC).timestamp() - 3600.0 * older_than_hours
    passing = (*warehouse.folder.glob(".*.*"), *warehouse.folder.glob("raw/*/.*.*"))
    passing += tuple(warehouse.folder.glob(f"{written.FOLDER}/.*.*"))
    return sorted(path for path in passing if path.is_file() and path.stat().st_mtime < before)


def _vacuumed(
    warehouse: Warehouse, name: str, table: DeltaTable, keep: tuple[int, ...], older_than_hours: float, *, dry_run: bool
) -> Cleared:
    # whole hours are all that the table format takes: one too many is on the safe side
    hours = int(-(-older_than_hours // 1))
    ask = partial(
        table.vacuum, retention_hours=hours, enforce_retention_duration=False, full=True, keep_versions=list(keep)
    )
    with delta.refusals_as_errors(warehouse.address(name)):
        # what was deleted before is named again for ever
        sizes = [warehouse.size_of(name, *unquote(path).split("/")) for path in ask(dry_run=True)]
        there = [size for size in sizes if size is not None]
        if there and not dry_run:
            ask(dry_run=False)
            seals.seal(table)
        if not dry_run:
            seals.forget_deleted(table)
    return Cleared(name, len(there), sum(there), len(keep))


def _kept(table: DeltaTable, name: str, named: tuple[int, ...], older_than_hours: float) -> tuple[int, ...]:
    newest = table.version()
    ahead = [version for version in named if not 0 <= version <= newest]
    if ahead:
        raise KempfError(
            "version_lost",
            f"Parameter sets were made from versions {', '.join(map(str, ahead))} of the table {name}, which has "
            f"0 to {newest}: the table is older than the sets.",
            "Restore the whole warehouse from one copy; nothing was deleted.",
            {"table": name, "versions": ahead, "newest": newest},
        )
    if name in ALWAYS:
        return tuple(range(newest + 1))
    times = delta.commit_times(table)
    since = (datetime.now(UTC) - timedelta(hours=older_than_hours)).timestamp() * 1000.0
    # also the one that was the newest when that time began: work that began then rests on it, and may not have said so
    first = max(bisect_right(times, since) - 1, 0)
    return tuple(sorted({*range(first, newest + 1), *named}))
