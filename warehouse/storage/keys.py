"""Keys of rows and partitions, and how they stand in a predicate."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable

from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.canonical import canonical_json, sha256

#: Characters of a name that a person reads in a key.
_MOST_LETTERS = 24
_PLAIN = re.compile(r"[A-Za-z0-9_-]+")


def vessel_key(vessel: str) -> str:
    """Return the partition of a vessel: what can be read of her name, and 8 hex digits of the SHA-256 of all of it.

    Names are not paths: ``../../etc``, ``CON`` and names that differ only in case all have a folder of their own. A
    name without a letter or digit of ASCII reads ``vessel``.

    Raises
    ------
    UsageError
        ``vessel_name``: the name is blank, or is no text that UTF-8 can write.

    Examples
    --------
    >>> vessel_key("Ferry One"), vessel_key("../../etc")
    ('ferry-one-cb9e2d73', 'etc-74ccf3c5')
    """
    return f"{_readable(vessel)}-{_hash(vessel)[:8]}"


def segment_of_address(vessel: str) -> str:
    """Return what stands for a vessel in an address: her name where that is a plain word, else ``~`` and her key.

    Examples
    --------
    >>> segment_of_address("ferry"), segment_of_address("Ferry One")
    ('ferry', '~ferry-one-cb9e2d73')
    """
    return vessel if _PLAIN.fullmatch(vessel) else f"~{vessel_key(vessel)}"


def earlier_key(vessel: str) -> str:
    """Return the partition of a vessel in versions of tables from before layout 4: 16 hex digits, no hyphen.

    Raises
    ------
    UsageError
        ``vessel_name``.

    Examples
    --------
    >>> earlier_key("../../etc")
    '74ccf3c5b4c19a81'
    """
    return _hash(vessel)[:16]


def require_apart(held: Iterable[tuple[str, str]]) -> None:
    """Do nothing unless two names have one key: what can be read of them and 8 digits are the same, which is rare.

    Parameters
    ----------
    held : iterable of (str, str)
        Keys and names; the earlier name is given as the one that has the key.

    Raises
    ------
    UsageError
        ``vessel_key_taken``.
    """
    whose: dict[str, str] = {}
    for key, vessel in held:
        holder = whose.setdefault(key, vessel)
        if holder != vessel:
            raise UsageError(
                "vessel_key_taken",
                f"{vessel!r} would have the same folders as {holder!r}: both names have the key {key}.",
                "Spell one of them otherwise.",
                {"vessel": vessel, "held_by": holder, "vessel_key": key},
            )


def _readable(vessel: str) -> str:
    """Return the letters and digits of a name in lower case, with a hyphen for what stands between them."""
    plain = unicodedata.normalize("NFKD", vessel).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:_MOST_LETTERS].rstrip("-") or "vessel"


def _hash(vessel: str) -> str:
    try:
        if vessel.strip():
            return sha256(vessel)
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
