"""The job that empties an inbox: what is new is ingested, what cannot be placed or read is put into quarantine."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from shlex import quote
from typing import Any

from kempf.flows.jobs.inbox.inbox_place import Register
from kempf.flows.jobs.inbox.inbox_remarks import remarks
from kempf.flows.jobs.ingest.files import PROFILES, profile_of, whole
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome, ingest_log, laid_over
from kempf.flows.jobs.state.former_vessel import former_vessels
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.profile import VesselProfile, merge
from kempf.warehouse.code import code_version
from kempf.warehouse.sources.source_folder import SourceFile, SourceFolder
from kempf.warehouse.storage.canonical import canonical_json, sha256
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import inbox, logs, purges, vessels
from kempf.warehouse.tables.inbox import InboxFile
from kempf.warehouse.tables.logs import LogRow

_log = logging.getLogger("kempf.jobs")

#: a file that was written less than so many seconds ago may still be being written
SETTLE_S = 60.0
#: errors that are the warehouse's or the inbox's and no file's: the run ends with them
_NO_FILES = (
    *("disk_full", "warehouse_not_writable", "warehouse_unreachable", "table_unreadable", "table_damaged"),
    *("warehouse_busy", "warehouse_layout", "warehouse_layout_old", "warehouse_migrating"),
    *("warehouse_marker_damaged", "inbox_unreadable"),
)
#: errors that may be gone at the next attempt though the file is the same
_PASSING = ("file_unreadable", "no_such_file", "log_unreadable", "internal")
#: files whose outcome is stored together
_TOGETHER = 50
#: what rosbag2 writes beside the files of a bag, which is no log, and how these end
_BAG_DESCRIPTION, _OF_BAGS = "metadata.yaml", (".mcap", ".mcap.zstd", ".mcap.zst", ".mcap.gz")


@dataclass(frozen=True)
class InboxRun:
    """What became of an inbox."""

    address: str
    #: Of every file that was new, in the order of their paths.
    ingested: tuple[IngestOutcome, ...]
    #: All that is in quarantine below this inbox now, whether it was put there by this run or before.
    quarantined: tuple[InboxFile, ...]
    #: Of these, addresses of those that this run put there or tried again in vain.
    tried: frozenset[str]
    #: Paths of files that were written a moment ago, or whose folder's profile cannot be read.
    waiting: tuple[str, ...]
    #: Files that were known and have not changed.
    known: int
    #: Of these that this run looked at, files with the bytes of a log that a person removed; they were left alone.
    removed: tuple[InboxFile, ...] = ()
    #: What is strange about the inbox itself, a sentence each.
    remarks: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the run as JSON content."""
        return {
            "inbox": self.address,
            "ingested": [outcome.as_json() for outcome in self.ingested],
            "quarantined": [{**quarantine_json(file), "new": file.address in self.tried} for file in self.quarantined],
            "waiting": list(self.waiting),
            "known": self.known,
            "removed": [{**quarantine_json(file), "log_id": file.log_id} for file in self.removed],
            "remarks": list(self.remarks),
        }


class NeedsAPerson(DataRejected):
    """Files of an inbox are in quarantine; all others are in.

    Parameters
    ----------
    run : InboxRun
        Kept in ``details``.
    """

    def __init__(self, run: InboxRun) -> None:
        names = [PurePosixPath(file.address).name for file in run.quarantined]
        count = counted(len(names), "file")
        super().__init__(
            "files_in_quarantine",
            f"{count} of {run.address} cannot be placed or read: {', '.join(names[:5])}{' ...' if names[5:] else ''}.",
            "`kempf logs quarantine` says of each why, and what to do.",
            run.as_json(),
        )


def quarantine_json(file: InboxFile) -> dict[str, Any]:
    """Return a file that was not ingested as JSON content."""
    return {
        "file": file.address,
        "size_bytes": file.size_bytes,
        "vessel": file.vessel,
        "code": file.code,
        "message": file.message,
        "next_step": file.next_step,
    }


def take_inbox(
    warehouse: Warehouse,
    folder: SourceFolder,
    progress: Progress = silent,
    *,
    new_vessels: bool = False,
    settle_s: float = SETTLE_S,
) -> InboxRun:
    """Ingest what is new in an inbox; what cannot be placed or read goes into quarantine and stops nothing else.

    A file in quarantine is tried again where it, her profile, or the code that reads logs has changed. Nothing in the
    inbox is moved or deleted.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none, with the first log that can be read.
    folder : SourceFolder
        One folder a vessel, or files that a pattern in a profile places.
    new_vessels : bool, optional
        Whether the folder of a vessel that is not known makes one; else her profile must lie in it.
    settle_s : float, optional
        Files written less than so many seconds ago are left for the next run.

    Raises
    ------
    KempfError
        What `SourceFolder.list` raises; ``disk_full``, ``warehouse_not_writable``, ...: no file's fault.
    """
    listing = folder.list()
    files = listing.files
    before = inbox.below(warehouse, folder.address)
    folders = _read_folders(folder, files)
    register = Register(vessels.profiles(warehouse), folders.profiles, new_vessels, former_vessels(warehouse))
    logs_in_it, waiting = _logs_in(files, folders, settled_ns=time.time_ns() - round(settle_s * 1e9))
    due = [_placed(register, file) for file in logs_in_it]
    todo = [arrival for arrival in due if arrival.is_new(before.get(arrival.file.address))]
    _log.info(
        "inbox %s: %d files to look at, %d known, %d left for the next run",
        *(folder.address, len(todo), len(due) - len(todo), len(waiting)),
    )
    rows = [*folders.rows(before), *_gone(files, before)]
    if before and inbox.was_empty(folder.address, before) == bool(files):
        rows.append(inbox.emptied(folder.address, empty=not files))
    taken, outcomes = _take_all(warehouse, folder, todo, rows, progress)
    _register(warehouse, folders.profiles)
    held = [row for row in inbox.below(warehouse, folder.address).values() if row.outcome == "quarantined"]
    tried = {arrival.file.address for arrival in todo} | {file.address for file, _ in folders.unreadable.values()}
    return InboxRun(
        folder.address,
        outcomes,
        tuple(sorted(held, key=lambda row: row.address)),
        frozenset(tried),
        waiting,
        len(due) - len(todo),
        tuple(row for row in taken if row.outcome == "removed"),
        tuple(remarks(folder.address, listing, before)),
    )


def _logs_in(
    files: Sequence[SourceFile], folders: _Folders, settled_ns: int
) -> tuple[list[SourceFile], tuple[str, ...]]:
    """Return what of an inbox may be a log, and the paths of what is left for the next run: see `InboxRun.waiting`."""
    ready, waiting = [], []
    bags = {_beside_what(file) for file in files if file.name.endswith(_OF_BAGS)}
    for file in files:
        if file.address in folders.files or (file.name == _BAG_DESCRIPTION and _beside_what(file) in bags):
            continue
        if file.folder in folders.unreadable or file.modified_utc_ns > settled_ns:
            waiting.append(file.path)
        else:
            ready.append(file)
    return ready, tuple(waiting)


def _take_all(
    warehouse: Warehouse, folder: SourceFolder, todo: Sequence[Placed], beside: Sequence[InboxFile], progress: Progress
) -> tuple[list[InboxFile], tuple[IngestOutcome, ...]]:
    """Ingest files, and record what became of them with the rows that are to be recorded in any case, some at a time.

    Returns
    -------
    (list of InboxFile, tuple of IngestOutcome)
        A row of each file, and what was ingested.
    """
    rows, taken, outcomes = list(beside), [], []
    for done, arrival in enumerate(todo):
        progress(done, len(todo), f"reading {arrival.file.name}")
        row, outcome = take(warehouse, folder, arrival)
        taken.append(row)
        rows.append(row)
        if outcome is not None:
            outcomes.append(outcome)
        if len(rows) >= _TOGETHER:
            inbox.record(warehouse, rows)
            rows = []
    inbox.record(warehouse, rows)
    progress(len(todo), len(todo), "done")
    return taken, tuple(outcomes)


def _beside_what(file: SourceFile) -> str:
    """Return the folder that a file lies in, below the inbox."""
    return file.path.rpartition("/")[0]


def _gone(files: Sequence[SourceFile], before: Mapping[str, InboxFile]) -> list[InboxFile]:
    """Return the rows that end the quarantine of files that were moved, renamed or deleted, until they return."""
    there = {file.address for file in files}
    left = [row for row in before.values() if row.outcome == "quarantined" and row.address not in there]
    return [replace(row, outcome="gone", message=inbox.NO_LONGER_THERE, next_step=None) for row in left]


@dataclass(frozen=True, eq=False)
class _Folders:
    """The profiles that lie in the folders of an inbox, by folder."""

    profiles: Mapping[str, VesselProfile]
    unreadable: Mapping[str, tuple[SourceFile, KempfError]]
    #: By address.
    files: Mapping[str, SourceFile]

    def rows(self, before: Mapping[str, InboxFile]) -> list[InboxFile]:
        """Return what is to be stored of them: those that cannot be read, and those that could not before."""
        broken = [_quarantined(file, None, error, None) for file, error in self.unreadable.values()]
        bad = {row.address for row in broken}
        repaired = [
            InboxFile(file.address, file.size_bytes, file.modified_utc_ns, "ingested")
            for file in self.files.values()
            if file.address in before and file.address not in bad
        ]
        return broken + repaired


def _read_folders(folder: SourceFolder, files: Sequence[SourceFile]) -> _Folders:
    """Read the profiles that lie in the folders of an inbox."""
    read: dict[str, VesselProfile] = {}
    unreadable: dict[str, tuple[SourceFile, KempfError]] = {}
    there = [file for file in files if file.name in PROFILES and file.path.count("/") == (1 if file.folder else 0)]
    for file in there:
        try:
            with folder.opened(file) as stream:
                profile = profile_of(whole(LogFile(stream), file.address, "vessel profile"), file.address)
            read[file.folder] = merge([*_beside(read, file), (file.address, profile)])
        except KempfError as error:
            if error.code in _NO_FILES:
                raise
            unreadable.setdefault(file.folder, (file, error))
    good = {name: profile for name, profile in read.items() if name not in unreadable}
    return _Folders(good, unreadable, {file.address: file for file in there})


def _beside(read: Mapping[str, VesselProfile], file: SourceFile) -> list[tuple[str, VesselProfile]]:
    return [(f"another profile of the folder {file.folder}", read[file.folder])] if file.folder in read else []


@dataclass(frozen=True, eq=False)
class Placed:
    """A file, with whose it is and how it is to be read; or why it cannot be placed."""

    file: SourceFile
    vessel: str | None = None
    profile: VesselProfile | None = None
    error: KempfError | None = None

    @property
    def basis(self) -> str:
        """Hash of what decides what becomes of it, beside its bytes."""
        return sha256(
            canonical_json(
                [
                    self.vessel,
                    self.profile.sha256 if self.profile else None,
                    self.error.message if self.error else None,
                    code_version.fingerprint("ingest"),
                ]
            )
        )[:16]

    def is_new(self, known: InboxFile | None) -> bool:
        """Return whether it is to be looked at: it is new or back, was written since, or may be read now."""
        if known is None or known.outcome == "gone":
            return True
        if (known.size_bytes, known.modified_utc_ns) != (self.file.size_bytes, self.file.modified_utc_ns):
            return True
        return known.outcome == "quarantined" and (known.basis != self.basis or known.code in _PASSING)


def _placed(register: Register, file: SourceFile) -> Placed:
    try:
        place = register.place(file)
    except KempfError as error:
        return Placed(file, error=error)
    stored = register.known.get(place.vessel, VesselProfile())
    return Placed(file, place.vessel, laid_over(stored, place.given, place.vessel))


def take(
    warehouse: Warehouse, folder: SourceFolder, arrival: Placed, *, by_hand: bool = False
) -> tuple[InboxFile, IngestOutcome | None]:
    """Ingest one file; where it cannot be placed or read, return the row that puts it into quarantine.

    Parameters
    ----------
    by_hand : bool, optional
        Whether a person asks for this very file; else one with the bytes of a log that was removed is left alone.

    Raises
    ------
    KempfError
        ``disk_full``, ``warehouse_not_writable``, ...: no file's fault.
    """
    file = arrival.file
    try:
        if arrival.error is not None or arrival.vessel is None or arrival.profile is None:
            assert arrival.error is not None
            raise arrival.error
        with folder.opened(file) as stream:
            log = LogFile(stream)
            known = logs.find(warehouse, [log.sha256])
            gone = None if by_hand else _removed(warehouse, known.get(log.sha256))
            if gone is not None:
                return _left_alone(arrival, gone), None
            outcome = ingest_log(warehouse, arrival.vessel, file.name, log, arrival.profile, file.address, known)
    except Exception as error:  # whatever it is, the next log must not pay for it
        failure = wrapped(error)
        if failure.code in _NO_FILES:
            raise failure from error
        _log.info("%s: into quarantine: [%s] %s", file.path, failure.code, failure.message)
        return _quarantined(file, arrival.vessel, failure, arrival.basis), None
    row = InboxFile(
        *(file.address, file.size_bytes, file.modified_utc_ns, "ingested", arrival.vessel, outcome.log_id),
        basis=arrival.basis,
    )
    return row, outcome


def _removed(warehouse: Warehouse, row: LogRow | None) -> LogRow | None:
    """Return the last row of a log where a person removed it; None of any other, and of one that was purged."""
    return None if row is None or row.removed is None or purges.of_logs(warehouse, [row.log_id]) else row


def _left_alone(arrival: Placed, row: LogRow) -> InboxFile:
    back = f"`kempf logs restore {row.log_id[:12]}` brings it back"
    if arrival.vessel is not None and arrival.vessel != row.vessel:
        given = f"`kempf logs move {row.log_id[:12]} --vessel {quote(arrival.vessel)} --reason TEXT`"
        back += f"; {given} makes it a log of {arrival.vessel!r}"
    return InboxFile(
        *(arrival.file.address, arrival.file.size_bytes, arrival.file.modified_utc_ns, "removed"),
        *(arrival.vessel, row.log_id),
        code="log_removed",
        message=f"It is the log {row.file_name} of {row.vessel!r}, which was removed: {row.removed}.",
        next_step=f"It is left alone. {back}.",
        basis=arrival.basis,
    )


def _quarantined(file: SourceFile, vessel: str | None, error: KempfError, basis: str | None) -> InboxFile:
    return InboxFile(
        *(file.address, file.size_bytes, file.modified_utc_ns, "quarantined", vessel),
        code=error.code,
        message=error.message,
        next_step=error.next_step,
        basis=basis,
    )


def _register(warehouse: Warehouse, of_folder: Mapping[str, VesselProfile]) -> None:
    """Make what the folders' profiles say of known vessels current, also where no log of theirs is new."""
    stored = vessels.profiles(warehouse)
    named = [(profile.vessel or folder, profile) for folder, profile in of_folder.items()]
    vessels.register_all(
        warehouse, [(name, laid_over(stored[name], profile, name)) for name, profile in named if name in stored]
    )
