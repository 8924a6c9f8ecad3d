"""Logs are taken in and read again from their raw bytes, where what they gave is lost."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from kempf.flows.jobs.ingest import search_log
from kempf.flows.jobs.ingest.ingest_logs import ingest_log, look_through, store
from kempf.flows.jobs.ingest.spool import spooled
from kempf.flows.jobs.repair.repaired import Repaired
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import KempfError
from kempf.schemas.instants import month_of
from kempf.schemas.profile import parse
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import corrections, logs, lost, purges, raw, readings, vessels
from kempf.warehouse.tables.equivalents import code_of, codes_of
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.upkeep.verify import ingests_to_hold


def missing_logs(warehouse: Warehouse, outcome: Repaired) -> list[str]:
    """Return the raw logs that no register has, and those that should count and that none lets count.

    What is kept beside them says whether they count. Purged ones are left out: they go on being deleted.
    """
    recorded = {row.log_id for row in logs.all_ingests(warehouse)}
    known = {row.log_id for row in logs.current(warehouse)} if outcome.registers else recorded
    left_out = known | purges.of_logs(warehouse).keys()
    described = {name: raw.described(warehouse, name) for name in raw.kept(warehouse) if name not in left_out}
    return [
        name
        for name, facts in described.items()
        if facts is not None and (not facts.get("removed") or name not in recorded)
    ]


def take_in(warehouse: Warehouse, name: str) -> str:
    """Take a log in again from its raw bytes and what is kept beside them."""
    facts = raw.described(warehouse, name)
    assert facts is not None
    profile = parse(facts["profile"], f"raw/{name}.json")
    vessel, file_name, removed = facts["vessel"], facts["file_name"], facts.get("removed")
    with raw.opened(warehouse, name) as log:
        if not removed:
            outcome = ingest_log(warehouse, vessel, file_name, log, profile, file_name).outcome
        else:
            with spooled(file_name, log, profile) as read:
                said = corrections.of_logs(warehouse, [name]).get(name, ())
                found = look_through(vessel, file_name, log, profile, read, said, codes_of(warehouse))
                # in one row, so that it never counts in between
                store(warehouse, [replace(found, delivery=replace(found.delivery, removed=removed))])
            outcome = f"removed, as before: {removed}"
    return f"{file_name} of {vessel} was taken in again from its raw bytes ({outcome})."


def unread_ingests(warehouse: Warehouse, outcome: Repaired, taken_in: Collection[str]) -> list[str]:
    """Return the ingests of which something that the bytes gave is missing, and that the present code has read.

    Parameters
    ----------
    taken_in : collection of str
        Ids of logs that were taken in again just now: they are whole.
    """
    code = code_of(warehouse, "ingest")
    held = delta.distinct(warehouse, "readings", "ingest_id")
    examined = delta.distinct(warehouse, "examinations", "ingest_id")

    def whole(row: LogRow) -> bool:
        key = vessel_key(row.vessel)
        touched = f"{key} {month_of(row.start_utc_ns)}" in outcome.months
        touched = touched or not outcome.vessel_keys.isdisjoint({None, key})
        touched = touched and row.log_id not in taken_in
        return not touched and row.ingest_id in held and row.ingest_id in examined

    must, others = ingests_to_hold(warehouse)
    touched = [row for row in others if not whole(row)]
    if touched and (outcome.months or outcome.vessel_keys):
        words = "what earlier code, or a profile that is lost, had given of logs that were removed or read again since"
        outcome.gone.append(f"{words} ({counted(len(touched), 'ingest')}); nothing needs it")
    return [row.ingest_id for row in must if row.code_version == code and not whole(row)]


def read_again(warehouse: Warehouse, name: str) -> str:
    """Read the log of an ingest again and put all that its bytes give in place of what is stored of it.

    Raises
    ------
    KempfError
        ``other_ingest``: the present code, or another profile, makes another ingest of it.
    """
    row = logs.of_ingest(warehouse, name)
    profile = vessels.get(warehouse, row.profile_sha256)
    log_corrections = corrections.of_logs(warehouse, [row.log_id]).get(row.log_id, ())
    with raw.opened(warehouse, row.log_id) as log, spooled(row.file_name, log, profile) as read:
        looked_through = look_through(
            row.vessel, row.file_name, log, profile, read, log_corrections, codes_of(warehouse)
        )
        if looked_through.found.examination.ingest_id != row.ingest_id:
            raise KempfError(
                "other_ingest",
                f"{row.file_name} is read with other code now.",
                "Run `kempf reprocess`.",
                {"log": row.log_id},
            )
        search_log.store(warehouse, [looked_through.found])
        batch = [(row, read)]
        readings.write(warehouse, batch)
        readings.write_rejected(warehouse, batch)
        lost.write(warehouse, batch)
    return f"{row.file_name} of {row.vessel} was read again from its raw bytes."
