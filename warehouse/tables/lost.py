"""What of damaged logs could not be read, a stretch a row. Nothing here is seen before its row in ``logs``."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.pipeline.ingest.readings import LogReadings
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.logs import LogRow


def write(warehouse: Warehouse, batch: Sequence[tuple[LogRow, LogReadings]]) -> None:
    """Put the lost stretches of several ingests in place of what is there of them, in one commit.

    Nothing is written where all logs are whole.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    batch : sequence of (LogRow, LogReadings)
        The ingest, and what was read of its log.
    """
    damaged = [(row, item) for row, item in batch if item.lost]
    if not damaged:
        return
    rows = [
        {
            "vessel_key": vessel_key(row.vessel),
            "vessel": row.vessel,
            "ingest_id": row.ingest_id,
            "number": number,
            "since_utc_ns": stretch.since_ns,
            "until_utc_ns": stretch.until_ns,
            "messages": stretch.messages,
            "why": stretch.why,
        }
        for row, item in damaged
        for number, stretch in enumerate(item.lost)
    ]
    predicate = one_of("ingest_id", {row.ingest_id for row, _ in damaged})

    def attempt() -> None:
        with delta.ensured(warehouse, "lost") as table:
            delta.replace(table, "lost", rows, predicate)

    with_retry(attempt)


def of_ingests(warehouse: Warehouse, ingest_ids: Sequence[str]) -> dict[str, tuple[LostStretch, ...]]:
    """Return the lost stretches of each of some ingests in the order of the file; ingests of whole logs are not in it.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    frame = delta.read(warehouse, "lost", {"ingest_id": sorted(set(ingest_ids))}).sort("ingest_id", "number")
    stretches: dict[str, tuple[LostStretch, ...]] = {}
    for row in frame.rows(named=True):
        stretch = LostStretch(row["since_utc_ns"], row["until_utc_ns"], row["messages"], row["why"])
        stretches[row["ingest_id"]] = (*stretches.get(row["ingest_id"], ()), stretch)
    return stretches
