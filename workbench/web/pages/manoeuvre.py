"""A manoeuvre: what was measured in it, executes and overshoots, and the criteria."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.flows.jobs.corrections.notes_of_hers import notes_of_hers
from kempf.schemas.enumeration import as_words
from kempf.schemas.instants import iso_utc, minute
from kempf.warehouse.tables import aliases, logs, lost, segments
from kempf.workbench.charts.channels import derived
from kempf.workbench.documents.manoeuvres import listed_manoeuvres
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data.predictions import HORIZONS, KeptPrediction, kept_of
from kempf.workbench.web.form_numbers import whole_number
from kempf.workbench.web.pages.model import stretch_address, worst_stretches
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.pages.series import offered
from kempf.workbench.web.pages.spans import span_of, spans_of_lost, spans_of_notes
from kempf.workbench.web.window import window

#: of a manoeuvre's length, shown before and after it
_MARGIN = 0.05


def document(app_state: AppState, segment_id: str) -> dict[str, Any]:
    """Return the manoeuvre's entry in what `kempf segments --json` prints."""
    segment = segments.by_prefix(app_state.warehouse, segment_id)
    listed = listed_manoeuvres(app_state.warehouse, segment.vessel)
    return next(entry for entry in listed.documents if entry["segment_id"] == segment.segment_id)


def gather(app_state: AppState, segment_id: str, fields: Mapping[str, str]) -> Page:
    """Return the page of a manoeuvre.

    Parameters
    ----------
    fields : mapping
        ``from`` and ``to``; ``set`` and ``h``, the model beside it and its horizon; ``worst``, which of the worst
        stretches of that model this window is, from 1.
    """
    shown = document(app_state, segment_id)
    row = logs.of_ingest(app_state.warehouse, shown["ingest_id"])
    listed = segments.found_in(app_state.warehouse, row.vessel)
    place = next(k for k, segment in enumerate(listed) if segment.segment_id == shown["segment_id"])
    segment = listed[place]
    beyond = int(_MARGIN * (segment.end_utc_ns - segment.start_utc_ns))
    first, last = max(segment.start_utc_ns - beyond, row.start_utc_ns), min(segment.end_utc_ns + beyond, row.end_utc_ns)
    begin, end = window(fields.get("from"), fields.get("to"), first, last)
    vessel_notes = notes_of_hers(app_state.warehouse, row.vessel)
    gone = lost.of_ingests(app_state.warehouse, [row.ingest_id]).get(row.ingest_id, ())
    compared = segment.is_fitted and segment.excluded is None
    current = compared and aliases.CURRENT in aliases.of_vessel(app_state.warehouse, row.vessel)
    content: dict[str, Any] = {
        "one": shown,
        "log_id": row.log_id,
        "channels": offered(app_state.channels.of(row.ingest_id)),
        "spans": [span_of(segment), *spans_of_lost(gone, first, last), *spans_of_notes(vessel_notes, last)],
        "window": (iso_utc(begin), iso_utc(end)),
        "whole": (iso_utc(first), iso_utc(last)),
        "current": current,
        "predicted": None,
        "stretch": None,
        "notes": [note.as_json() for note in vessel_notes if note.subject_id == segment.segment_id],
        "before": listed[place - 1].segment_id if place else None,
        "after": listed[place + 1].segment_id if place + 1 < len(listed) else None,
    }
    if current:
        set_id, horizon, prediction, _ = kept_of(
            app_state.warehouse, app_state.folder, row.vessel, fields.get("set"), fields.get("h")
        )
        if prediction is not None and segment.segment_id in prediction.columns:
            beside = f"/segments/{segment.segment_id}/predicted?set={set_id}&h={horizon}"
            content |= {
                "predicted": beside,
                "set_id": set_id,
                "horizon": dict(HORIZONS).get(horizon, f"{horizon} ahead"),
            }
            content |= {"channels": [*content["channels"], derived()]}
            content["stretch"] = _stretch(prediction, set_id, horizon, fields.get("worst", ""))
    title = f"{span_of(segment)['words']}, {minute(iso_utc(segment.start_utc_ns))} UTC"
    above = ((row.vessel, of_vessel(row.vessel)), (row.file_name, f"/logs/{row.log_id}"))
    return Page("manoeuvre.html", title, content, above)


def _stretch(prediction: KeptPrediction, set_id: str, horizon: str, number: str) -> dict[str, Any] | None:
    """Return which of a model's worst stretches is shown, with the ways to the ones beside it."""
    listed = worst_stretches(prediction.document["where"])
    ordinal = whole_number(number)
    if ordinal is None or not 1 <= ordinal <= len(listed):
        return None
    place = ordinal - 1
    ways = [stretch_address(stretch, set_id, horizon, k + 1) for k, stretch in enumerate(listed)]
    stretch = listed[place]
    return {
        "words": f"{as_words(stretch['channel'])}, {stretch['measure']} ({stretch['sample']})",
        "number": place + 1,
        "of": len(listed),
        "set": set_id,
        "horizon": horizon,
        "before": ways[place - 1] if place else None,
        "after": ways[place + 1] if place + 1 < len(ways) else None,
    }
