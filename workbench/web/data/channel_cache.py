"""The channels of logs that were looked at last, held in memory: an ingest never changes."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock

from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.pipeline.channels.instruments import Instruments
from kempf.warehouse.storage.store import Warehouse

#: bytes that all together may take
MOST_BYTES = 512 * 2**20


class ChannelCache:
    """Channels by ingest, the ones that were not asked for the longest go first; the one asked for last stays."""

    def __init__(self, warehouse: Warehouse) -> None:
        self._warehouse = warehouse
        self._held: OrderedDict[str, Instruments] = OrderedDict()
        self._lock = Lock()

    def of(self, ingest_id: str) -> Instruments:
        """Return the channels of an ingest; errors are those of `channels_of`."""
        with self._lock:
            if ingest_id in self._held:
                self._held.move_to_end(ingest_id)
                return self._held[ingest_id]
        instruments = channels_of(self._warehouse, ingest_id)
        with self._lock:
            self._held[ingest_id] = instruments
            self._held.move_to_end(ingest_id)
            while len(self._held) > 1 and sum(map(_bytes, self._held.values())) > MOST_BYTES:
                self._held.popitem(last=False)
        return instruments


def _bytes(instruments: Instruments) -> int:
    return sum(series.time_utc_ns.nbytes + series.value.nbytes for series in instruments.series.values())
