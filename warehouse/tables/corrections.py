"""Corrections of manoeuvres: what a person said of one, which only another correction takes back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kempf.schemas.correction import Correction
from kempf.warehouse.storage import append_only, delta
from kempf.warehouse.storage.canonical import canonical_json, sha256
from kempf.warehouse.storage.store import Warehouse


@dataclass(frozen=True)
class StoredCorrection:
    """One correction as it is kept."""

    #: Its place in the table, from 1.
    number: int
    log_id: str
    #: Of the manoeuvre, as it was called before.
    segment_id: str | None
    correction: Correction


def add(warehouse: Warehouse, log_id: str, segment_id: str | None, correction: Correction) -> int:
    """Store a correction of a manoeuvre of a log; return its number."""
    start, end = correction.bounds_utc_ns or (None, None)
    return append_only.add(
        warehouse,
        "corrections",
        {
            "log_id": log_id,
            "segment_id": segment_id,
            "action": correction.action,
            "subject_start_utc_ns": correction.subject_utc_ns[0],
            "subject_end_utc_ns": correction.subject_utc_ns[1],
            "start_utc_ns": start,
            "end_utc_ns": end,
            "reason": correction.reason,
        },
    )


def all_of(warehouse: Warehouse, log_ids: Iterable[str] | None = None) -> list[StoredCorrection]:
    """Return the corrections of some logs or of all, in the order in which they were made; none without a warehouse."""
    if not warehouse.exists():
        return []
    where = {} if log_ids is None else {"log_id": sorted(set(log_ids))}
    return [_stored(row) for row in delta.read(warehouse, "corrections", where).sort("number").rows(named=True)]


def of_logs(warehouse: Warehouse, log_ids: Iterable[str]) -> dict[str, tuple[Correction, ...]]:
    """Return the corrections of some logs, by log, in the order in which they were made; logs without are left out."""
    corrections: dict[str, tuple[Correction, ...]] = {}
    for entry in all_of(warehouse, log_ids):
        corrections[entry.log_id] = (*corrections.get(entry.log_id, ()), entry.correction)
    return corrections


def basis(code: str, corrections: Sequence[Correction]) -> str:
    """Return what a search rests on: the fingerprint of its code, and a hash over the corrections where there are any.

    Parameters
    ----------
    code : str
        Fingerprint of the code that searches.
    corrections : sequence of Correction
        Of the log that is searched.
    """
    if not corrections:
        return code
    content = [[c.action, c.subject_utc_ns, c.bounds_utc_ns, c.reason] for c in corrections]
    return sha256(canonical_json([code, content]))[: len(code)]


def _stored(row: Mapping[str, Any]) -> StoredCorrection:
    bounds = None if row["start_utc_ns"] is None else (row["start_utc_ns"], row["end_utc_ns"])
    subject = row["subject_start_utc_ns"], row["subject_end_utc_ns"]
    correction = Correction(row["action"], subject, bounds, row["reason"])
    return StoredCorrection(row["number"], row["log_id"], row["segment_id"], correction)
