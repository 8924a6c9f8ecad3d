"""What a chart draws behind its channels: manoeuvres, stretches that could not be read, and notes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.schemas.instants import iso_utc
from kempf.warehouse.tables.notes import Note
from kempf.warehouse.tables.segments import Segment

#: letters of a note that a chart has room for
_MOST = 40


def span_of(segment: Segment) -> dict[str, Any]:
    """Return what a chart draws of a manoeuvre: its span and its executes."""
    return {
        "kind": "manoeuvre",
        "words": segment.words + (" (excluded)" if segment.excluded is not None else ""),
        "from": iso_utc(segment.start_utc_ns),
        "to": iso_utc(segment.end_utc_ns),
        "executes": [iso_utc(t) for t in segment.executes_utc_ns],
    }


def spans_of_lost(lost: Sequence[LostStretch], start_utc_ns: int, end_utc_ns: int) -> list[dict[str, Any]]:
    """Return the stretches of a log that could not be read; one whose ends are not known reaches to the log's."""
    return [
        {
            "kind": "lost",
            "words": "cannot be read",
            "from": iso_utc(start_utc_ns if stretch.since_ns is None else stretch.since_ns),
            "to": iso_utc(end_utc_ns if stretch.until_ns is None else stretch.until_ns),
            "executes": [],
        }
        for stretch in lost
    ]


def spans_of_notes(notes: Iterable[Note], end_utc_ns: int) -> list[dict[str, Any]]:
    """Return the notes that state when something happened, those of earlier too: what was done then still holds."""
    dated = [(note.event_utc_ns, note) for note in notes if note.event_utc_ns is not None]
    return [
        {
            "kind": "note",
            "words": note.text if len(note.text) <= _MOST else f"{note.text[: _MOST - 3]}...",
            "from": iso_utc(at),
            "to": iso_utc(at),
            "executes": [],
        }
        for at, note in sorted(dated, key=lambda pair: pair[0])
        if at <= end_utc_ns
    ]
