"""Open tables kept between readings: one of many files takes long to open anew and next to nothing to bring up to date.

A handle is lent to one borrower at a time and brought to the newest version first, so that whoever holds it reads one
version all the while. One whose newest commit is not the file it was (the folder was replaced) is thrown away.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from kempf.warehouse.storage.store import Warehouse

if TYPE_CHECKING:
    from deltalake import DeltaTable

#: Handles kept in all; of more the one that was used longest ago goes.
MOST = 24

#: Commits that a handle is brought forward over before it is opened anew: the library keeps apart what each of them
#: brought, and every question goes through all of these pieces. Opening costs less than a commit does.
MOST_COMMITS = 32

#: Attribute of a handle: the version at which it was opened.
_BORN = "kempf_born"

_lock = threading.Lock()
_kept: list[tuple[tuple[object, ...], tuple[int, ...], DeltaTable]] = []


@contextmanager
def borrowed(
    warehouse: Warehouse, name: str, opened: Callable[[Warehouse, str], DeltaTable | None]
) -> Iterator[DeltaTable | None]:
    """Lend a table at its newest version to one thread, None where it was never written.

    Parameters
    ----------
    name : str
        Of the table.
    opened : callable
        Opens it where no handle is at hand; it says in words what is wrong where the storage does not answer.
    """
    from deltalake.exceptions import CommitFailedError

    key = _key(warehouse, name)
    table = _taken(warehouse, name, key)
    if table is None:
        table = opened(warehouse, name)
        if table is not None:
            vars(table)[_BORN] = table.version()
    try:
        yield table
    except CommitFailedError:  # a lost race is no fault of the handle, and the next attempt wants it
        _keep(warehouse, name, key, table)
        raise
    # behind the yield: a handle over which something else went wrong is not kept
    _keep(warehouse, name, key, table)


def _key(warehouse: Warehouse, name: str) -> tuple[object, ...]:
    # handles do not survive a fork
    return (os.getpid(), warehouse.address(name), tuple(sorted((warehouse.options or {}).items())))


def _taken(warehouse: Warehouse, name: str, key: tuple[object, ...]) -> DeltaTable | None:
    from deltalake.exceptions import DeltaError

    with _lock:
        at = next((i for i in range(len(_kept) - 1, -1, -1) if _kept[i][0] == key), None)
        if at is None:
            return None
        _, mark, table = _kept.pop(at)
    with suppress(DeltaError, OSError, ValueError):
        if warehouse.mark_of(name, *commit_of(table.version())) != mark:
            return None
        # in a bucket asking for a commit that is not there costs more than the update
        if warehouse.folder is None or warehouse.mark_of(name, *commit_of(table.version() + 1)) is not None:
            table.update_incremental()
        return table
    return None


def _keep(warehouse: Warehouse, name: str, key: tuple[object, ...], table: DeltaTable | None) -> None:
    mark = None
    if table is not None:
        with suppress(OSError):  # what was done with the table is done: a bucket that is gone now shows at the next
            mark = warehouse.mark_of(name, *commit_of(table.version()))
    if table is None or mark is None or table.version() - vars(table)[_BORN] > MOST_COMMITS:
        return
    with _lock:
        _kept.append((key, mark, table))
        del _kept[:-MOST]


def commit_of(version: int) -> tuple[str, str]:
    """Return where the commit of a version stands below its table."""
    return "_delta_log", f"{version:020d}.json"
