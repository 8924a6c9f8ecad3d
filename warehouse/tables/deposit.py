"""Putting logs into the warehouse: raw bytes, readings, refused records, and last the row that makes them count.

A crash between the steps leaves nothing that is seen, and the same deposit again leaves one copy.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.readings import LogReadings
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.keys import ingest_id, vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, lost, purges, raw, readings, vessels

Outcome = Literal["new", "reread", "unchanged"]


@dataclass(frozen=True, eq=False)
class Delivery:
    """One log with what was read from it."""

    #: Her name.
    vessel: str
    #: As delivered, without its folder.
    file_name: str
    #: As delivered.
    log: LogFile
    #: What it was read with.
    profile: VesselProfile
    #: What the reader returned.
    readings: LogReadings
    #: Of the code that read it: stage ``ingest`` of `kempf.warehouse.code.code_version`.
    code_version: str
    #: Why it counts no longer, of one that was removed and is taken in again as that; None where it counts.
    removed: str | None = None


@dataclass(frozen=True)
class Deposit:
    """What became of a delivery: new to the warehouse, read anew (profile or code changed), or there already."""

    log_id: str
    ingest_id: str
    outcome: Outcome


def held(
    warehouse: Warehouse,
    vessel: str,
    file_name: str,
    log: LogFile,
    row: logs.LogRow | None,
    *,
    profile_sha256: str,
    code_version: str,
) -> Deposit | None:
    """Return the deposit of a log that is there already as read with this profile and code; ask before reading it.

    A raw copy that was damaged in the warehouse is replaced on the way.

    Parameters
    ----------
    row : LogRow or None
        The last row of the log, as `logs.find` returns it; None where there is none.

    Raises
    ------
    DataRejected
        ``log_of_another_vessel``, ``log_purged``.
    """
    name = log.sha256
    logs.refuse_other_vessel(row, vessel, file_name)
    if row is not None:
        purges.refuse(warehouse, [name])
    if row is None or row.removed is not None or row.ingest_id != ingest_id(name, profile_sha256, code_version):
        return None
    raw.put(warehouse, log)
    return Deposit(name, row.ingest_id, "unchanged")


def deposit(warehouse: Warehouse, deliveries: Sequence[Delivery]) -> list[Deposit]:
    """Put logs into the warehouse, all of them in one commit a table; logs that are there already change nothing.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    deliveries : sequence of Delivery
        The same bytes twice count once.

    Returns
    -------
    list of Deposit
        One a delivery, in the order given.

    Raises
    ------
    DataRejected
        ``log_of_another_vessel``: bytes that are kept, or given, for two vessels; ``log_purged``: it is not to be
        kept. Then nothing is recorded.
    """
    rows = [_row(delivery) for delivery in deliveries]
    purges.refuse(warehouse, [row.log_id for row in rows])
    known = logs.find(warehouse, [row.log_id for row in rows])
    first: dict[str, logs.LogRow] = {}
    fresh: dict[str, tuple[Delivery, logs.LogRow]] = {}
    for delivery, row in zip(deliveries, rows, strict=True):
        before = first.setdefault(row.log_id, row)
        for other in (before, known.get(row.log_id)):
            logs.refuse_other_vessel(other, row.vessel, row.file_name)
        if before.ingest_id != row.ingest_id:
            raise ValueError(f"{row.file_name}: one log with two profiles or two versions of the code in one deposit")
        last = known.get(row.log_id)
        if last is None or last.removed is not None or last.ingest_id != row.ingest_id:
            fresh.setdefault(row.log_id, (delivery, row))
    for delivery in deliveries:
        raw.put(warehouse, delivery.log)  # replaces a damaged copy of a log that is there, too
    recorded = {row.log_id: row.revision for row in _store(warehouse, list(fresh.values()))}
    anew = {name for name, row in known.items() if row.removed is not None}
    return [
        Deposit(row.log_id, row.ingest_id, _outcome(recorded.pop(row.log_id, None), row.log_id in anew)) for row in rows
    ]


def _store(warehouse: Warehouse, fresh: Sequence[tuple[Delivery, logs.LogRow]]) -> tuple[logs.LogRow, ...]:
    if not fresh:
        return ()
    counting = [delivery for delivery, _ in fresh if delivery.removed is None]
    vessels.register_all(warehouse, [(delivery.vessel, delivery.profile) for delivery in counting])
    batch = [(row, delivery.readings) for delivery, row in fresh]
    readings.write(warehouse, batch)
    readings.write_rejected(warehouse, batch)
    lost.write(warehouse, batch)
    for delivery, row in fresh:
        raw.describe(warehouse, row.log_id, description(row, delivery.profile))
    return logs.record(warehouse, [row for _, row in fresh])


def description(row: logs.LogRow, profile: VesselProfile) -> dict[str, Any]:
    """Return what is kept beside a raw log: whose it is, how it is called and read, and why it counts no longer."""
    return {
        "vessel": row.vessel,
        "file_name": row.file_name,
        "profile": json.loads(profile.canonical_json()),
        "removed": row.removed,
    }


def not_described(warehouse: Warehouse) -> dict[str, dict[str, Any]]:
    """Return what should be kept beside every raw log beside which something else is, or nothing.

    One whose profile is lost is left out.
    """
    profiles = {version.profile_sha256: version.profile for version in vessels.all_versions(warehouse)}
    known = logs.find(warehouse, raw.kept(warehouse))
    facts = {n: description(r, profiles[r.profile_sha256]) for n, r in known.items() if r.profile_sha256 in profiles}
    return {name: content for name, content in sorted(facts.items()) if raw.described(warehouse, name) != content}


def describe_all(warehouse: Warehouse) -> None:
    """Keep beside every raw log what its register says; one whose profile is lost is left as it is."""
    for name, facts in not_described(warehouse).items():
        raw.describe(warehouse, name, facts)


def _outcome(revision: int | None, was_removed: bool) -> Outcome:
    if revision is None:  # it was there, or another process recorded the same ingest meanwhile
        return "unchanged"
    return "new" if revision == 1 or was_removed else "reread"


def _row(delivery: Delivery) -> logs.LogRow:
    vessel_key(delivery.vessel)  # refuses a name that is none before anything is written
    name = delivery.log.sha256
    since, until = _span(delivery.readings)
    if since is None or until is None:
        raise ValueError(f"{delivery.file_name} has no reading: the reader should have refused it")
    return logs.LogRow(
        log_id=name,
        ingest_id=ingest_id(name, delivery.profile.sha256, delivery.code_version),
        vessel=delivery.vessel,
        file_name=delivery.file_name.encode("utf-8", "replace").decode(),
        format=delivery.readings.format,
        size_bytes=delivery.log.size,
        profile_sha256=delivery.profile.sha256,
        code_version=delivery.code_version,
        start_utc_ns=since,
        end_utc_ns=until,
        tally=delivery.readings.tally,
        notes=delivery.readings.notes,
        removed=delivery.removed,
    )


def _span(readings: LogReadings) -> tuple[int | None, int | None]:
    """Return the first and the last instant, nothing where there is none."""
    import polars as pl

    time = pl.col("time_utc_ns")
    since, until = readings.lazy().select(time.min().alias("since"), time.max().alias("until")).collect().row(0)
    return since, until
