"""A manoeuvre: what was measured in it, executes and overshoots, and the criteria."""

from __future__ import annotations

from typing import Any

from kempf.warehouse import aliases, logs, notes, segments
from kempf.warehouse.instant import iso_utc
from kempf.workbench.documents.manoeuvres import listed_manoeuvres
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.pages.log import span_of
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.pages.series import offered
from kempf.workbench.web.window import window

#: of a manoeuvre's length, shown before and after it
_MARGIN = 0.05


def document(desk: Desk, segment_id: str) -> dict[str, Any]:
    """Return the manoeuvre's entry in what `kempf segments --json` prints."""
    one = segments.by_prefix(desk.warehouse, segment_id)
    listed = listed_manoeuvres(desk.warehouse, one.vessel)
    return next(entry for entry in listed.documents if entry["segment_id"] == one.segment_id)


def gather(desk: Desk, segment_id: str, asked_from: str | None, asked_to: str | None) -> Page:
    """Return the page of a manoeuvre."""
    shown = document(desk, segment_id)
    row = logs.of_ingest(desk.warehouse, shown["ingest_id"])
    listed = segments.found_in(desk.warehouse, row.vessel)
    place = next(k for k, one in enumerate(listed) if one.segment_id == shown["segment_id"])
    one = listed[place]
    beyond = int(_MARGIN * (one.end_utc_ns - one.start_utc_ns))
    first, last = max(one.start_utc_ns - beyond, row.start_utc_ns), min(one.end_utc_ns + beyond, row.end_utc_ns)
    begin, end = window(asked_from, asked_to, first, last)
    content = {
        "one": shown,
        "log_id": row.log_id,
        "channels": offered(desk.channels.of(row.ingest_id)),
        "spans": [span_of(one)],
        "window": (iso_utc(begin), iso_utc(end)),
        "whole": (iso_utc(first), iso_utc(last)),
        "current": aliases.CURRENT in aliases.of_vessel(desk.warehouse, row.vessel),
        "notes": [n.show() for n in notes.of_vessel(desk.warehouse, row.vessel) if n.subject_id == one.segment_id],
        "before": listed[place - 1].segment_id if place else None,
        "after": listed[place + 1].segment_id if place + 1 < len(listed) else None,
    }
    title = f"{span_of(one)['words']}, {iso_utc(one.start_utc_ns)[:16].replace('T', ' ')} UTC"
    above = ((row.vessel, of_vessel(row.vessel)), (row.file_name, f"/logs/{row.log_id}"))
    return Page("manoeuvre.html", title, content, above)
