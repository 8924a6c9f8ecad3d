"""Notes of people on vessels, logs, segments and parameter sets: docked, another draught, a sensor replaced."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, Protocol

from kempf.schemas.errors import UsageError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage import append_only, delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse

#: how the text of a note ends that was carried to another vessel
_CARRIED = re.compile(r", note ([0-9]+)\]$")

Subject = Literal["vessel", "log", "segment", "set"]


class LogStretch(Protocol):
    """A stretch of a log, such as a manoeuvre."""

    @property
    def log_id(self) -> str:
        """Which log."""

    @property
    def start_utc_ns(self) -> int:
        """Where it begins, UTC nanoseconds."""


@dataclass(frozen=True)
class Note:
    """One note as it is kept."""

    #: Its place in the table, from 1.
    number: int
    vessel: str
    subject: Subject
    #: The vessel's name, or an id.
    subject_id: str
    text: str
    #: When it happened, UTC nanoseconds; None where nobody said.
    event_utc_ns: int | None = None
    #: m; None where it states none.
    draught_m: float | None = None
    #: When it was written; None before it is.
    written: datetime | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the note as JSON content."""
        return {
            "number": self.number,
            "written": self.written.isoformat().replace("+00:00", "Z") if self.written else None,
            "vessel": self.vessel,
            "subject": self.subject,
            "subject_id": self.subject_id,
            "at": iso_utc(self.event_utc_ns) if self.event_utc_ns is not None else None,
            "draught_m": self.draught_m,
            "text": self.text,
        }


def add(
    warehouse: Warehouse,
    vessel: str,
    subject: Subject,
    subject_id: str,
    text: str,
    *,
    event_utc_ns: int | None = None,
    draught_m: float | None = None,
) -> Note:
    """Store a note on something that is there.

    Parameters
    ----------
    vessel : str
        Whose the subject is.
    subject_id : str
        The vessel's name, or the whole id of the log, segment or set.
    event_utc_ns : int, optional
        When what it is about happened, UTC nanoseconds.
    draught_m : float, optional
        The draught that it states, m.

    Raises
    ------
    UsageError
        ``empty_note``; ``draught_not_positive``.
    """
    if not text.strip():
        raise UsageError("empty_note", "The note is blank.", "Write what the next person should know.")
    if draught_m is not None and not 0.0 < draught_m < 50.0:
        raise UsageError(
            "draught_not_positive",
            f"A draught of {draught_m:g} m is none; expected more than 0 and less than 50 m.",
            "Give it in metres.",
            {"draught_m": draught_m},
        )
    row = _as_row(vessel, subject, subject_id, text.strip(), event_utc_ns, draught_m)
    number = append_only.add(warehouse, "notes", row)
    return Note(number, vessel, subject, subject_id, text.strip(), event_utc_ns, draught_m, _written(warehouse, number))


def _as_row(
    vessel: str, subject: Subject, subject_id: str, text: str, event_utc_ns: int | None, draught_m: float | None
) -> dict[str, Any]:
    return {
        "vessel_key": vessel_key(vessel),
        "vessel": vessel,
        "subject": subject,
        "subject_id": subject_id,
        "event_utc_ns": event_utc_ns,
        "draught_m": draught_m,
        "text": text,
    }


def of_vessel(warehouse: Warehouse, vessel: str | None = None, as_of: datetime | None = None) -> list[Note]:
    """Return the notes on one vessel and what is hers, or all, in the order in which they were written.

    Parameters
    ----------
    as_of : datetime, optional
        With a time zone: only those that are known to have been written by then.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    where = {} if vessel is None else {"vessel_key": vessel_key(vessel)}
    when = append_only.times(warehouse, "notes")
    every = [
        Note(
            row["number"],
            row["vessel"],
            row["subject"],
            row["subject_id"],
            row["text"],
            row["event_utc_ns"],
            row["draught_m"],
            when.get(row["number"]),
        )
        for row in delta.read(warehouse, "notes", where).sort("number").rows(named=True)
    ]
    return [note for note in every if as_of is None or (note.written is not None and note.written <= as_of)]


def carry(
    warehouse: Warehouse, subjects: Collection[tuple[Subject, str]], vessel: str, to: str, every: Sequence[Note]
) -> None:
    """Write the notes on a vessel, logs or manoeuvres again for the vessel that takes her place; the old ones stay.

    What she has already is left out, so that an interrupted move goes on and one there and back adds nothing.

    Parameters
    ----------
    subjects : collection of tuple of Subject and str
        Each with the vessel's old name, or the id of the log or segment.
    vessel : str
        Whose notes they are.
    to : str
        Whose they are to be.
    every : sequence of Note
        The notes of all vessels.
    """
    by_number = {note.number: note for note in every}
    new_id = {subject: to if subject[0] == "vessel" else subject[1] for subject in subjects}
    new_subjects = {(kind, new_id[kind, old]) for kind, old in new_id}
    there = {
        (note.subject, note.subject_id, origin(by_number, note).number)
        for note in every
        if note.vessel == to and (note.subject, note.subject_id) in new_subjects
    }
    for note in every:
        subject = (note.subject, note.subject_id)
        if note.vessel != vessel or subject not in new_id:
            continue
        first = origin(by_number, note)
        place = (note.subject, new_id[subject], first.number)
        if place not in there:
            there.add(place)
            row = _as_row(to, note.subject, new_id[subject], _carried(first), note.event_utc_ns, note.draught_m)
            append_only.add(warehouse, "notes", row)


def with_origins(warehouse: Warehouse, among: Sequence[Note]) -> dict[int, Note]:
    """Return notes of one vessel by number, with those of all others where one of hers may have been carried to her."""
    by_number = {note.number: note for note in among}
    carried = ((note.number, _CARRIED.search(note.text)) for note in among)
    if any(found and int(found[1]) < number and int(found[1]) not in by_number for number, found in carried):
        return {note.number: note for note in of_vessel(warehouse)}
    return by_number


def origin(by_number: Mapping[int, Note], note: Note) -> Note:
    """Return the note that a person wrote, of one that was carried to another vessel; any other is its own.

    Parameters
    ----------
    by_number : mapping of int to Note
        The notes of all vessels, or what `with_origins` returns.
    """
    carried = _CARRIED.search(note.text)
    before = by_number.get(int(carried[1])) if carried else None
    if before is None or before.number >= note.number:
        return note
    is_its = note.subject == before.subject and note.text == _carried(before)
    return origin(by_number, before) if is_its else note


def _carried(note: Note) -> str:
    return f"{note.text} [{note.vessel}, note {note.number}]"


def draughts_m(among: Sequence[Note], sailed: Iterable[LogStretch]) -> dict[str, float]:
    """Return the draught of logs as notes have it.

    A note on a log is the log's, the newest one counts; else the last one on the vessel that is dated no later than the
    first stretch of the log begins.

    Parameters
    ----------
    among : sequence of Note
        Of one vessel, in the order in which they were written.
    sailed : iterable of LogStretch
        Stretches of the logs that are asked for.

    Returns
    -------
    dict of str to float
        m, by log; a log that no note speaks of is left out.
    """
    began_utc_ns: dict[str, int] = {}
    for stretch in sailed:
        first = began_utc_ns.get(stretch.log_id, stretch.start_utc_ns)
        began_utc_ns[stretch.log_id] = min(stretch.start_utc_ns, first)
    stating = [note for note in among if note.draught_m is not None]
    own = {note.subject_id: note.draught_m for note in stating if note.subject == "log"}
    dated = [
        (note.event_utc_ns, note.number, note.draught_m)
        for note in stating
        if note.subject == "vessel" and note.event_utc_ns is not None
    ]
    draughts = {}
    for log, began in began_utc_ns.items():
        before = max((entry for entry in dated if entry[0] <= began), default=(0, 0, None))
        draught = own.get(log, before[2])
        if draught is not None:
            draughts[log] = draught
    return draughts


def _written(warehouse: Warehouse, number: int) -> datetime | None:
    return append_only.times(warehouse, "notes").get(number)
