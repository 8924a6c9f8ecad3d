"""Keys of rows and partitions, and how they stand in a predicate."""

from __future__ import annotations

from collections.abc import Iterable

from kempf.schemas.errors import UsageError
from kempf.warehouse.canonical import canonical_json, sha256


def vessel_key(vessel: str) -> str:
    """Return the partition of a vessel: 16 hex digits of the SHA-256 of her name.

    Names are not paths: ``../../etc``, ``CON`` and names that differ only in case all have a folder of their own.

    Raises
    ------
    UsageError
        ``vessel_name``: the name is blank, or is no text that UTF-8 can write.

    Examples
    --------
    >>> vessel_key("../../etc")
    '74ccf3c5b4c19a81'
    """
    try:
        if vessel.strip():
            return sha256(vessel)[:16]
    except UnicodeEncodeError:
        pass
    raise UsageError(
        "vessel_name",
        f"{vessel!r} is no name of a vessel: expected at least one visible character of Unicode text.",
        "Give a name with --vessel, or as 'vessel' in the profile.",
    )


def ingest_id(log_id: str, profile_sha256: str, code_version: str) -> str:
    """Return the id of one ingest, 16 hex digits: the log, the profile it is read with, the code that reads it."""
    return sha256(canonical_json([log_id, profile_sha256, code_version]))[:16]


def quoted(text: str) -> str:
    """Return a text as an SQL literal.

    Examples
    --------
    >>> quoted("O'Brien")
    "'O''Brien'"
    """
    return "'" + text.replace("'", "''") + "'"


def one_of(column: str, values: Iterable[str]) -> str:
    """Return the predicate that ``column`` is one of ``values``, sorted so that one request has one text."""
    return f"{column} IN ({', '.join(quoted(v) for v in sorted(set(values)))})"
