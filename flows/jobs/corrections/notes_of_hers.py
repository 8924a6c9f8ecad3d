"""The notes on a vessel as she is now: those on what went to another vessel are not among them."""

from __future__ import annotations

from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, notes, segments
from kempf.warehouse.tables.notes import Note


def notes_of_hers(warehouse: Warehouse, vessel: str) -> list[Note]:
    """Return the notes on a vessel and on what is hers now, each once, in the order in which they were written.

    Those on a log that was moved to another vessel, and on its manoeuvres, are left out: they went with it.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    every = notes.of_vessel(warehouse, vessel)
    by_number = notes.with_origins(warehouse, every)
    on_segments = {note.subject_id for note in every if note.subject == "segment"}
    log_of = {name: one.log_id for name, one in segments.by_ids(warehouse, vessel, on_segments).items()}
    log_of |= {note.subject_id: note.subject_id for note in every if note.subject == "log"}
    whose = {log_id: row.vessel for log_id, row in logs.find(warehouse, sorted(set(log_of.values()))).items()}
    first: dict[tuple[str, int], Note] = {}
    for note in every:
        if whose.get(log_of.get(note.subject_id, ""), vessel) == vessel:
            first.setdefault((note.subject_id, notes.origin(by_number, note).number), note)
    return list(first.values())
