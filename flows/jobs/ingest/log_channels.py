"""The channels of a log that is in the warehouse."""

from __future__ import annotations

from kempf.pipeline.channels.instruments import Instruments, from_readings
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import readings


def channels_of(warehouse: Warehouse, ingest_id: str) -> Instruments:
    """Return the series of every channel of one ingest.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_ingest``.
    """
    with readings.lent(warehouse, ingest_id) as rows:
        return from_readings(rows)
