"""What a note is on: a vessel, or a log, a manoeuvre or a parameter set of hers."""

from __future__ import annotations

from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets, segments, vessels
from kempf.warehouse.tables.notes import Subject


def subject_of(
    warehouse: Warehouse, vessel: str | None, log: str | None, segment: str | None, set_id: str | None
) -> tuple[str, Subject, str]:
    """Return whose the subject of a note is, what it is, and its whole id.

    Parameters
    ----------
    vessel : str or None
        The subject itself where nothing else is named; else whose that has to be.
    log, segment, set_id : str or None
        Beginning of an id, at most one of the three.

    Raises
    ------
    NotFound
        ``no_vessel``, ``no_log``, ``no_segment``, ``no_parameter_set``.
    UsageError
        ``no_subject``, ``subject_of_another_vessel``, and of the ids what is ambiguous.
    """
    subject: Subject
    if log is not None:
        row = logs.by_prefix(warehouse, log)
        whose, subject, subject_id = row.vessel, "log", row.log_id
    elif segment is not None:
        manoeuvre = segments.by_prefix(warehouse, segment)
        whose, subject, subject_id = manoeuvre.vessel, "segment", manoeuvre.segment_id
    elif set_id is not None:
        stored = parameter_sets.get(warehouse, set_id)
        whose, subject, subject_id = stored.vessel, "set", stored.parameter_set_id
    elif vessel is not None:
        vessels.require(warehouse, vessel)
        return vessel, "vessel", vessel
    else:
        raise UsageError("no_subject", "What is the note on?", "Give --vessel, --log, --segment or --set.")
    if vessel is not None and vessel != whose:
        raise UsageError(
            "subject_of_another_vessel",
            f"That {subject} is of {whose!r}, not of {vessel!r}.",
            "Leave --vessel out, or give the id of one of hers.",
            {"subject_id": subject_id, "vessel": whose},
        )
    return whose, subject, subject_id
