"""What was known of a vessel's logs and parameter sets at some time, as the versions of their tables have it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING

from kempf.schemas.errors import KempfError, UsageError
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import earlier_key, vessel_key
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, notes
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.notes import Note

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable


@dataclass(frozen=True)
class LogsAsOf:
    """What was known of a vessel's logs at some time."""

    #: Ingests after which their logs had been read anew, or removed.
    past: list[str]
    #: Segments found in the others; None where nobody had looked for any, or nobody knows any more.
    segments: list[str] | None
    #: Reads `_twins` of these; nothing of the past, of which that is not known.
    twins: Callable[[], Mapping[str, str]]
    #: Notes on her and what is hers.
    notes: list[Note]
    #: Fingerprint under which the present code estimates.
    code: str
    #: Whether it was so at a time that is past, of which earlier versions of tables tell.
    then: bool


def logs_as_of(warehouse: Warehouse, vessel: str, as_of: datetime | None) -> LogsAsOf:
    """Return what is known of a vessel's logs, or was by a time."""
    version = None if as_of is None else delta.version_as_of(warehouse, "logs", as_of)
    if as_of is not None and version is None:
        return LogsAsOf([], None, dict, [], code_of(warehouse, "estimate"), then=True)
    columns = ("log_id", "ingest_id", "revision", "removed")
    rows = _read(warehouse, "logs", vessel, {}, columns, version).sort("log_id", "revision")
    last = {row["log_id"]: row for row in rows.rows(named=True)}
    present = {log: row["ingest_id"] for log, row in last.items() if row["removed"] is None}
    past = [row["ingest_id"] for row in rows.rows(named=True) if present.get(row["log_id"]) != row["ingest_id"]]
    segments = _segments_in(warehouse, vessel, sorted(present.values()), as_of)
    noted = notes.of_vessel(warehouse, vessel, as_of)
    twins = partial(_twins, warehouse, vessel) if as_of is None and segments else dict
    return LogsAsOf(past, segments, twins, noted, code_of(warehouse, "estimate"), as_of is not None)


@contextmanager
def sets_as_of(warehouse: Warehouse, as_of: datetime | None) -> Iterator[DeltaTable | None]:
    """Lend the table of parameter sets as it was at a time, None where there was none yet; as it is by default.

    Raises
    ------
    UsageError
        ``as_of_without_zone``.
    """
    if as_of is None:
        with delta.reading(warehouse, "parameter_sets") as table:
            yield table
        return
    if as_of.tzinfo is None:
        raise UsageError(
            "as_of_without_zone",
            f"{as_of.isoformat()} names no time zone.",
            "Write it with one, such as 2025-05-03T12:00:00Z.",
        )
    version = delta.version_as_of(warehouse, "parameter_sets", as_of)
    if version is None:
        yield None
        return
    with delta.reading(warehouse, "parameter_sets", version) as table:
        yield table


def as_then(table: DeltaTable | None, name: str, vessel: str, where: Where, columns: Sequence[str]) -> pl.DataFrame:
    """Return rows of a vessel in some version of a table, which may have them under the key of before layout 4.

    One that was written while the table was brought forward has some under either key, and each of them once.
    Parameters are those of `kempf.warehouse.storage.delta.rows`.
    """
    import polars as pl

    keys = (vessel_key(vessel), earlier_key(vessel))
    return pl.concat([delta.rows(table, name, {"vessel_key": key, **where}, columns) for key in keys])


def _read(
    warehouse: Warehouse, name: str, vessel: str, where: Where, columns: Sequence[str], version: int | None
) -> pl.DataFrame:
    """Return rows of a vessel in the newest version of a table, or in another one."""
    if version is None:
        return delta.read(warehouse, name, {"vessel_key": vessel_key(vessel), **where}, columns)
    with delta.reading(warehouse, name, version) as table:
        return as_then(table, name, vessel, where, columns)


def _segments_in(warehouse: Warehouse, vessel: str, ingests: list[str], as_of: datetime | None) -> list[str] | None:
    version = None if as_of is None else delta.version_as_of(warehouse, "segments", as_of)
    if as_of is not None and version is None:
        return None
    try:
        rows = _read(warehouse, "segments", vessel, {"ingest_id": ingests}, ("segment_id", "excluded"), version)
    except KempfError:
        if version is None:
            raise
        return None  # what was found then has been deleted since: earlier versions of kempf did not keep it
    ids = rows.filter(rows["excluded"].is_null())["segment_id"].to_list()
    return ids or ([] if examinations.codes(warehouse, ingests, [vessel]) else None)


def _twins(warehouse: Warehouse, vessel: str) -> dict[str, str]:
    """Return which manoeuvres another log holds better, by id, and the id of that one."""
    from kempf.warehouse.queries.deduplicate import twins
    from kempf.warehouse.tables import segments

    return twins(segments.current(warehouse, vessel))
