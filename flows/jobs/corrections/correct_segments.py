"""The jobs that correct the manoeuvres of a log as a person says: other bounds, excluded, accepted, added.

What was said is kept in the table of corrections and laid over every search of the log from then on. The sets that
rest on what has changed are superseded; those that follow are made by the next identification of the vessel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from kempf.flows.jobs.corrections.affected_sets import Affected, of_segments
from kempf.flows.jobs.corrections.given_reason import require_reason
from kempf.flows.jobs.ingest import search_log
from kempf.flows.jobs.ingest.search_log import SearchedLog, search_again
from kempf.pipeline.segment.corrections import same, standing
from kempf.schemas.correction import Action, Bounds, Correction
from kempf.schemas.enumeration import as_words
from kempf.schemas.errors import DataRejected, NotFound, UsageError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, corrections, examinations, logs, segments
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True, eq=False)
class Planned:
    """A correction, and what it would change; nothing is stored before `store`."""

    log: LogRow
    segment_id: str | None
    correction: Correction
    #: The manoeuvre as it was, None where one is added, and as it would be.
    before: Segment | None
    after: Segment
    #: What follows for the vessel.
    affected: Affected
    _searched: SearchedLog
    _said: tuple[Correction, ...]

    def store(self, warehouse: Warehouse) -> None:
        """Store the correction and what follows from it."""
        # first what was said: where it ends here, the next reprocessing looks through the log again, and the same
        # command goes on
        before = corrections.of_logs(warehouse, [self.log.log_id]).get(self.log.log_id, ())
        if self.correction.action == "correct" and self.before is not None and self._was_excluded(before):
            raise _excluded(self.before)
        if _with(before, self.correction) != before:
            corrections.add(warehouse, self.log.log_id, self.segment_id, self.correction)
        # before the manoeuvres: once they are otherwise it is not seen any more what rested on them
        if self.affected.current:
            aliases.withdraw(warehouse, self.log.vessel)
        # another person may have corrected the same log meanwhile
        now = corrections.of_logs(warehouse, [self.log.log_id]).get(self.log.log_id, ())
        searched = self._searched if now == self._said else search_again(warehouse, self.log, now)
        search_log.store(warehouse, [searched])

    def _was_excluded(self, now: Sequence[Correction]) -> bool:
        """Return whether another person excluded the manoeuvre since this was planned."""
        subject = self.correction.subject_utc_ns
        return any(known.subject_utc_ns == subject and known.excluded is not None for known in standing(now))

    @property
    def doubts(self) -> tuple[str, ...]:
        """What speaks against the manoeuvre as it would be, sentences."""
        negative = [
            f"{number} ({angle:.1f} deg)" for number, angle in enumerate(self.after.overshoots_deg, 1) if angle < 0.0
        ]
        if self.correction.action not in ("correct", "add") or not negative:
            return ()
        which = f"overshoot {negative[0]} is" if len(negative) == 1 else f"overshoots {', '.join(negative)} are"
        return (
            f"{which} negative: she turned back before she was {self.after.psi0_deg:.3g} deg off the base course; the "
            "bounds may cut a leg or enclose two manoeuvres",
        )

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {
            "action": self.correction.action,
            "reason": self.correction.reason,
            "before": self.before.as_json(self.log.file_name) if self.before else None,
            "after": self.after.as_json(self.log.file_name),
            "following": self.affected.as_json(),
            "doubts": list(self.doubts),
        }


def plan_for(
    warehouse: Warehouse, name: str, action: Action, reason: str, bounds_utc_ns: Bounds | None = None
) -> Planned:
    """Return what a correction of a manoeuvre would change.

    Parameters
    ----------
    name : str
        Beginning of the id of the segment.
    action : {"correct", "exclude", "accept"}
    reason : str
        Why, for those who come after.
    bounds_utc_ns : (int, int), optional
        For ``correct``: first and last instant, UTC nanoseconds.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_segment``; ``manoeuvre_gone``: the present code finds nothing there.
    UsageError
        ``ambiguous_segment``, ``no_reason``, ``nothing_to_correct``, ``not_a_zigzag``, ``segment_excluded``,
        ``bounds_reversed``, ``bounds_outside_log``, ``bounds_overlap``.
    DataRejected
        ``no_legs``: between these bounds is no zigzag.
    """
    require_reason(reason)
    segment = segments.by_prefix(warehouse, name)
    log = logs.of_ingest(warehouse, segment.ingest_id)
    by_hand = segment.detail.get("by_hand")
    if action == "correct" and not segment.is_zigzag:
        raise UsageError(
            "not_a_zigzag",
            f"{segment.segment_id} is a {as_words(segment.kind)}; bounds are given to zigzags only.",
            "Exclude it with `kempf segments exclude`, or add a zigzag with `kempf segments add`.",
            {"segment_id": segment.segment_id, "kind": segment.kind},
        )
    if action == "correct" and segment.excluded is not None:
        raise _excluded(segment)
    last = by_hand["action"] if by_hand else None
    same_again = action == last and (action != "correct" or bounds_utc_ns == (segment.start_utc_ns, segment.end_utc_ns))
    if same_again and _is_looked_through(warehouse, log, segment):
        raise UsageError(
            "nothing_to_correct",
            f"{segment.segment_id} is {_DONE[action]} already: {by_hand['reason'] if by_hand else ''}",
            "Nothing needs to be done.",
            {"segment_id": segment.segment_id, "action": action},
        )
    subject = _subject(segment) or (segment.start_utc_ns, segment.end_utc_ns)
    return _planned(warehouse, log, segment, Correction(action, subject, bounds_utc_ns, reason.strip()))


def plan_new(warehouse: Warehouse, log_name: str, bounds_utc_ns: Bounds, reason: str) -> Planned:
    """Return what would change with a zigzag that the search did not find.

    Parameters
    ----------
    log_name : str
        Beginning of the id of the log, or its file name.
    bounds_utc_ns : (int, int)
        First and last instant, UTC nanoseconds.
    reason : str
        Why, for those who come after.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_log``.
    UsageError
        ``ambiguous_log``, ``no_reason``, ``bounds_reversed``, ``bounds_outside_log``, ``bounds_overlap``.
    DataRejected
        ``no_legs``: between these bounds is no zigzag.
    """
    require_reason(reason)
    log = logs.by_prefix(warehouse, log_name)
    zigzags = [s for s in segments.found_in(warehouse, log.vessel) if s.ingest_id == log.ingest_id and s.is_zigzag]
    held = next((zigzag for zigzag in zigzags if same((zigzag.start_utc_ns, zigzag.end_utc_ns), bounds_utc_ns)), None)
    if held is not None and (_subject(held) != bounds_utc_ns or _is_looked_through(warehouse, log, held)):
        raise UsageError(
            "bounds_overlap",
            f"There is a {as_words(held.kind)} already: {held.segment_id}, {_span(held)}"
            f"{', which was excluded' if held.excluded else ''}.",
            "Give it other bounds with `kempf segments correct`, or let it count with `kempf segments accept`.",
            {"segment_id": held.segment_id},
        )
    return _planned(warehouse, log, None, Correction("add", bounds_utc_ns, bounds_utc_ns, reason.strip()))


def _is_looked_through(warehouse: Warehouse, log: LogRow, segment: Segment) -> bool:
    """Return whether a log was looked through with all that was said of it; else a command was cut off, and goes on."""
    log_corrections = corrections.of_logs(warehouse, [log.log_id]).get(log.log_id, ())
    examination = examinations.of_ingests(warehouse, [log.ingest_id], [log.vessel]).get(log.ingest_id)
    return examination is not None and examination.code_version == corrections.basis(
        segment.code_version, log_corrections
    )


def _excluded(segment: Segment) -> UsageError:
    why = f" ({segment.excluded})" if segment.excluded else ""
    return UsageError(
        "segment_excluded",
        f"{segment.segment_id} is excluded{why}; other bounds would let it count again.",
        "If it shall count, take the exclusion back first with `kempf segments accept`.",
        {"segment_id": segment.segment_id},
    )


_DONE = {"correct": "corrected", "exclude": "excluded", "accept": "accepted"}


def _planned(warehouse: Warehouse, log: LogRow, segment: Segment | None, correction: Correction) -> Planned:
    if correction.bounds_utc_ns is not None:
        _require_within(log, correction.bounds_utc_ns)
    log_corrections = _with(corrections.of_logs(warehouse, [log.log_id]).get(log.log_id, ()), correction)
    searched = search_again(warehouse, log, log_corrections)
    after = next(
        (manoeuvre for manoeuvre in searched.segments if _subject(manoeuvre) == correction.subject_utc_ns), None
    )
    own = (after.start_utc_ns, after.end_utc_ns) if after else None
    if correction.bounds_utc_ns not in (None, own):
        raise DataRejected(
            "no_legs",
            f"From {_time(correction.bounds_utc_ns)} the rudder is not held to one side and then to the other with the "
            "heading following: there is no zigzag to describe.",
            "Give bounds that hold two legs at least.",
            {"log_id": log.log_id},
        )
    if after is None:
        raise NotFound(
            "manoeuvre_gone",
            f"The search finds nothing any more where this manoeuvre was, {_time(correction.subject_utc_ns)}.",
            "Give its bounds with `kempf segments correct`, or bring the log up to date with `kempf reprocess`.",
            {"log_id": log.log_id},
        )
    _refuse_overlap(searched.segments, after)
    held = [manoeuvre for manoeuvre in segments.found_in(warehouse, log.vessel) if manoeuvre.ingest_id == log.ingest_id]
    stays = {manoeuvre.segment_id for manoeuvre in searched.segments if manoeuvre.excluded is None}
    lost = [manoeuvre for manoeuvre in held if manoeuvre.excluded is None and manoeuvre.segment_id not in stays]
    for manoeuvre in lost:
        if manoeuvre.is_zigzag and segment is not None and manoeuvre.segment_id != segment.segment_id:
            raise _overlap(manoeuvre)
    gone = [manoeuvre.segment_id for manoeuvre in lost]
    return Planned(
        log,
        segment.segment_id if segment else None,
        correction,
        segment,
        after,
        of_segments(warehouse, log.vessel, gone),
        searched,
        log_corrections,
    )


def _require_within(log: LogRow, bounds: Bounds) -> None:
    start, end = bounds
    if start >= end:
        raise UsageError(
            "bounds_reversed",
            f"The end, {iso_utc(end)}, is not after the start, {iso_utc(start)}.",
            "Give the start first.",
        )
    if start < log.start_utc_ns or end > log.end_utc_ns:
        raise UsageError(
            "bounds_outside_log",
            f"{log.file_name} goes from {iso_utc(log.start_utc_ns)} to {iso_utc(log.end_utc_ns)}; the bounds are "
            f"{iso_utc(start)} to {iso_utc(end)}.",
            "Give bounds within the log.",
            {"log_id": log.log_id},
        )


def _refuse_overlap(manoeuvres: Sequence[Segment], corrected: Segment) -> None:
    """Refuse bounds under which two zigzags would share readings: they would be fitted twice."""
    zigzags = sorted((s for s in manoeuvres if s.is_zigzag and s.excluded is None), key=lambda s: s.start_utc_ns)
    for earlier, later in pairwise(zigzags):
        if earlier.end_utc_ns > later.start_utc_ns and corrected.segment_id in (earlier.segment_id, later.segment_id):
            beside = later if earlier.segment_id == corrected.segment_id else earlier
            raise _overlap(beside)


def _overlap(beside: Segment) -> UsageError:
    return UsageError(
        "bounds_overlap",
        f"These bounds overlap the zigzag {beside.segment_id}, {_span(beside)}.",
        "Give bounds that do not, or exclude that one first with `kempf segments exclude`.",
        {"segment_id": beside.segment_id},
    )


def _with(log_corrections: Sequence[Correction], correction: Correction) -> tuple[Correction, ...]:
    """Return what was said of a log with one more; a command that was killed and is repeated says nothing more."""
    on_subject = [entry for entry in log_corrections if entry.subject_utc_ns == correction.subject_utc_ns]
    return tuple(log_corrections) if on_subject and on_subject[-1] == correction else (*log_corrections, correction)


def _subject(segment: Segment) -> Bounds | None:
    """Return the bounds of the manoeuvre that a correction was said of; None where nobody said anything."""
    by_hand = segment.detail.get("by_hand")
    return (by_hand["subject"]["start_utc_ns"], by_hand["subject"]["end_utc_ns"]) if by_hand else None


def _time(bounds: Bounds) -> str:
    return f"{iso_utc(bounds[0])} to {iso_utc(bounds[1])}"


def _span(segment: Segment) -> str:
    return _time((segment.start_utc_ns, segment.end_utc_ns))
