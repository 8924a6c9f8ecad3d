"""The job that deletes a log for good, because it must not be kept: its bytes and every measurement in it.

What was concluded from it stays, superseded: that there was such a log, its manoeuvres with their bounds and figures,
parameters, diagnoses without the measurements that their reports showed. None of it leads back to a track.
"""

from __future__ import annotations

from collections.abc import Mapping

from kempf.flows.jobs.corrections.given_reason import require_reason
from kempf.flows.jobs.corrections.remove_logs import held_or_removed, remove
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses, logs, purges, raw
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.purges import Purge
from kempf.warehouse.upkeep.erase import erase

#: Tables with what was measured or written down in a log, an ingest each.
_OF_INGESTS = ("readings", "rejected", "lost", "examinations")


def what_goes(warehouse: Warehouse, name: str, reason: str) -> Purge:
    """Return the receipt that deleting a log will have; nothing is deleted.

    Parameters
    ----------
    name : str
        Beginning of the id of a log, removed or not, or its file name.

    Raises
    ------
    NotFound
        ``no_log``.
    UsageError
        ``ambiguous_log``, ``no_reason``.
    """
    require_reason(reason)
    row = held_or_removed(warehouse, name)
    there = purges.of_logs(warehouse, [row.log_id]).get(row.log_id)
    if there is not None:
        return there
    ingests = _ingests(warehouse, row)
    return Purge(
        *(row.vessel, row.log_id, row.file_name, row.size_bytes),
        readings=_rows(warehouse, "readings", "ingest_id", ingests),
        rejected=_rows(warehouse, "rejected", "ingest_id", ingests),
        evidence=_rows(warehouse, "diagnosis_evidence", "diagnosis_id", _diagnoses(warehouse, row)),
        reason=reason,
    )


def is_done(warehouse: Warehouse, log_id: str) -> bool:
    """Return whether a log was deleted for good, and nothing of it is left that another purge would delete."""
    if log_id not in purges.of_logs(warehouse, [log_id]) or raw.left_of(warehouse, log_id):
        return False
    ingests = _ingests(warehouse, held_or_removed(warehouse, log_id))
    return not any(_rows(warehouse, table, "ingest_id", ingests) for table in _OF_INGESTS)


def purge(warehouse: Warehouse, name: str, reason: str) -> Purge:
    """Delete a log for good; one that was interrupted goes on, and one that is done changes nothing.

    Parameters
    ----------
    name : str
        As `what_goes` takes it.

    Returns
    -------
    Purge
        The receipt, which is kept.

    Raises
    ------
    NotFound
        ``no_log``.
    UsageError
        ``ambiguous_log``, ``no_reason``.
    """
    receipt = what_goes(warehouse, name, reason)
    if is_done(warehouse, receipt.log_id):
        return receipt
    row = held_or_removed(warehouse, receipt.log_id)
    if row.removed is None:
        remove(warehouse, [row], f"purged: {reason}")
    if receipt.log_id not in purges.of_logs(warehouse, [receipt.log_id]):
        # first, so that a purge that was cut off is seen, and nobody takes the log in again meanwhile
        purges.add(warehouse, receipt)
    purges.note(warehouse, receipt)
    for vessel, ids in _ingests(warehouse, row).items():
        for table in _OF_INGESTS:
            erase(warehouse, table, vessel, "ingest_id", ids)
    for vessel, ids in _diagnoses(warehouse, row).items():
        erase(warehouse, "diagnosis_evidence", vessel, "diagnosis_id", ids)
    raw.delete(warehouse, row.log_id)
    return receipt


def _ingests(warehouse: Warehouse, row: LogRow) -> dict[str, list[str]]:
    """Return every ingest that there ever was of a log, by the vessel whose it was then."""
    ingests: dict[str, list[str]] = {}
    for ingest in logs.all_ingests(warehouse):
        if ingest.log_id == row.log_id:
            ingests.setdefault(ingest.vessel, []).append(ingest.ingest_id)
    return ingests


def _diagnoses(warehouse: Warehouse, row: LogRow) -> dict[str, list[str]]:
    """Return the diagnoses that rest on a log, by vessel."""
    return {
        vessel: [
            diagnosis.diagnosis_id
            for diagnosis in diagnoses.of_vessel(warehouse, vessel)
            if row.log_id in _logs_of(diagnosis)
        ]
        for vessel in _ingests(warehouse, row)
    }


def _logs_of(diagnosis: diagnoses.StoredDiagnosis) -> set[str]:
    return {bounds["log_id"] for bounds in diagnosis.inputs.get("segments", ())}


def _rows(warehouse: Warehouse, table: str, column: str, values: Mapping[str, list[str]]) -> int:
    """Count the rows of vessels whose column has one of some values."""
    count = 0
    for vessel, ids in values.items():
        where: Where = {"vessel_key": vessel_key(vessel), column: sorted(ids)}
        count += delta.read(warehouse, table, where, (column,)).height
    return count
