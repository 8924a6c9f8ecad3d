"""The register of ingests: a log is in the warehouse from the commit of its row on, and not before.

Everything that reads readings or segments starts here, so that what a crash left behind is never seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

from kempf.pipeline.ingest.readings import Tally
from kempf.schemas.errors import DataRejected, NotFound, UsageError
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.query_cache import cached
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse


@dataclass(frozen=True)
class LogRow:
    """One ingest of one log."""

    log_id: str
    ingest_id: str
    vessel: str
    file_name: str
    format: str
    size_bytes: int
    profile_sha256: str
    code_version: str
    #: start_utc_ns, end_utc_ns: First and last instant of the readings, UTC nanoseconds.
    start_utc_ns: int
    end_utc_ns: int
    tally: Tally
    notes: tuple[str, ...] = ()
    #: 1 for the first ingest of the log; the highest is the current one. 0 before it is recorded.
    revision: int = 0
    #: Why the log counts no longer; None where it does.
    removed: str | None = None


def all_ingests(warehouse: Warehouse, vessel: str | None = None) -> list[LogRow]:
    """Return every recorded ingest, of one vessel or of all, sorted by start, log and revision."""
    if vessel is None:
        return _all_ingests(warehouse, {})
    of_vessel = {"vessel_key": vessel_key(vessel)}
    return list(cached(warehouse, ("logs",), ("ingests", vessel), partial(_all_ingests, warehouse, of_vessel)))


def _all_ingests(warehouse: Warehouse, where: Where) -> list[LogRow]:
    frame = delta.read(warehouse, "logs", where).sort("start_utc_ns", "log_id", "revision")
    return [_row(r) for r in frame.rows(named=True)]


def current(warehouse: Warehouse, vessel: str | None = None) -> list[LogRow]:
    """Return the current ingest of every log, of one vessel or of all, sorted by start then log.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    return [row for row in _last(warehouse, vessel) if row.removed is None]


def removed(warehouse: Warehouse, vessel: str | None = None) -> list[LogRow]:
    """Return the last row of every log that was removed, of one vessel or of all, sorted by start then log.

    A log that was moved to another vessel is among those removed of the first one.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    return [row for row in _last(warehouse, vessel) if row.removed is not None]


def _last(warehouse: Warehouse, vessel: str | None) -> list[LogRow]:
    rows = _latest(all_ingests(warehouse, vessel)).values()
    return sorted(rows, key=lambda row: (row.start_utc_ns, row.log_id))


def find(warehouse: Warehouse, log_ids: Sequence[str]) -> dict[str, LogRow]:
    """Return the last row of each of some logs that was ever ingested, removed or not; none without a warehouse."""
    if not warehouse.exists():
        return {}
    frame = delta.read(warehouse, "logs", {"log_id": sorted(set(log_ids))})
    return _latest([_row(r) for r in frame.rows(named=True)])


def of_ingest(warehouse: Warehouse, ingest_id: str) -> LogRow:
    """Return the row of one ingest, current or not.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_ingest``.
    """
    frame = delta.read(warehouse, "logs", {"ingest_id": ingest_id})
    if frame.height == 0:
        raise NotFound(
            "no_ingest",
            f"There is no ingest {ingest_id!r} in {warehouse.uri}.",
            "Ingest the log with `kempf ingest PATH... --vessel NAME`.",
            {"ingest_id": ingest_id},
        )
    return _row(frame.sort("revision").rows(named=True)[-1])


def refuse_other_vessel(held: LogRow | None, vessel: str, file_name: str) -> None:
    """Do nothing unless a log is kept for another vessel; one that was removed is kept for none.

    Raises
    ------
    DataRejected
        ``log_of_another_vessel``: the same bytes were ingested for another one.
    """
    if held is None or held.vessel == vessel or held.removed is not None:
        return
    raise DataRejected(
        "log_of_another_vessel",
        f"{file_name} has the very bytes of {held.file_name}, which was ingested for vessel {held.vessel!r}; "
        f"now it is claimed for {vessel!r}.",
        f"Use --vessel {held.vessel!r} if it is hers; if she never sailed it, `kempf logs move {held.log_id[:12]} "
        "--vessel NAME` gives it to the other one; else look which of the two files was copied wrongly.",
        {"log_id": held.log_id, "held_by": held.vessel, "claimed_for": vessel},
    )


def record(warehouse: Warehouse, rows: Iterable[LogRow]) -> tuple[LogRow, ...]:
    """Make each ingest the current one of its log, in at most one commit.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    rows : iterable of LogRow
        One a log.

    Returns
    -------
    tuple of LogRow
        Those that were not current before, with their revision.

    Raises
    ------
    DataRejected
        ``log_of_another_vessel``; then none of them is recorded.
    """
    ingests = list(rows)
    if not ingests:
        return ()

    def attempt() -> tuple[LogRow, ...]:
        with delta.ensured(warehouse, "logs") as table:
            frame = delta.rows(table, "logs", {"log_id": [row.log_id for row in ingests]})
            held = _latest([_row(r) for r in frame.rows(named=True)])
            fresh = []
            for row in ingests:
                last = held.get(row.log_id)
                refuse_other_vessel(last, row.vessel, row.file_name)
                if last is None or last.ingest_id != row.ingest_id or last.removed is not None:
                    fresh.append(replace(row, revision=1 if last is None else last.revision + 1))
            if fresh:
                delta.replace(table, "logs", [_as_columns(row) for row in fresh], _new_rows(fresh))
            return tuple(fresh)

    return with_retry(attempt)


def mark(warehouse: Warehouse, log_ids: Sequence[str], reason: str | None) -> tuple[LogRow, ...]:
    """Let logs count no longer, or again, in at most one commit; what they were is kept.

    Parameters
    ----------
    log_ids : sequence of str
        Of logs that were ingested.
    reason : str or None
        Why they count no longer; None lets them count again.

    Returns
    -------
    tuple of LogRow
        Those that were otherwise before, as they are now, sorted by log.
    """

    def attempt() -> tuple[LogRow, ...]:
        with delta.ensured(warehouse, "logs") as table:
            frame = delta.rows(table, "logs", {"log_id": sorted(set(log_ids))})
            held = _latest([_row(r) for r in frame.rows(named=True)])
            changed = [
                replace(row, revision=row.revision + 1, removed=reason)
                for _, row in sorted(held.items())
                if (row.removed is None) != (reason is None)
            ]
            if changed:
                delta.replace(table, "logs", [_as_columns(row) for row in changed], _new_rows(changed))
            return tuple(changed)

    return with_retry(attempt) if log_ids else ()


def _new_rows(rows: Sequence[LogRow]) -> str:
    """Return the predicate of rows that are not there yet: a writer that adds one of them first makes us fail."""
    by_revision = [(n, [row.log_id for row in rows if row.revision == n]) for n in sorted({r.revision for r in rows})]
    return " OR ".join(f"(revision = {n} AND {one_of('log_id', logs)})" for n, logs in by_revision)


def _latest(rows: Iterable[LogRow]) -> dict[str, LogRow]:
    return {row.log_id: row for row in sorted(rows, key=lambda row: row.revision)}


def _as_columns(row: LogRow) -> dict[str, Any]:
    columns = {**asdict(row), **asdict(row.tally), "vessel_key": vessel_key(row.vessel), "notes": list(row.notes)}
    columns["rejected_by_reason"] = [{"reason": k, "count": n} for k, n in sorted(row.tally.by_reason.items())]
    del columns["tally"], columns["by_reason"]
    return columns


def _row(row: dict[str, Any]) -> LogRow:
    counts = {name: row.pop(name) for name in list(row) if name.startswith(("records_", "values_"))}
    reasons = {str(item["reason"]): item["count"] for item in row.pop("rejected_by_reason")}
    del row["vessel_key"]
    return LogRow(**{**row, "tally": Tally(**counts, by_reason=reasons), "notes": tuple(row["notes"])})


def by_prefix(warehouse: Warehouse, name: str, *, removed: bool = False) -> LogRow:
    """Return the current ingest of a log by a beginning of its log id, its ingest id or its file name.

    Parameters
    ----------
    removed : bool, optional
        Whether it is among the logs that were removed.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_log``.
    UsageError
        ``ambiguous_log``: several fit.
    """
    every = _latest(all_ingests(warehouse)).values()
    rows = [row for row in every if (row.removed is not None) == removed]
    matches = [row for row in rows if name and name in (row.log_id, row.ingest_id, row.file_name)]
    matches = matches or [
        row for row in rows if name and (row.log_id.startswith(name) or row.ingest_id.startswith(name))
    ]
    if not matches:
        raise NotFound(
            "no_log",
            f"There is no {'removed ' if removed else ''}log {name!r} in {warehouse.uri}.",
            f"List them with `kempf logs list{' --removed' if removed else ''}`.",
            {"log": name},
        )
    if len(matches) > 1:
        raise UsageError(
            "ambiguous_log",
            f"{len(matches)} logs fit {name!r}: {', '.join(row.log_id[:16] for row in matches[:5])}.",
            "Give more of the id.",
            {"log": name, "found": [row.log_id for row in matches]},
        )
    return matches[0]
