"""What was read of tables and is read again and again, kept for as long as these tables stay as they were.

Bringing a vessel up to date asks a dozen times for her logs and segments, from as many jobs; to make their rows anew
each time would cost more than all else once she has thousands.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Hashable, Sequence
from typing import TypeVar

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.storage.table_cache import commit_of

T = TypeVar("T")
_Versions = tuple[tuple[int, object] | None, ...]

#: Results that are kept, of whatever tables: those of one vessel are asked for together.
_MOST = 16
_lock = threading.Lock()
#: By process (results do not survive a fork), warehouse, tables and question: the versions, and what was made of them.
_kept: dict[Hashable, tuple[_Versions, object]] = {}


def cached(warehouse: Warehouse, tables: Sequence[str], question: Hashable, make: Callable[[], T]) -> T:
    """Return what ``make`` reads of some tables, without reading them again where none has a newer version.

    What is returned is not to be changed.

    Parameters
    ----------
    tables : sequence of str
        All that it reads.
    question : hashable
        What is asked of them.
    make : callable
        Reads it.
    """
    key = (os.getpid(), warehouse.uri, tuple(tables), question)
    versions = tuple(_version(warehouse, name) for name in tables)
    with _lock:
        held = _kept.pop(key, None)
        if held is not None and held[0] == versions:
            _kept[key] = held  # the newest last
            return held[1]  # type: ignore[return-value]
    result = make()
    # read between two versions it is of neither
    if versions == tuple(_version(warehouse, name) for name in tables):
        with _lock:
            _kept[key] = versions, result
            while len(_kept) > _MOST:
                del _kept[next(iter(_kept))]
    return result


def _version(warehouse: Warehouse, name: str) -> tuple[int, object] | None:
    """Return the newest version of a table and the mark of its commit: another warehouse may come to stand there."""
    with delta.reading(warehouse, name) as table:
        return None if table is None else (table.version(), warehouse.mark_of(name, *commit_of(table.version())))
