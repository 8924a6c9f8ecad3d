"""Readings and refused records of one ingest, at native rates. Nothing here is seen before its row in ``logs``.

A table has a folder a vessel and month, where `kempf.warehouse.upkeep.compaction` makes one file of those of single
logs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from kempf.pipeline.ingest.readings import READING_SCHEMA, REJECTED_SCHEMA, LogReadings
from kempf.schemas.instants import month_of
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs
from kempf.warehouse.tables.logs import LogRow

if TYPE_CHECKING:
    import polars as pl


def write(warehouse: Warehouse, batch: Sequence[tuple[LogRow, LogReadings]]) -> None:
    """Put the readings of several ingests in place of what is there of them, in one commit.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    batch : sequence of (LogRow, LogReadings)
        The ingest, whether it is recorded already or not, and its readings.
    """
    _write(warehouse, "readings", [(row, item.frames) for row, item in batch])


def write_rejected(warehouse: Warehouse, batch: Sequence[tuple[LogRow, LogReadings]]) -> None:
    """Put what was refused in several ingests in place of what is there of them, in one commit."""
    _write(warehouse, "rejected", [(row, item.rejections) for row, item in batch])


def read(warehouse: Warehouse, ingest_id: str) -> pl.DataFrame:
    """Return the readings of one ingest.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    ingest_id : str
        From a row of ``logs``.

    Returns
    -------
    polars.DataFrame
        Columns `kempf.pipeline.ingest.readings.READING_SCHEMA`, sorted by record.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_ingest``.
    """
    with lent(warehouse, ingest_id) as rows:
        return rows.collect()


@contextmanager
def lent(warehouse: Warehouse, ingest_id: str) -> Iterator[pl.LazyFrame]:
    """Lend the readings of one ingest, for those who want some columns of them; not to be used after the ``with``.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    ingest_id : str
        From a row of ``logs``.

    Yields
    ------
    polars.LazyFrame
        As `read` gives them.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_ingest``.
    KempfError
        ``table_unreadable``.
    """
    with delta.lent(warehouse, "readings", _of_ingest(warehouse, ingest_id)) as rows:
        yield rows.select(list(READING_SCHEMA)).sort("record", "source", "time_utc_ns")


def read_rejected(warehouse: Warehouse, ingest_id: str) -> pl.DataFrame:
    """Return what was refused in one ingest, columns `REJECTED_SCHEMA`, sorted by record then channel.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_ingest``.
    """
    frame = delta.read(warehouse, "rejected", _of_ingest(warehouse, ingest_id))
    return frame.select(list(REJECTED_SCHEMA)).sort("record", "channel", "reason", "raw")


def _of_ingest(warehouse: Warehouse, ingest_id: str) -> dict[str, str]:
    row = logs.of_ingest(warehouse, ingest_id)
    return {"vessel_key": vessel_key(row.vessel), "month": month_of(row.start_utc_ns), "ingest_id": row.ingest_id}


def _write(
    warehouse: Warehouse, name: str, batch: Sequence[tuple[LogRow, Callable[[], Iterator[pl.DataFrame]]]]
) -> None:
    if not batch:
        return

    def rows() -> Iterator[pl.DataFrame]:
        import polars as pl

        for row, frames in batch:
            constants = {"vessel_key": vessel_key(row.vessel), "vessel": row.vessel, "ingest_id": row.ingest_id}
            constants["month"] = month_of(row.start_utc_ns)
            for frame in frames():
                yield frame.with_columns(pl.lit(value).alias(column) for column, value in constants.items())

    held = {row.ingest_id: row for row, _ in batch}
    where = (
        one_of("vessel_key", {vessel_key(row.vessel) for row in held.values()}),
        one_of("ingest_id", held),
        one_of("month", {month_of(row.start_utc_ns) for row in held.values()}),
    )

    def attempt() -> None:
        with delta.ensured(warehouse, name) as table:
            delta.replace(table, name, rows(), " AND ".join(where))

    with_retry(attempt)
