"""Putting the many small files that single commits leave into few; what the tables say stays the same."""

from __future__ import annotations

from functools import partial

from warehouse import delta
from warehouse.retry import with_retry
from warehouse.store import Warehouse

#: Tables that grow by single rows; readings come in whole files and are left alone.
_SMALL = ("vessels", "logs", "segments", "examinations", "parameter_sets", "aliases", "runs")


def compact(warehouse: Warehouse, more_files_than: int = 50) -> tuple[str, ...]:
    """Compact the tables that have many files. Earlier versions stay readable: nothing is deleted.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    more_files_than : int, optional
        Tables with fewer files are left alone.

    Returns
    -------
    tuple of str
        Names of the tables that were compacted.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    return tuple(name for name in _SMALL if with_retry(partial(_one, warehouse, name, more_files_than)))


def _one(warehouse: Warehouse, name: str, more_files_than: int) -> bool:
    table = delta.open_table(warehouse, name)
    if table is None or len(table.file_uris()) <= more_files_than:
        return False
    table.optimize.compact()
    return True
