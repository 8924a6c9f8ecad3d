"""Logs: how each was read, and what the channel doctor says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.ingest.unreadable_stretches import as_json as lost_as_json
from kempf.pipeline.ingest.decoded import LostStretch
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, logs, lost, vessels
from kempf.warehouse.tables.examinations import StoredExamination
from kempf.warehouse.tables.logs import LogRow


def facts_of(row: LogRow) -> dict[str, Any]:
    """Return what is shown of every log."""
    return {
        "log_id": row.log_id,
        "ingest_id": row.ingest_id,
        "vessel": row.vessel,
        "file_name": row.file_name,
        "format": row.format,
        "start": iso_utc(row.start_utc_ns),
        "end": iso_utc(row.end_utc_ns),
        "records_read": row.tally.records_read,
        "records_kept": row.tally.records_kept,
        "records_rejected": row.tally.records_rejected,
        "values_read": row.tally.values_read,
        "values_kept": row.tally.values_kept,
        "values_rejected": row.tally.values_rejected,
        "rejected_by_reason": dict(row.tally.by_reason),
    }


@dataclass(frozen=True)
class ListedLogs:
    """The logs that count."""

    rows: Sequence[LogRow]
    #: Stretches of logs that cannot be read, by ingest.
    lost: Mapping[str, Sequence[LostStretch]]
    #: One a row, JSON content.
    documents: list[dict[str, Any]]


def listed_logs(warehouse: Warehouse, vessel: str | None) -> ListedLogs:
    """Return the logs of one vessel or of all, with their ledgers and verdicts.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    warehouse.require()
    if vessel is not None:
        vessels.require(warehouse, vessel)
    rows = logs.current(warehouse, vessel)
    gone = lost.of_ingests(warehouse, [row.ingest_id for row in rows])
    examined = examinations.of_ingests(warehouse, [row.ingest_id for row in rows])
    documents = [
        {
            **facts_of(row),
            "partial": row.ingest_id in gone,
            "lost": lost_as_json(gone.get(row.ingest_id, ())),
            "notes": _notes(row, examined.get(row.ingest_id)),
            "channels": _verdict(examined.get(row.ingest_id)),
        }
        for row in rows
    ]
    return ListedLogs(rows, gone, documents)


def log_document(warehouse: Warehouse, row: LogRow) -> dict[str, Any]:
    """Return one log with all that the channel doctor found in it; ``channels`` is None where it never looked."""
    examination = examinations.of_ingests(warehouse, [row.ingest_id], [row.vessel]).get(row.ingest_id)
    return {
        **facts_of(row),
        "notes": _notes(row, examination),
        "channels": dict(examination.content) if examination else None,
    }


def _notes(row: LogRow, examination: StoredExamination | None) -> list[str]:
    return [*row.notes, *(examination.notes if examination else ())]


def _verdict(examination: StoredExamination | None) -> dict[str, Any] | None:
    if examination is None:
        return None
    return {"verdict": examination.verdict, "findings": list(examination.findings)}
