"""Logs that were deleted for good: the receipts. Nothing takes one back.

Each is kept twice, in its table and where the raw log was, so that a log is not let in again where the table is lost.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Any

from kempf.schemas.errors import DataRejected
from kempf.warehouse.storage import append_only, delta
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse

_TABLE = "purges"
#: How what is kept where a raw log was ends, behind the id of the log.
NOTE = ".purged.json"


@dataclass(frozen=True)
class Purge:
    """One log that was deleted for good."""

    vessel: str
    log_id: str
    file_name: str
    #: Of the log as delivered.
    size_bytes: int
    #: readings, rejected, evidence: Rows that were deleted of every ingest of the log; diagnoses whose reports lost the
    #: measurements that they showed.
    readings: int
    rejected: int
    evidence: int
    reason: str

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


def add(warehouse: Warehouse, purge: Purge) -> None:
    """Write a receipt."""
    append_only.add(warehouse, _TABLE, {**asdict(purge), "vessel_key": vessel_key(purge.vessel)})


def note(warehouse: Warehouse, purge: Purge) -> None:
    """Keep a receipt where its raw log was, too, unless that is done."""
    content = canonical_json(asdict(purge)).encode()
    if warehouse.read_bytes(*_place(purge.log_id)) != content:
        warehouse.write_bytes(content, *_place(purge.log_id))


def note_all(warehouse: Warehouse) -> None:
    """Keep every receipt where its raw log was, too, as far as that is not done."""
    for purge in of_logs(warehouse).values():
        note(warehouse, purge)


def noted(warehouse: Warehouse) -> dict[str, Purge]:
    """Return the receipts that are kept where the raw logs were, by log, sorted; a damaged one is left out."""
    receipts = {}
    for name in warehouse.files_below("raw"):
        if name.endswith(NOTE) and not name.startswith("."):
            data = warehouse.read_bytes(*_place(name.removesuffix(NOTE)))
            try:
                receipts[name.removesuffix(NOTE)] = Purge(**json.loads(data or b""))
            except (ValueError, TypeError):
                continue
    return receipts


def _place(log_id: str) -> tuple[str, ...]:
    return "raw", log_id[:2], f"{log_id}{NOTE}"


def of_logs(warehouse: Warehouse, log_ids: Collection[str] | None = None) -> dict[str, Purge]:
    """Return the receipts of some logs or of all, by log, in order; those that were not deleted are left out."""
    if not warehouse.exists() or (log_ids is not None and not log_ids):
        return {}
    where = {} if log_ids is None else {"log_id": sorted(set(log_ids))}
    rows = delta.read(warehouse, _TABLE, where).sort("number").drop("number", "vessel_key").rows(named=True)
    return {row["log_id"]: Purge(**row) for row in rows}


def refuse(warehouse: Warehouse, log_ids: Collection[str]) -> None:
    """Do nothing unless one of some logs was deleted for good.

    Raises
    ------
    DataRejected
        ``log_purged``.
    """
    for purge in of_logs(warehouse, log_ids).values():
        raise DataRejected(
            "log_purged",
            f"The log {purge.file_name} of {purge.vessel!r} was purged ({purge.reason}): it is not to be kept here.",
            "Take the file away from where it is delivered. What was purged cannot be brought back.",
            {"log_id": purge.log_id, "vessel": purge.vessel},
        )
