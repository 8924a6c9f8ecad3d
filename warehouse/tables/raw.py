"""Raw logs as delivered, by the SHA-256 of their bytes. Written once, never changed, checked whenever read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.errors import DataRejected, KempfError, NotFound
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import purges

#: A log that is shorter is fetched once, and held; a longer one is read again where it lies. Bytes.
_SHORT = 32 << 20


def put(warehouse: Warehouse, log: LogFile) -> str:
    """Keep a log; keeping it twice changes nothing.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    log : LogFile
        As delivered.

    Returns
    -------
    str
        Its id: the SHA-256 of its bytes, 64 hex digits.

    Raises
    ------
    DataRejected
        ``log_changed``: its bytes are others than when its hash was first taken; nothing is kept.
    KempfError
        ``warehouse_not_writable``, ``disk_full``.
    """
    name = log.sha256
    warehouse.create()
    if is_whole(warehouse, name):
        for _ in _unchanged(log):
            pass
    else:  # a damaged copy is replaced by a whole one
        warehouse.write(_unchanged(log), *_place(name))
    return name


def _unchanged(log: LogFile) -> Iterator[bytes]:
    """Yield the bytes of a log, and fail at their end where they are no longer those that it is known by."""
    digest = hashlib.sha256()
    for piece in log.pieces():
        digest.update(piece)
        yield piece
    if digest.hexdigest() != log.sha256:
        raise DataRejected(
            "log_changed",
            f"The log changed while it was read: its hash was {log.sha256}, and is {digest.hexdigest()}.",
            "Wait until nothing writes to it any more, or copy it; then ingest it again.",
            {"before": log.sha256, "after": digest.hexdigest()},
        )


@contextmanager
def opened(warehouse: Warehouse, name: str) -> Iterator[LogFile]:
    """Open a log as delivered; its bytes were checked.

    Raises
    ------
    NotFound
        ``no_warehouse``, or ``no_raw_log``: the log was never kept here.
    DataRejected
        ``log_purged``.
    KempfError
        ``raw_bytes_damaged``: what is kept no longer has the hash it is kept under.
    """
    warehouse.require()
    with warehouse.opened(*_place(name)) as stream:
        if stream is None:
            purges.refuse(warehouse, [name])
            raise NotFound(
                "no_raw_log",
                f"The warehouse {warehouse.uri} keeps no raw log {name!r}.",
                "Ingest the file again with `kempf ingest`; `kempf segments` lists the logs that are kept.",
                {"log_id": name},
            )
        log = LogFile(stream)
        if log.size < _SHORT:
            log = LogFile(log.whole())
        if log.sha256 != name:
            raise KempfError(
                "raw_bytes_damaged",
                f"The raw log {name} is damaged: its {log.size} bytes have the hash {log.sha256}.",
                "Ingest the original file again: it replaces the damaged copy.",
                {"log_id": name, "found": log.sha256, "size_bytes": log.size},
            )
        yield log


def describe(warehouse: Warehouse, name: str, facts: Mapping[str, Any]) -> None:
    """Keep beside a log whose it is and how it is read, so that the tables can be made again from the raw logs alone.

    Parameters
    ----------
    facts : mapping
        JSON content: ``vessel``, ``file_name``, ``profile``, ``removed``.
    """
    data = canonical_json(dict(facts)).encode()
    if warehouse.read_bytes(*_beside(name)) != data:
        warehouse.write_bytes(data, *_beside(name))


def described(warehouse: Warehouse, name: str) -> dict[str, Any] | None:
    """Return what is kept beside a log; None where it is nothing, or damaged."""
    data = warehouse.read_bytes(*_beside(name))
    try:
        facts = None if data is None else json.loads(data)
    except ValueError:
        return None
    return facts if isinstance(facts, dict) and {"vessel", "file_name", "profile"} <= facts.keys() else None


def is_half_described(warehouse: Warehouse, name: str) -> bool:
    """Return whether something is kept beside a log that cannot be read."""
    return described(warehouse, name) is None and warehouse.size_of(*_beside(name)) is not None


def delete(warehouse: Warehouse, name: str) -> None:
    """Delete a log, what is kept beside it, and what writers of it that were killed left behind; no receipt of that."""
    for file in left_of(warehouse, name):
        warehouse.delete(*_place(name)[:-1], file)


def left_of(warehouse: Warehouse, name: str) -> list[str]:
    """Return the names of the files of a log: its bytes, what is kept beside them, what killed writers left behind.

    The receipt of a purge is not among them.
    """
    files = warehouse.files_below(*_place(name)[:-1])
    return [file for file in files if name in file and file != f"{name}{purges.NOTE}"]


def kept(warehouse: Warehouse) -> list[str]:
    """Return the ids of all logs that are kept as delivered, sorted."""
    return [name for name in warehouse.files_below("raw") if len(name) == 64]


def is_whole(warehouse: Warehouse, name: str) -> bool:
    """Return whether a log is kept with the bytes that it is known by; False too where it is not kept at all."""
    with warehouse.opened(*_place(name)) as stream:
        return stream is not None and LogFile(stream).sha256 == name


def _beside(name: str) -> tuple[str, ...]:
    *folder, last = _place(name)
    return (*folder, f"{last}.json")


def _place(name: str) -> tuple[str, ...]:
    is_hash = len(name) == 64 and set(name) <= set("0123456789abcdef")
    return ("raw", name[:2], name) if is_hash else ("raw", "none")
