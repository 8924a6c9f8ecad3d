"""A log: its channels over time, the track, the manoeuvres found in it, and what speaks against its channels."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.corrections.notes_of_hers import notes_of_hers
from kempf.flows.jobs.ingest.unreadable_stretches import as_json as lost_as_json
from kempf.schemas.instants import iso_utc
from kempf.warehouse.tables import logs, lost, segments
from kempf.workbench.documents.logs import log_document
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.draw.track import draw_track
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.pages.series import offered
from kempf.workbench.web.pages.spans import span_of, spans_of_lost, spans_of_notes
from kempf.workbench.web.window import window


def document(app_state: AppState, log_id: str) -> dict[str, Any]:
    """Return what `kempf logs show ID --json` prints."""
    return log_document(app_state.warehouse, logs.by_prefix(app_state.warehouse, log_id))


def gather(app_state: AppState, log_id: str, asked_from: str | None, asked_to: str | None) -> Page:
    """Return the page of a log."""
    row = logs.by_prefix(app_state.warehouse, log_id)
    begin, end = window(asked_from, asked_to, row.start_utc_ns, row.end_utc_ns)
    channels = app_state.channels.of(row.ingest_id)
    manoeuvres = [
        manoeuvre
        for manoeuvre in segments.found_in(app_state.warehouse, row.vessel)
        if manoeuvre.ingest_id == row.ingest_id
    ]
    gone = lost.of_ingests(app_state.warehouse, [row.ingest_id]).get(row.ingest_id, ())
    vessel_notes = notes_of_hers(app_state.warehouse, row.vessel)
    shown = log_document(app_state.warehouse, row)
    content = {
        "log": shown,
        "channels": offered(channels),
        "notes": dict.fromkeys((*shown["notes"], *channels.notes)),
        "remarks": [note.as_json() for note in vessel_notes if note.subject_id == row.log_id],
        "manoeuvres": [manoeuvre.as_json(row.file_name) for manoeuvre in manoeuvres],
        "spans": [
            *(span_of(manoeuvre) for manoeuvre in manoeuvres),
            *spans_of_lost(gone, row.start_utc_ns, row.end_utc_ns),
            *spans_of_notes(vessel_notes, row.end_utc_ns),
        ],
        "lost": lost_as_json(gone),
        "track": draw_track(channels, [(manoeuvre.start_utc_ns, manoeuvre.end_utc_ns) for manoeuvre in manoeuvres]),
        "window": (iso_utc(begin), iso_utc(end)),
        "whole": (iso_utc(row.start_utc_ns), iso_utc(row.end_utc_ns)),
    }
    return Page("log.html", row.file_name, content, ((row.vessel, of_vessel(row.vessel)),))
