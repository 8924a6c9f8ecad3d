"""Which code stands for which: a version that was seen to move nothing counts as the one before it.

What is stored carries the fingerprint of the code that made it in its identity (`kempf.warehouse.code.code_version`),
so that a change of the code makes it anew. Where a person adopts the present code as equal to that which made what is
stored, everything goes on under the fingerprint of that: nothing is made anew, and no id changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from kempf.warehouse.code import code_version
from kempf.warehouse.code.code_version import Stage
from kempf.warehouse.storage import append_only, delta
from kempf.warehouse.storage.query_cache import cached
from kempf.warehouse.storage.store import Warehouse

_TABLE = "equivalents"


@dataclass(frozen=True)
class Equivalent:
    """One code that counts as another one."""

    stage: str
    #: code, stands_for: Fingerprints; the same one twice takes back what was said of it before.
    code: str
    stands_for: str
    #: How many parameter sets were compared and were the same, bit for bit, and of which vessels.
    sets: int
    vessels: tuple[str, ...]
    git_commit: str | None


@dataclass(frozen=True)
class Codes:
    """The fingerprints under which the present code reads, searches and estimates in a warehouse."""

    ingest: str
    segment: str
    estimate: str


def code_of(warehouse: Warehouse, stage: Stage) -> str:
    """Return the fingerprint under which the present code of a stage goes on in a warehouse."""
    present = code_version.fingerprint(stage)
    return _standing(warehouse).get((stage, present), present)


def codes_of(warehouse: Warehouse) -> Codes:
    """Return those of all stages that can be adopted."""
    return Codes(code_of(warehouse, "ingest"), code_of(warehouse, "segment"), code_of(warehouse, "estimate"))


def adopt(warehouse: Warehouse, entries: Sequence[Equivalent]) -> None:
    """Let codes count as others, from now on, in one commit."""
    if entries:
        append_only.add(warehouse, _TABLE, *({**vars(entry), "vessels": list(entry.vessels)} for entry in entries))


def withdraw(warehouse: Warehouse) -> list[Equivalent]:
    """Let the present code count as itself again; return what it counted as."""
    standing = _standing(warehouse)
    present = {stage: code_version.fingerprint(stage) for stage in code_version.STAGES}
    entries = [
        Equivalent(stage, code, standing[stage, code], 0, (), code_version.git_commit())
        for stage, code in present.items()
        if standing.get((stage, code), code) != code
    ]
    adopt(warehouse, [Equivalent(entry.stage, entry.code, entry.code, 0, (), entry.git_commit) for entry in entries])
    return entries


def _standing(warehouse: Warehouse) -> dict[tuple[str, str], str]:
    return cached(warehouse, (_TABLE,), "standing", partial(_read, warehouse))


def _read(warehouse: Warehouse) -> dict[tuple[str, str], str]:
    with delta.reading(warehouse, _TABLE) as table:
        if table is None:
            return {}
        rows = delta.rows(table, _TABLE, {}, ("number", "stage", "code", "stands_for")).sort("number")
    return {(stage, code): stands_for for _, stage, code, stands_for in rows.rows()}
