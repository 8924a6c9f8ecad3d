"""Laying out by vessel and month a table of readings that has a folder a log.

The first commit gives the table its new folders and takes all files of before out of it; it says which version these
were. The logs of that version are then written again, some of them a commit, until none is missing: a migration that
was killed goes on with those that are. Every commit rests on the very version that was read. One that another process
put in between makes it fail; and a process that still holds the table as it was cannot commit to it any more, because
its folders changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from kempf.schemas.instants import month_of
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.scan import scanned
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, purges
from kempf.warehouse.upkeep.migrations import commits
from kempf.warehouse.upkeep.migrations.commits import MOST_ROWS, alone, batches, overtaken, version_said

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable

#: Logs of one commit.
MOST_LOGS = 256
#: What the first commit says of itself: the version that holds the rows of before.
_BEFORE = "kempf_laid_out_from"
#: Of logs that were never recorded and have no reading with a time.
_NEVER = "1970-01"


@dataclass(frozen=True)
class IngestOfBefore:
    """One ingest in a table that has a folder a log."""

    vessel_key: str
    month: str
    ingest_id: str
    rows: int


def missing(warehouse: Warehouse, name: str) -> list[IngestOfBefore]:
    """Return the ingests that are still to be laid out by month, by folder; none of a table that is laid out so.

    Parameters
    ----------
    warehouse : Warehouse
        Opened to be brought forward.
    name : str
        ``readings`` or ``rejected``.
    """
    before = version_before(warehouse, name)
    if before is None:
        return []
    held = set() if is_by_log(warehouse, name) else delta.distinct(warehouse, name, "ingest_id")
    held |= _purged(warehouse)
    return [ingest for ingest in _held(warehouse, name, before) if ingest.ingest_id not in held]


def carry_out(warehouse: Warehouse, name: str) -> Iterator[int]:
    """Lay a table out by month; yields how many ingests are done after every commit.

    Raises
    ------
    KempfError
        ``warehouse_busy``: another process committed to the table meanwhile; ``table_damaged``, ``disk_full``, ...
    """
    before = version_before(warehouse, name)
    table = delta.open_table(warehouse, name)
    if before is None or table is None:
        return
    todo = missing(warehouse, name)
    if is_by_log(warehouse, name):
        if table.version() != before:
            raise overtaken(name)
        _commit(table, name, (), first=before)
    source = delta.open_table(warehouse, name, before)
    done = 0
    for batch in batches(todo, MOST_LOGS, MOST_ROWS):
        # asked before anything is written: a table cannot be asked while the library writes
        parts = [(ingest, scanned(source, name, _where(ingest))) for ingest in batch]
        _commit(table, name, parts, first=None)
        done += len(batch)
        yield done


def version_before(warehouse: Warehouse, name: str) -> int | None:
    """Return the version that holds the rows a folder a log; None of a table that never had such folders."""
    table = delta.open_table(warehouse, name)
    if table is None:
        return None
    if is_by_log(warehouse, name):
        return table.version()
    return version_said(table, _BEFORE)


def require_same(warehouse: Warehouse, name: str) -> int:
    """Return how many ingests were compared: each says the same, row by row, as before it was laid out by month.

    Raises
    ------
    KempfError
        ``migration_differs``.
    """
    before = version_before(warehouse, name)
    if before is None:
        return 0
    then, now = (commits.contents(warehouse, name, v, by="ingest_id", without="month") for v in (before, None))
    differ = sorted(ingest for ingest in then.keys() - _purged(warehouse) if now.get(ingest) != then[ingest])
    if differ:
        raise commits.differs(name, before, ("ingests", "ingest_ids"), differ, then, now)
    return len(then)


def is_by_log(warehouse: Warehouse, name: str) -> bool:
    """Return whether a table has a folder a log."""
    table = delta.open_table(warehouse, name)
    return table is not None and "ingest_id" in table.metadata().partition_columns


def _purged(warehouse: Warehouse) -> set[str]:
    """Return the ingests of logs that were deleted for good: they must not come back."""
    gone = purges.of_logs(warehouse).keys()
    return {row.ingest_id for row in logs.all_ingests(warehouse) if row.log_id in gone} if gone else set()


def _held(warehouse: Warehouse, name: str, version: int) -> list[IngestOfBefore]:
    """Return the ingests in a version of a table that has a folder a log, by vessel and month."""
    import polars as pl

    table = delta.open_table(warehouse, name, version)
    assert table is not None
    if not table.file_uris():
        return []
    files = pl.DataFrame(table.get_add_actions(flatten=True))
    key, ingest = pl.col("partition.vessel_key").alias("vessel_key"), pl.col("partition.ingest_id").alias("ingest_id")
    rows = files.group_by(key, ingest).agg(pl.col("num_records").sum()).rows()
    months = _months(warehouse, {str(row[1]) for row in rows})
    ingests = [
        IngestOfBefore(str(key), months.get(str(name), _NEVER), str(name), int(count or 0)) for key, name, count in rows
    ]
    return sorted(ingests, key=lambda ingest: (ingest.vessel_key, ingest.month, ingest.ingest_id))


def _months(warehouse: Warehouse, ingests: set[str]) -> dict[str, str]:
    """Return the month of each ingest: that of its first reading, as its row in ``logs`` has it.

    Where a writer was killed before it wrote that row, the readings themselves tell.
    """
    import polars as pl

    months = {row.ingest_id: month_of(row.start_utc_ns) for row in logs.all_ingests(warehouse)}
    unknown = sorted(ingests - months.keys())
    if unknown:
        before = version_before(warehouse, "readings")
        table = delta.open_table(warehouse, "readings", before)
        first = pl.col("time_utc_ns").min()
        rows = scanned(table, "readings", {"ingest_id": unknown}).group_by("ingest_id").agg(first).collect().rows()
        months |= {str(name): month_of(start) for name, start in rows if start is not None}
    return months


def _where(ingest: IngestOfBefore) -> dict[str, str]:
    return {"vessel_key": ingest.vessel_key, "ingest_id": ingest.ingest_id}


def _frames(parts: Sequence[tuple[IngestOfBefore, pl.LazyFrame]]) -> Iterator[pl.DataFrame]:
    import polars as pl

    for ingest, rows in parts:
        for batch in rows.collect_batches(maintain_order=True):
            yield batch.with_columns(pl.lit(ingest.month).alias("month"))


def _commit(
    table: DeltaTable, name: str, parts: Sequence[tuple[IngestOfBefore, pl.LazyFrame]], *, first: int | None
) -> None:
    metadata = None if first is None else {_BEFORE: first}
    with alone(name):
        commits.append_alone(table, name, _frames(parts), lay_out=metadata)
