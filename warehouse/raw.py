"""Raw logs as delivered, by the SHA-256 of their bytes. Written once, never changed, checked whenever read."""

from __future__ import annotations

import hashlib

from schemas.errors import KempfError, NotFound
from warehouse.store import Warehouse


def log_id(data: bytes) -> str:
    """Return the id of a log: the SHA-256 of its bytes, 64 hex digits."""
    return hashlib.sha256(data).hexdigest()


def put(warehouse: Warehouse, data: bytes) -> str:
    """Keep a log; keeping it twice changes nothing.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    data : bytes
        The log as delivered.

    Returns
    -------
    str
        Its `log_id`.

    Raises
    ------
    KempfError
        ``warehouse_not_writable``.
    """
    name = log_id(data)
    warehouse.create()
    kept = warehouse.read_bytes(*_place(name))
    if kept is None or log_id(kept) != name:  # a damaged copy is mended by a whole one
        warehouse.write_bytes(data, *_place(name))
    return name


def get(warehouse: Warehouse, name: str) -> bytes:
    """Return a log as delivered.

    Raises
    ------
    NotFound
        ``no_warehouse``, or ``no_raw_log``: the log was never kept here.
    KempfError
        ``raw_bytes_damaged``: what is kept no longer has the hash it is kept under.
    """
    warehouse.require()
    is_hash = len(name) == 64 and set(name) <= set("0123456789abcdef")
    data = warehouse.read_bytes(*_place(name)) if is_hash else None
    if data is None:
        raise NotFound(
            "no_raw_log",
            f"The warehouse {warehouse.uri} keeps no raw log {name!r}.",
            "Ingest the file again with `kempf ingest`; `kempf segments` lists the logs that are kept.",
            {"log_id": name},
        )
    found = log_id(data)
    if found != name:
        raise KempfError(
            "raw_bytes_damaged",
            f"The raw log {name} is damaged: its {len(data)} bytes have the hash {found}.",
            "Ingest the original file again: it replaces the damaged copy.",
            {"log_id": name, "found": found, "size_bytes": len(data)},
        )
    return data


def _place(name: str) -> tuple[str, ...]:
    return ("raw", name[:2], name)
