"""What became of the files of inboxes. A file has one row, its latest; so has an inbox that was found empty."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from kempf.schemas.errors import NotFound, UsageError
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse

#: ``dismissed`` by a person; ``gone`` from the inbox while in quarantine, and tried again when it returns; ``removed``:
#: a log that a person removed, which is left alone
Outcome = Literal["ingested", "quarantined", "dismissed", "gone", "removed"]
#: what is stored of a file that is gone; earlier versions stored it as dismissed
NO_LONGER_THERE = "It is no longer in the inbox."
#: code of the row of an inbox itself, while no file is in it
_EMPTY = "inbox_empty"


@dataclass(frozen=True)
class InboxFile:
    """One file as it was last looked at."""

    #: A path, or s3://bucket/key.
    address: str
    #: size_bytes, modified_utc_ns: By which a file that was written since is known.
    size_bytes: int
    modified_utc_ns: int
    outcome: Outcome
    #: None where it could not be placed.
    vessel: str | None = None
    #: None where it is neither ingested nor a removed log.
    log_id: str | None = None
    #: Of the error that quarantined it.
    code: str | None = None
    #: Why it is not ingested, and what to do.
    message: str | None = None
    next_step: str | None = None
    #: Hash of vessel, profile and code that it was tried with.
    basis: str | None = None


def below(warehouse: Warehouse, root: str) -> dict[str, InboxFile]:
    """Return what is known of the files below an inbox, by address; nothing where there is no warehouse.

    The row of the inbox itself, if there is one, is among them.

    Parameters
    ----------
    root : str
        Address of the inbox, without a slash at its end.
    """
    if not warehouse.exists():
        return {}
    rows = delta.read(warehouse, "inbox").rows(named=True)
    return {row["address"]: _file(row) for row in rows if row["address"].startswith(f"{root}/")}


def was_empty(root: str, known: Mapping[str, InboxFile]) -> bool:
    """Return whether the last run found no file in an inbox in which files lay before.

    Parameters
    ----------
    known : mapping of str to InboxFile
        As `below` returns it.
    """
    row = known.get(f"{root}/")
    return row is not None and row.code == _EMPTY


def emptied(root: str, *, empty: bool) -> InboxFile:
    """Return the row of an inbox itself: whether it is empty. It counts as no file."""
    return InboxFile(f"{root}/", 0, 0, "gone", code=_EMPTY if empty else None)


def _file(row: dict[str, Any]) -> InboxFile:
    if row["outcome"] == "dismissed" and row["message"] == NO_LONGER_THERE:
        row = {**row, "outcome": "gone"}
    return InboxFile(**row)


def quarantined(warehouse: Warehouse) -> list[InboxFile]:
    """Return the files in quarantine, of all inboxes, sorted by address.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    rows = delta.read(warehouse, "inbox", {"outcome": "quarantined"}).sort("address").rows(named=True)
    return [InboxFile(**row) for row in rows]


def by_name(warehouse: Warehouse, name: str) -> InboxFile:
    """Return a file in quarantine by its address, or by the end of it, such as its file name.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``not_in_quarantine``.
    UsageError
        ``ambiguous_file``: several fit.
    """
    held = quarantined(warehouse)
    files = [file for file in held if file.address == name] or [
        file for file in held if name and file.address.endswith(f"/{name.lstrip('/')}")
    ]
    if not files:
        raise NotFound(
            "not_in_quarantine",
            f"No file {name!r} is in quarantine in {warehouse.uri}.",
            "List those that are with `kempf logs quarantine`.",
            {"file": name},
        )
    if len(files) > 1:
        raise UsageError(
            "ambiguous_file",
            f"{len(files)} files in quarantine fit {name!r}: {', '.join(file.address for file in files[:5])}.",
            "Give more of the address.",
            {"file": name, "found": [file.address for file in files]},
        )
    return files[0]


def record(warehouse: Warehouse, files: Iterable[InboxFile]) -> tuple[str, ...]:
    """Store what became of files, in place of what was stored of them, in at most one commit.

    Returns
    -------
    tuple of str
        Addresses of those of which something changed, sorted.
    """
    rows: Mapping[str, dict[str, Any]] = {file.address: asdict(file) for file in files}
    if not rows:
        return ()

    def attempt() -> tuple[str, ...]:
        with delta.ensured(warehouse, "inbox") as table:
            stored = delta.rows(table, "inbox", {"address": sorted(rows)}).rows(named=True)
            held = {row["address"]: row for row in stored}
            changed = tuple(address for address in sorted(rows) if held.get(address) != rows[address])
            if changed:
                delta.replace(table, "inbox", [rows[address] for address in changed], one_of("address", changed))
            return changed

    return with_retry(attempt)
