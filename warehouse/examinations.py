"""What the channel doctor found in each ingest. Examining an ingest again replaces what was found in it before."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from json import loads
from typing import Any

from warehouse import delta
from warehouse.canonical import canonical_json, plain
from warehouse.keys import one_of, vessel_key
from warehouse.retry import with_retry
from warehouse.store import Warehouse


@dataclass(frozen=True)
class StoredExamination:
    """The doctor's verdict on one ingest.

    Attributes
    ----------
    vessel, ingest_id, log_id, code_version : str
    verdict : str
        ``clean``, ``faults``, ``untested``, or ``failed``: the doctor himself failed.
    findings : tuple of str
        One sentence each.
    content : mapping
        JSON content.
    """

    vessel: str
    ingest_id: str
    log_id: str
    code_version: str
    verdict: str
    findings: tuple[str, ...]
    content: Mapping[str, Any] = field(default_factory=dict)


def replace(warehouse: Warehouse, one: StoredExamination) -> bool:
    """Put an examination in place of what is stored of its ingest.

    Returns
    -------
    bool
        Whether anything changed.
    """
    key = vessel_key(one.vessel)
    row: dict[str, Any] = {
        "vessel_key": key,
        "vessel": one.vessel,
        "ingest_id": one.ingest_id,
        "log_id": one.log_id,
        "verdict": one.verdict,
        "findings": list(one.findings),
        "content_json": canonical_json(plain(one.content)),
        "code_version": one.code_version,
    }

    def attempt() -> bool:
        with delta.ensured(warehouse, "examinations") as table:
            held = delta.rows(table, "examinations", {"vessel_key": key, "ingest_id": one.ingest_id}).rows(named=True)
            if held == [row]:
                return False
            predicate = f"{one_of('vessel_key', [key])} AND {one_of('ingest_id', [one.ingest_id])}"
            delta.replace(table, "examinations", [row], predicate)
            return True

    return with_retry(attempt)


def of_ingests(warehouse: Warehouse, ingest_ids: Iterable[str]) -> dict[str, StoredExamination]:
    """Return the examinations of some ingests, by ingest id; an ingest from before there was a doctor has none."""
    frame = delta.read(warehouse, "examinations", {"ingest_id": sorted(set(ingest_ids))})
    return {row["ingest_id"]: _stored(row) for row in frame.sort("ingest_id").rows(named=True)}


def _stored(row: Mapping[str, Any]) -> StoredExamination:
    return StoredExamination(
        row["vessel"],
        row["ingest_id"],
        row["log_id"],
        row["code_version"],
        row["verdict"],
        tuple(row["findings"]),
        loads(row["content_json"]),
    )
