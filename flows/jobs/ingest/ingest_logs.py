"""The job that takes raw logs in: read, deposit, find the manoeuvres."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

from kempf.flows.jobs.ingest import search_log, split_logs
from kempf.flows.jobs.ingest.files import opened_log
from kempf.flows.jobs.ingest.find_segments import Ingest
from kempf.flows.jobs.ingest.search_log import SearchedLog, search
from kempf.flows.jobs.ingest.spool import spooled
from kempf.flows.jobs.ingest.unreadable_stretches import as_json
from kempf.flows.jobs.state.former_vessel import former_vessels
from kempf.flows.jobs.state.out_of_date import unsearched
from kempf.flows.jobs.state.unknown_vessel import no_vessel
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.release_memory import give_back
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.channels.doctor.refused import count
from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.ingest.decoded import LostStretch
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.readings import LogReadings, Tally
from kempf.schemas.correction import Correction
from kempf.schemas.errors import KempfError, UsageError
from kempf.schemas.profile import VesselProfile, overlay
from kempf.warehouse.storage.keys import ingest_id, vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import corrections, examinations, logs, lost, segments, vessels
from kempf.warehouse.tables.deposit import Delivery, Deposit, deposit, held
from kempf.warehouse.tables.equivalents import Codes, codes_of
from kempf.warehouse.tables.examinations import StoredExamination
from kempf.warehouse.tables.segments import Segment

_log = logging.getLogger("kempf.jobs")


@dataclass(frozen=True)
class IngestOutcome:
    """What became of one file."""

    #: As given.
    path: str
    #: ``new``, ``reread``, ``unchanged`` or ``failed``.
    outcome: str
    log_id: str | None = None
    ingest_id: str | None = None
    #: Records and values read, kept and rejected.
    tally: Tally | None = None
    #: How it was read, and why manoeuvres could not be looked for, where that is so.
    notes: tuple[str, ...] = ()
    #: Manoeuvres found in this log that models are fitted to: zigzags, then random ones.
    segments: tuple[Segment, ...] = ()
    #: Manoeuvres of other kinds found in it.
    others: tuple[Segment, ...] = ()
    #: What of a damaged log could not be read.
    lost: tuple[LostStretch, ...] = ()
    #: What the channel doctor found in it.
    examination: StoredExamination | None = None
    #: Why a person had removed the log that now counts again; None where nobody had.
    was_removed: str | None = None
    #: Why it failed; then nothing of the log was stored.
    error: KempfError | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the outcome as JSON content."""
        return {
            "path": self.path,
            "outcome": self.outcome,
            "log_id": self.log_id,
            "ingest_id": self.ingest_id,
            "records": _ledger(self.tally, "records"),
            "values": _ledger(self.tally, "values"),
            "rejected_by_reason": dict(self.tally.by_reason) if self.tally else {},
            "notes": list(self.notes),
            "partial": bool(self.lost),
            "lost": as_json(self.lost),
            "segments": [segment.segment_id for segment in self.segments],
            "other_manoeuvres": [{"segment_id": s.segment_id, "kind": s.kind} for s in self.others],
            "channels": _channels(self.examination),
            "was_removed": self.was_removed,
            **(self.error.as_json() if self.error else {}),
        }


def _ledger(tally: Tally | None, of: str) -> dict[str, int] | None:
    if tally is None:
        return None
    return {part: getattr(tally, f"{of}_{part}") for part in ("read", "kept", "rejected")}


def _channels(examination: StoredExamination | None) -> dict[str, Any] | None:
    if examination is None:
        return None
    return {"verdict": examination.verdict, "findings": examination.content.get("findings", [])}


def laid_over(stored: VesselProfile, given: VesselProfile | None, vessel: str) -> VesselProfile:
    """Return the profile that logs of a vessel are read with: what is given is new, what it leaves out stays."""
    return overlay(stored, given or VesselProfile()).model_copy(update={"vessel": vessel})


def settle_vessel(
    warehouse: Warehouse, vessel: str | None, given: VesselProfile | None, *, new_vessel: bool = False
) -> tuple[str, VesselProfile]:
    """Say whose logs they are and with which profile they are read.

    A name that is new beside other vessels is taken for a slip of the hand, unless a profile comes with it.

    Raises
    ------
    UsageError
        ``no_vessel_named``, ``vessel_name``: the name is blank, or ``profiles_disagree``: the option and the profile
        name different vessels.
    NotFound
        ``no_vessel``, ``vessel_renamed``.
    """
    named = given.vessel if given else None
    if vessel is not None and named is not None and vessel != named:
        raise UsageError(
            "profiles_disagree",
            f"The logs are said to be of {vessel!r}, the profile is that of {named!r}.",
            "Make them agree, or leave one of them out.",
            {"option": vessel, "profile": named},
        )
    name = vessel if vessel is not None else named
    if name is None:
        raise UsageError(
            "no_vessel_named",
            "Whose logs are these? No vessel is named, and no profile names her.",
            "Add --vessel NAME; a folder with one folder a vessel is taken in with `kempf inbox FOLDER`.",
        )
    vessel_key(name)  # refuses a name that is none once, not for every log
    known = vessels.profiles(warehouse)
    if known and name not in known and given is None and not new_vessel:
        former = former_vessels(warehouse).get(name)
        if former is not None and former.now is not None:
            raise former.refused(
                f"The vessel {name!r} {former.words}.",
                f"Give --vessel {quote(former.now)}; if another ship has the old name now, say so with --new-vessel.",
            )
        raise no_vessel(
            name,
            known,
            "Correct the name; if she is new, say so with --new-vessel, or give her profile with --profile.",
        )
    return name, laid_over(known.get(name, VesselProfile()), given, name)


def ingest(
    warehouse: Warehouse,
    paths: Sequence[Path],
    vessel: str | None = None,
    given: VesselProfile | None = None,
    progress: Progress = silent,
    *,
    new_vessel: bool = False,
) -> list[IngestOutcome]:
    """Take logs in; one that fails does not stop the others, and leaves nothing behind.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none, with the first log that can be read.
    paths : sequence of Path
        Raw logs.
    vessel : str, optional
        Whose they are; else the profile says so.
    given : VesselProfile, optional
        Laid over the stored profile of the vessel.
    new_vessel : bool, optional
        Whether a vessel of this name that is not known yet is made.

    Returns
    -------
    list of IngestOutcome
        One a path, in order.

    Raises
    ------
    UsageError
        Nobody says whose the logs are, or two say different things.
    NotFound
        ``no_vessel``.
    """
    name, profile = settle_vessel(warehouse, vessel, given, new_vessel=new_vessel)
    outcomes = []
    for done, path in enumerate(paths):
        progress(done, len(paths), f"reading {path.name}")
        try:
            with opened_log(path) as log:
                outcomes.append(ingest_log(warehouse, name, path.name, log, profile, str(path)))
        except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
            outcomes.append(IngestOutcome(str(path), "failed", error=wrapped(error)))
    progress(len(paths), len(paths), "done")
    return _hinted(warehouse, name, outcomes)


def _hinted(warehouse: Warehouse, vessel: str, outcomes: list[IngestOutcome]) -> list[IngestOutcome]:
    """Return the outcomes, with a note at the first of several logs that are parts of one recording."""
    taken = {outcome.log_id for outcome in outcomes if outcome.error is None}
    if len(taken) < 2:
        return outcomes
    hints = split_logs.hints([row for row in logs.current(warehouse, vessel) if row.log_id in taken])
    return [replace(one, notes=(*one.notes, hints[one.log_id])) if one.log_id in hints else one for one in outcomes]


def ingest_log(
    warehouse: Warehouse,
    vessel: str,
    file_name: str,
    log: LogFile,
    profile: VesselProfile,
    path: str,
    known: Mapping[str, logs.LogRow] | None = None,
) -> IngestOutcome:
    """Take one log in.

    Parameters
    ----------
    known : mapping of str to LogRow, optional
        What `logs.find` just returned of the log, where that was asked already.

    Raises
    ------
    KempfError
        The log cannot be read, or is another vessel's; nothing of it was stored.
    """
    codes = codes_of(warehouse)
    before = (logs.find(warehouse, [log.sha256]) if known is None else known).get(log.sha256)
    there = held(warehouse, vessel, file_name, log, before, profile_sha256=profile.sha256, code_version=codes.ingest)
    if there is not None:
        row = logs.of_ingest(warehouse, there.ingest_id)
        if unsearched(warehouse, [row]):
            corrections_by_log = corrections.of_logs(warehouse, [row.log_id])
            search_log.store(
                warehouse, [search_log.search_again(warehouse, row, corrections_by_log.get(row.log_id, ()))]
            )
        stored_segments = tuple(s for s in segments.every(warehouse, vessel) if s.ingest_id == there.ingest_id)
        examination = examinations.of_ingests(warehouse, [row.ingest_id], [row.vessel])[row.ingest_id]
        return _outcome(warehouse, path, "unchanged", row, stored_segments, examination)
    with spooled(file_name, log, profile) as readings:
        give_back(readings.tally.records_read)
        corrections_by_log = corrections.of_logs(warehouse, [log.sha256])
        read = look_through(vessel, file_name, log, profile, readings, corrections_by_log.get(log.sha256, ()), codes)
        give_back(readings.tally.records_read)
        (stored,) = store(warehouse, [read])
    row = logs.of_ingest(warehouse, stored.ingest_id)
    outcome = _outcome(warehouse, path, stored.outcome, row, read.found.segments, read.found.examination)
    return replace(outcome, was_removed=before.removed if before else None)


def _outcome(
    warehouse: Warehouse,
    path: str,
    outcome: str,
    row: logs.LogRow,
    found_segments: tuple[Segment, ...],
    examination: StoredExamination,
) -> IngestOutcome:
    return IngestOutcome(
        path,
        outcome,
        row.log_id,
        row.ingest_id,
        row.tally,
        (*row.notes, *examination.notes),
        tuple(segment for segment in found_segments if segment.is_fitted),
        tuple(segment for segment in found_segments if not segment.is_fitted),
        lost=lost.of_ingests(warehouse, [row.ingest_id]).get(row.ingest_id, ()),
        examination=examination,
    )


@dataclass(frozen=True, eq=False)
class ReadLog:
    """A log that was read and looked through; nothing of it is stored yet."""

    delivery: Delivery
    found: SearchedLog


def look_through(
    vessel: str,
    file_name: str,
    log: LogFile,
    profile: VesselProfile,
    readings: LogReadings,
    log_corrections: Sequence[Correction],
    codes: Codes,
) -> ReadLog:
    """Find the manoeuvres of a log that was read, as a person corrected them, and compare its channels."""
    name = ingest_id(log.sha256, profile.sha256, codes.ingest)
    this_ingest = Ingest(vessel, log.sha256, name, file_name, codes.segment)
    instruments = from_readings(readings.lazy())
    give_back(readings.tally.records_read)
    refused = count(readings.rejections())
    records = readings.tally.records_read
    searched = search(this_ingest, profile, file_name, readings.format, instruments, refused, records, log_corrections)
    _log.info(
        "%s of %s: %d records read, %d kept; %d manoeuvres",
        *(file_name, vessel, records, readings.tally.records_kept, len(searched.segments)),
    )
    return ReadLog(Delivery(vessel, file_name, log, profile, readings, codes.ingest), searched)


def store(warehouse: Warehouse, read: Sequence[ReadLog]) -> list[Deposit]:
    """Store logs that were read, all of them in one commit a table.

    Raises
    ------
    KempfError
        One is another vessel's, or the warehouse cannot be written; then none of them counts.
    """
    # manoeuvres and verdicts before the rows that make the logs count: what a crash leaves in between is not seen, and
    # not missed
    search_log.store(warehouse, [log.found for log in read])
    return deposit(warehouse, [log.delivery for log in read])
