"""What a person calls a vessel's manoeuvres: kind and side, when, and the log where several begin alike."""

from __future__ import annotations

from kempf.schemas.instants import iso_utc, minute
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, segments
from kempf.warehouse.tables.segments import Segment
from kempf.workbench.documents.manoeuvres import logs_begin_alike


def kind_and_side(segment: Segment) -> str:
    """Return a manoeuvre without its time: ``20/20 zigzag to starboard``."""
    return segment.words + (f" to {segment.first_side}" if segment.first_side in ("starboard", "port") else "")


def names_of(warehouse: Warehouse, vessel: str, *, when: bool = True) -> dict[str, str]:
    """Return the name of every manoeuvre of a vessel by its id.

    Parameters
    ----------
    when : bool, optional
        Whether the name has the beginning; the log stands in it where those of several logs begin alike.
    """
    found = segments.found_in(warehouse, vessel)
    files = {row.ingest_id: row.file_name for row in logs.current(warehouse, vessel)}
    alike = logs_begin_alike((iso_utc(one.start_utc_ns), one.ingest_id) for one in found)
    return {
        one.segment_id: kind_and_side(one)
        + (f", {minute(iso_utc(one.start_utc_ns))}" if when else "")
        + (f", {files[one.ingest_id]}" if alike and one.ingest_id in files else "")
        for one in found
    }
