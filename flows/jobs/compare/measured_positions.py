"""Where the ship was in her manoeuvres, as her logs have it."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.pipeline.channels.series import Series
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.segments import Segment


def measured_positions(warehouse: Warehouse, segments: Sequence[Segment]) -> dict[str, tuple[Series, Series]]:
    """Return latitude and longitude, rad, of the segments whose logs hold them, by segment."""
    positions = {}
    logs = {name: channels_of(warehouse, name) for name in dict.fromkeys(segment.ingest_id for segment in segments)}
    for segment in segments:
        log = logs[segment.ingest_id]
        latitude, longitude = log.get("latitude"), log.get("longitude")
        if latitude is not None and longitude is not None:
            window = (segment.start_utc_ns, segment.end_utc_ns)
            positions[segment.segment_id] = (latitude.between(*window), longitude.between(*window))
    return positions
