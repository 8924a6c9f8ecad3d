"""A note that a form writes."""

from __future__ import annotations

from collections.abc import Mapping

from kempf.flows.jobs.corrections.subject_of_note import subject_of
from kempf.schemas.errors import UsageError
from kempf.warehouse.tables import notes
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.form_numbers import number_of
from kempf.workbench.web.window import instant

#: letters that a note may have
MOST = 2000
_PAGES = {"log": "/logs/", "segment": "/segments/", "set": "/sets/"}


def write(app_state: AppState, form: Mapping[str, str]) -> str:
    """Store a note, and return the address of what it is on.

    Parameters
    ----------
    form : mapping of str to str
        ``vessel``, or ``log``, ``segment`` or ``set``; ``text``, ``at``, ``draught``.

    Raises
    ------
    UsageError
        ``note_too_long``, ``instant_unreadable``, ``number_unreadable``; and what
        `kempf.warehouse.tables.notes.add` raises.
    """
    text = form.get("text", "")
    if len(text) > MOST:
        raise UsageError(
            "note_too_long", f"The note has {len(text)} letters; at most {MOST} are kept.", "Write it shorter."
        )
    named = (form.get(name) or None for name in ("vessel", "log", "segment", "set"))
    whose, subject, subject_id = subject_of(app_state.warehouse, *named)
    at = form.get("at", "").strip()
    notes.add(
        app_state.warehouse,
        whose,
        subject,
        subject_id,
        text,
        event_utc_ns=instant(at) if at else None,
        draught_m=number_of(form.get("draught", ""), "draught", "metres"),
    )
    return of_vessel(whose) + "#notes" if subject == "vessel" else _PAGES[subject] + subject_id
