"""The jobs that undo an ingest: a log is removed, restored, or given to another vessel. Nothing is deleted.

What a removed log led to stays readable as of the time before: its segments are found no longer, and every set that
rests on it is superseded. The vessel's own sets follow with her next reprocessing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from shlex import quote

from kempf.flows.jobs.corrections.affected_sets import Affected, of_logs
from kempf.flows.jobs.corrections.given_reason import require_reason
from kempf.flows.jobs.ingest.ingest_logs import look_through, settle_vessel, store
from kempf.flows.jobs.ingest.spool import spooled
from kempf.flows.jobs.state.former_vessel import former_vessels, reason_of_move, reason_of_rename
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, corrections, logs, notes, purges, raw, segments, vessels
from kempf.warehouse.tables.deposit import description
from kempf.warehouse.tables.equivalents import codes_of
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.notes import Note, Subject


def remove(warehouse: Warehouse, rows: Sequence[LogRow], reason: str) -> Affected:
    """Let logs of one vessel count no longer.

    Parameters
    ----------
    rows : sequence of LogRow
        Current ones of one vessel, at least one.
    reason : str
        Why, for those who come after.

    Raises
    ------
    UsageError
        ``no_reason``.
    """
    require_reason(reason)
    affected = of_logs(warehouse, rows)
    # first: once the logs count no longer the same command has nothing to go on with
    if affected.current:
        aliases.withdraw(warehouse, affected.vessel)
    _mark(warehouse, rows, reason)
    return affected


def _mark(warehouse: Warehouse, rows: Sequence[LogRow], reason: str | None) -> None:
    """Let logs count no longer, or again: in their register, and beside the raw logs."""
    logs.mark(warehouse, [row.log_id for row in rows], reason)
    for row in rows:
        profile = vessels.get(warehouse, row.profile_sha256)
        raw.describe(warehouse, row.log_id, description(replace(row, removed=reason), profile))


def restore(warehouse: Warehouse, name: str) -> LogRow:
    """Let a log that was removed count again; where its vessel was removed too, so does she.

    Parameters
    ----------
    name : str
        Beginning of its id, or its file name.

    Raises
    ------
    NotFound
        ``no_log``: none that was removed has this name. ``vessel_renamed``: its vessel has another name now.
    UsageError
        ``ambiguous_log``.
    DataRejected
        ``log_purged``.
    """
    row = logs.by_prefix(warehouse, name, removed=True)
    purges.refuse(warehouse, [row.log_id])
    former = former_vessels(warehouse).get(row.vessel)
    if former is not None and former.now is not None:
        raise former.refused(
            f"{row.file_name} was a log of {row.vessel!r}, which {former.words}.",
            f"`kempf logs move {row.log_id[:12]} --vessel {quote(former.now)} --reason TEXT` makes it hers.",
        )
    vessels.bring_back(warehouse, row.vessel)
    _mark(warehouse, [row], None)
    return logs.by_prefix(warehouse, row.log_id)


def move(
    warehouse: Warehouse,
    name: str,
    vessel: str,
    reason: str,
    *,
    new_vessel: bool = False,
    every_note: Sequence[Note] | None = None,
) -> tuple[Affected | None, LogRow]:
    """Give a log to another vessel: it is removed from the one and read from its bytes for the other.

    Where the move is interrupted the log is the old vessel's, or nobody's; the same command goes on.

    Parameters
    ----------
    name : str
        Beginning of its id, or its file name.
    vessel : str
        Whose it is.
    reason : str
        Why it was another one's.
    new_vessel : bool, optional
        Whether a vessel of this name that is not known yet is made.
    every_note : sequence of Note, optional
        The notes of all vessels, where they are read already.

    Returns
    -------
    affected : Affected or None
        What follows for the vessel it was taken from; None where it was removed before.
    row : LogRow
        The log as it is now.

    Raises
    ------
    NotFound
        ``no_log``, ``no_vessel``.
    UsageError
        ``ambiguous_log``, ``no_reason``, ``log_is_hers``.
    KempfError
        It cannot be read with the other vessel's profile; then nothing has changed.
    """
    require_reason(reason)
    row = held_or_removed(warehouse, name)
    whose, profile = settle_vessel(warehouse, vessel, None, new_vessel=new_vessel)
    if row.vessel == whose and row.removed is None:
        raise UsageError(
            "log_is_hers",
            f"{row.file_name} is a log of {whose!r} already.",
            "Nothing needs to be done.",
            {"log_id": row.log_id, "vessel": whose},
        )
    with raw.opened(warehouse, row.log_id) as log, spooled(row.file_name, log, profile) as readings:
        log_corrections = corrections.of_logs(warehouse, [row.log_id]).get(row.log_id, ())
        read = look_through(whose, row.file_name, log, profile, readings, log_corrections, codes_of(warehouse))
        # first: once the log is hers the same command has nothing to go on with
        every = notes.of_vessel(warehouse) if every_note is None else every_note
        notes.carry(warehouse, _noted(warehouse, row.vessel, {row.log_id}, every), row.vessel, whose, every)
        affected = remove(warehouse, [row], reason_of_move(whose, reason)) if row.removed is None else None
        store(warehouse, [read])
    return affected, logs.by_prefix(warehouse, row.log_id)


def _noted(
    warehouse: Warehouse, vessel: str, log_ids: Collection[str], every: Sequence[Note]
) -> list[tuple[Subject, str]]:
    """Return what notes of a vessel are on, of some logs and their manoeuvres; the ids stay whosever a log is."""
    hers = {(note.subject, note.subject_id) for note in every if note.vessel == vessel}
    names = {name for subject, name in hers if subject == "segment"}
    by_id = segments.by_ids(warehouse, vessel, names) if names else {}
    log_of = {("segment", name): segment.log_id for name, segment in by_id.items()}
    return [one for one in sorted(hers) if (one[1] if one[0] == "log" else log_of.get(one)) in log_ids]


def _on_their_way(warehouse: Warehouse, vessel: str, to: str) -> list[LogRow]:
    """Return the logs of a vessel whose move to another one was cut off: they are nobody's."""
    rows = [row for row in logs.removed(warehouse, vessel) if (row.removed or "").startswith(reason_of_move(to, ""))]
    last = logs.find(warehouse, [row.log_id for row in rows])
    return [row for row in rows if last[row.log_id].ingest_id == row.ingest_id]


def held_or_removed(warehouse: Warehouse, name: str) -> LogRow:
    """Return a log by a beginning of its id or by its file name, else one that was removed.

    Raises
    ------
    NotFound
        ``no_log``.
    UsageError
        ``ambiguous_log``.
    """
    try:
        return logs.by_prefix(warehouse, name)
    except NotFound as error:
        try:
            return logs.by_prefix(warehouse, name, removed=True)
        except NotFound:
            raise error from None


def remove_vessel(warehouse: Warehouse, vessel: str, reason: str) -> Affected | None:
    """Let a vessel and all her logs count no longer.

    Returns
    -------
    Affected or None
        What follows for her logs; None where she has none.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    UsageError
        ``no_reason``.
    """
    require_reason(reason)
    vessels.require(warehouse, vessel)
    held = logs.current(warehouse, vessel)
    affected = remove(warehouse, held, reason) if held else None
    vessels.remove(warehouse, vessel, reason)
    return affected


def rename_vessel(warehouse: Warehouse, vessel: str, name: str, reason: str) -> list[LogRow]:
    """Give a vessel another name: all her logs are read for it from their bytes, then the old name counts no longer.

    Parameters
    ----------
    name : str
        That no vessel has.

    Returns
    -------
    list of LogRow
        Her logs under the new name.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
        ``no_raw_log``: the bytes of one of her logs are not kept; then nothing has changed.
    UsageError
        ``vessel_exists``, ``no_reason``, ``vessel_name``.
    KempfError
        A log cannot be read; the error says how many are moved, and the same command goes on.
    """
    require_reason(reason)
    profile = vessels.current(warehouse, vessel)
    profiles = vessels.profiles(warehouse)
    renamed = profile.model_copy(update={"vessel": name})
    # an interrupted one goes on: then the profile under the new name is the very same
    if name == vessel or (name in profiles and profiles[name] != renamed):
        raise UsageError(
            "vessel_exists",
            f"There is a vessel {name!r} already.",
            "Choose another name, or give her logs to that vessel with `kempf logs move`.",
            {"vessel": name},
        )
    held = [*logs.current(warehouse, vessel), *_on_their_way(warehouse, vessel, name)]
    _require_raw(warehouse, vessel, held)
    vessels.register(warehouse, name, renamed)
    every = notes.of_vessel(warehouse)
    for row in held:
        try:
            move(warehouse, row.log_id, name, reason, every_note=every)
        except Exception as error:
            raise _stopped(wrapped(error), vessel, name, logs.current(warehouse, name), held) from error
    # read again: notes may have been written while the logs were
    every = notes.of_vessel(warehouse)
    on_logs = _noted(warehouse, vessel, {row.log_id for row in logs.current(warehouse, name)}, every)
    notes.carry(warehouse, [("vessel", vessel), *on_logs], vessel, name, every)
    _hand_on_model(warehouse, vessel, name)
    vessels.remove(warehouse, vessel, reason_of_rename(name, reason))
    return logs.current(warehouse, name)


def _hand_on_model(warehouse: Warehouse, vessel: str, name: str) -> None:
    """Let a vessel under her new name have the model that she had, as one that was withdrawn and is to be fitted."""
    model = aliases.of_model(aliases.of_vessel(warehouse, vessel))
    if model is not None and aliases.CURRENT not in aliases.of_vessel(warehouse, name):
        aliases.point_all(warehouse, {(name, aliases.WITHDRAWN): model})


def _require_raw(warehouse: Warehouse, vessel: str, rows: Sequence[LogRow]) -> None:
    """Do nothing where the bytes of all logs are kept; whether they are whole is seen when they are read."""
    kept = set(raw.kept(warehouse))
    lost = [row for row in rows if row.log_id not in kept]
    if lost:
        names = ", ".join(f"{row.file_name} ({row.log_id[:12]})" for row in lost[:5])
        raise NotFound(
            "no_raw_log",
            f"Of {counted(len(rows), 'log')} of {vessel!r} the raw bytes of {len(lost)} are not kept any more: {names}"
            f"{' ...' if lost[5:] else ''}. No log was moved.",
            f"Ingest the original files again with `kempf ingest FILE --vessel {quote(vessel)}`, or take them out "
            "with `kempf logs remove`; then give the same command again.",
            {"vessel": vessel, "logs": [row.log_id for row in lost]},
        )


def _stopped(error: KempfError, vessel: str, name: str, moved: Sequence[LogRow], held: Sequence[LogRow]) -> KempfError:
    """Return the error that stopped a rename, with how far it came."""
    left = {row.log_id for row in held} - {row.log_id for row in moved}
    error.message += f" So far {len(moved)} of {counted(len(moved) + len(left), 'log')} of {vessel!r} went to {name!r}."
    error.next_step += " Then give the same command again: it goes on with the others."
    error.details |= {"moved": [row.log_id for row in moved], "not_moved": sorted(left)}
    return error
