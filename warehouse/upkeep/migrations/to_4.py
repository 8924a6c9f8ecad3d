"""Layout 4: the key of a vessel, by which her folders are called, is made of her name.

Each table is looked at for what is still to be done, so that a migration that was killed goes on.
"""

from __future__ import annotations

from contextlib import suppress

from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.migrations import by_name, commits, sealing


def to_do(warehouse: Warehouse) -> list[str]:
    """Return what is to be done to a warehouse of layout 3, or of an earlier one, a phrase each."""
    held = {name: by_name.missing(warehouse, name) for name in by_name.tables()}
    tables = [name for name, folders in held.items() if folders]
    rows = sum(folder.rows for folders in held.values() for folder in folders)
    return [f"{rows} rows of {len(tables)} tables get keys that read as their vessels' names"] if tables else []


def holds(warehouse: Warehouse) -> bool:
    """Return whether a warehouse of which that is not known has layout 4, by the keys in its tables.

    A table that cannot be read shows nothing.
    """
    for name in by_name.tables():
        with suppress(KempfError):
            if by_name.missing(warehouse, name):
                return False
    return True


def carry_out(warehouse: Warehouse, look: commits.Look) -> list[str]:
    """Bring a warehouse of layout 3 to layout 4.

    Parameters
    ----------
    warehouse : Warehouse
        Opened to be brought forward.
    look : callable
        Takes how much of how much is done, and what is done next.

    Returns
    -------
    list of str
        What was compared in the end, a sentence each.

    Raises
    ------
    KempfError
        ``warehouse_busy``, ``migration_differs``, ``vessel_key_unknown``, ``table_damaged``, ``disk_full``, ...
    """
    compared = commits.carry_out(warehouse, by_name.tables(), by_name, look)
    sealing.seal_all(warehouse)
    return [
        f"{name}: {count} vessel{'s have' if count > 1 else ' has'} the same rows as before."
        for name, count in compared.items()
    ]
