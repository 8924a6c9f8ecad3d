"""Tables that this process has open already: brought up to date by what was committed since, not opened anew.

Opening a table reads its last checkpoint and every commit behind it; bringing an open one up to date reads the new
commits alone, a tenth of the time and less. A handle is used by one thread at a time, and by nobody else until it is
given back: what was read from it is what a commit rests on.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from warehouse.store import Warehouse

if TYPE_CHECKING:
    from deltalake import DeltaTable

_Key = tuple[object, ...]

#: Idle handles that are kept of one table, and of all; the ones used last stay.
_OF_ONE, _OF_ALL = 8, 64

_idle: dict[_Key, list[DeltaTable]] = {}
_lock = threading.Lock()


@contextmanager
def borrowed(warehouse: Warehouse, name: str, opened: Callable[[], DeltaTable | None]) -> Iterator[DeltaTable | None]:
    """Lend a handle at the newest version of a table; after an error other than a lost race all are opened anew.

    Parameters
    ----------
    warehouse : Warehouse
    name : str
        Of the table.
    opened : callable
        Opens it where no handle is idle; None where there is no table.

    Yields
    ------
    DeltaTable or None
        For this thread alone, until the block ends.
    """
    from deltalake.exceptions import CommitFailedError, DeltaError

    key = _key(warehouse, name)
    table = _take(key)
    if table is not None:
        try:
            table.update_incremental()
        except (DeltaError, OSError, ValueError):  # opening it says what is wrong, in words
            table = None
    table = table if table is not None else opened()
    try:
        yield table
    except CommitFailedError:
        _give_back(_key(warehouse, name), table)
        raise
    except BaseException:
        with _lock:  # the others may be as wrong: of a table that was deleted and made anew in a bucket
            _idle.pop(key, None)
        raise
    _give_back(_key(warehouse, name), table)  # it may have been made meanwhile


def _key(warehouse: Warehouse, name: str) -> _Key:
    """Return what a handle stands for: the address, who asks, and, in a folder, the very table that is there now."""
    asks = tuple(sorted((warehouse.options or {}).items()))
    if warehouse.folder is None:
        return (os.getpid(), warehouse.address(name), asks)
    try:
        born = (warehouse.folder / name / "_delta_log" / f"{0:020d}.json").stat()
    except OSError:
        return (os.getpid(), warehouse.address(name), asks)
    return (os.getpid(), warehouse.address(name), asks, born.st_ino, born.st_mtime_ns)


def _take(key: _Key) -> DeltaTable | None:
    with _lock:
        idle = _idle.get(key)
        return idle.pop() if idle else None


def _give_back(key: _Key, table: DeltaTable | None) -> None:
    if table is None:
        return
    with _lock:
        idle = _idle.pop(key, [])
        _idle[key] = [*idle, table][-_OF_ONE:]  # at the end of the order: used last
        while sum(map(len, _idle.values())) > _OF_ALL:
            del _idle[next(iter(_idle))]
