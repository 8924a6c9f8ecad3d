"""What the channel doctor found in each ingest. Examining an ingest again replaces what was found in it before."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from orjson import loads

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json, plain
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse


@dataclass(frozen=True)
class StoredExamination:
    """The doctor's verdict on one ingest."""

    vessel: str
    ingest_id: str
    log_id: str
    code_version: str
    #: ``clean``, ``faults``, ``untested``, or ``failed``: the doctor himself failed.
    verdict: str
    #: One sentence each.
    findings: tuple[str, ...]
    #: JSON content, with the notes on how the channels were chosen.
    content: Mapping[str, Any] = field(default_factory=dict)

    @property
    def notes(self) -> tuple[str, ...]:
        """How the channels were chosen, and why manoeuvres could not be looked for, where that is so."""
        return tuple(self.content.get("notes", ()))


def replace(warehouse: Warehouse, examinations: Sequence[StoredExamination]) -> tuple[str, ...]:
    """Put examinations of some ingests, of any vessels, in place of what is stored of these, in at most one commit.

    Returns
    -------
    tuple of str
        Ingests of which something changed, sorted.
    """
    new = {examination.ingest_id: _row(examination) for examination in examinations}
    keys = sorted({row["vessel_key"] for row in new.values()})

    def attempt() -> tuple[str, ...]:
        with delta.ensured(warehouse, "examinations") as table:
            stored = delta.rows(table, "examinations", {"vessel_key": keys, "ingest_id": sorted(new)}).rows(named=True)
            held = {row["ingest_id"]: row for row in stored}
            changed = sorted(ingest for ingest, row in new.items() if held.get(ingest) != row)
            if changed:
                whose = {new[ingest]["vessel_key"] for ingest in changed}
                predicate = f"{one_of('vessel_key', whose)} AND {one_of('ingest_id', changed)}"
                delta.replace(table, "examinations", [new[ingest] for ingest in changed], predicate)
            return tuple(changed)

    return with_retry(attempt) if new else ()


def _row(examination: StoredExamination) -> dict[str, Any]:
    return {
        "vessel_key": vessel_key(examination.vessel),
        "vessel": examination.vessel,
        "ingest_id": examination.ingest_id,
        "log_id": examination.log_id,
        "verdict": examination.verdict,
        "findings": list(examination.findings),
        "content_json": canonical_json(plain(examination.content)),
        "code_version": examination.code_version,
    }


def of_ingests(
    warehouse: Warehouse, ingest_ids: Iterable[str], vessels: Iterable[str] | None = None
) -> dict[str, StoredExamination]:
    """Return the examinations of some ingests, by ingest id; an ingest from before there was a doctor has none.

    Parameters
    ----------
    vessels : iterable of str, optional
        Whose they are: the files of others need not be looked into.
    """
    frame = delta.read(warehouse, "examinations", _where(ingest_ids, vessels))
    return {row["ingest_id"]: _stored(row) for row in frame.sort("ingest_id").rows(named=True)}


def findings(
    warehouse: Warehouse, ingest_ids: Iterable[str], vessels: Iterable[str] | None = None
) -> dict[str, list[str]]:
    """Return what was found in some ingests, one sentence each, by ingest id; see `of_ingests`, which reads more."""
    where = _where(ingest_ids, vessels)
    return dict(delta.read(warehouse, "examinations", where, ("ingest_id", "findings")).rows())


def codes(warehouse: Warehouse, ingest_ids: Iterable[str], vessels: Iterable[str] | None = None) -> dict[str, str]:
    """Return the fingerprint of the code that looked through some ingests, by ingest id; see `of_ingests`."""
    where = _where(ingest_ids, vessels)
    return dict(delta.read(warehouse, "examinations", where, ("ingest_id", "code_version")).rows())


def _where(ingest_ids: Iterable[str], vessels: Iterable[str] | None) -> Where:
    where: dict[str, str | list[str]] = {"ingest_id": sorted(set(ingest_ids))}
    if vessels is not None:
        where["vessel_key"] = sorted({vessel_key(name) for name in vessels})
    return where


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
