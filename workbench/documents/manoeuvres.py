"""The manoeuvres that were found, with what stands against them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.reprocess.vessel_quality import marks
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, logs, segments
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True)
class ListedManoeuvres:
    """The manoeuvres of the logs that count."""

    found: list[Segment]
    #: One a manoeuvre, JSON content.
    documents: list[dict[str, Any]]


def listed_manoeuvres(warehouse: Warehouse, vessel: str | None) -> ListedManoeuvres:
    """Return the manoeuvres of one vessel or of all.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    warehouse.require()
    names = {row.ingest_id: row.file_name for row in logs.current(warehouse)}
    # another process may read a log anew between the two questions
    manoeuvres = [segment for segment in segments.found_in(warehouse, vessel) if segment.ingest_id in names]
    examined = examinations.of_ingests(warehouse, [segment.ingest_id for segment in manoeuvres])
    against = marks(warehouse, vessel)
    documents = [
        {
            **segment.as_json(names[segment.ingest_id]),
            "channels": list(examined[segment.ingest_id].findings) if segment.ingest_id in examined else [],
            "marks": against.get(segment.segment_id, []),
        }
        for segment in manoeuvres
    ]
    return ListedManoeuvres(manoeuvres, documents)


def logs_begin_alike(manoeuvres: Iterable[tuple[str, str]]) -> bool:
    """Return whether manoeuvres of several logs begin in the same minute, as where a logger has no calendar.

    Parameters
    ----------
    manoeuvres : iterable of (str, str)
        Start, ISO 8601, and log of each of a vessel's.
    """
    log_at: dict[str, str] = {}
    return any(log_at.setdefault(start[:16], log) != log for start, log in manoeuvres)
