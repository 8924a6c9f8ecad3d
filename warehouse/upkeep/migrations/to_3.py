"""Layout 3: readings by vessel and month, every table of a folder sealed, one alias ``current``, raw logs described.

Each part looks for what is still to be done and does that, so that a migration that was killed goes on.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from kempf.schemas.errors import KempfError
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, deposit
from kempf.warehouse.upkeep.migrations import by_month, commits, sealing

#: Tables that are laid out by vessel and month.
BY_MONTH = ("readings", "rejected")
#: What earlier versions pointed to the model with effects and to the pooled set, before there was one ``current``; they
#: came first where a warehouse still had them.
_BEFORE_CURRENT = ("model", "pooled")


def to_do(warehouse: Warehouse) -> list[str]:
    """Return what is to be done to a warehouse of layout 2, a phrase each."""
    phrases = []
    for name in BY_MONTH:
        ingests = by_month.missing(warehouse, name)
        if ingests:
            rows = sum(ingest.rows for ingest in ingests)
            phrases.append(f"{name} of {len(ingests)} ingests ({rows} rows) are laid out by vessel and month")
        elif by_month.is_by_log(warehouse, name):
            phrases.append(f"{name}, which has no rows, is laid out by vessel and month")
    pointed = _pointed(warehouse)
    if pointed:
        phrases.append(f"{len(pointed)} aliases of before there was 'current' become 'current'")
    unsealed = sealing.unsealed(warehouse)
    if unsealed:
        phrases.append(f"{unsealed} commits of tables are sealed")
    logs = len(deposit.not_described(warehouse))
    if logs:
        phrases.append(f"{logs} raw logs are described beside their bytes")
    return phrases


def holds(warehouse: Warehouse) -> bool:
    """Return whether a warehouse of which that is not known has layout 3, by the folders of its readings.

    Every later version makes these; a table that cannot be opened shows nothing.
    """
    for name in BY_MONTH:
        with suppress(KempfError):
            if by_month.is_by_log(warehouse, name) or by_month.missing(warehouse, name):
                return False
    return True


def carry_out(warehouse: Warehouse, look: commits.Look) -> list[str]:
    """Bring a warehouse of layout 2 to layout 3.

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
        ``warehouse_busy``, ``migration_differs``, ``table_damaged``, ``disk_full``, ...
    """
    look(0, 1, "seals")
    sealing.seal_all(warehouse)
    _one_current(warehouse)
    compared = commits.carry_out(warehouse, BY_MONTH, by_month, look)
    look(0, 1, "raw logs")
    deposit.describe_all(warehouse)
    sealing.seal_all(warehouse)
    return [f"{name}: {count} ingests have the same rows as before." for name, count in compared.items()]


def _one_current(warehouse: Warehouse) -> None:
    """Let ``current`` point to what commands took for it where aliases of before stand beside it, or alone.

    In one commit. Rows keep the key that they have: it is that of layout 2.
    """
    pointed = _pointed(warehouse)
    if not pointed:
        return
    with delta.ensured(warehouse, "aliases") as table:
        chosen = {row["vessel"]: row for alias in reversed(_BEFORE_CURRENT) for row in pointed if row["alias"] == alias}
        rows = [{**row, "alias": aliases.CURRENT} for row in chosen.values()]
        of_vessels = one_of("vessel_key", [row["vessel_key"] for row in rows])
        delta.replace(
            table, "aliases", rows, f"{of_vessels} AND {one_of('alias', (*_BEFORE_CURRENT, aliases.CURRENT))}"
        )


def _pointed(warehouse: Warehouse) -> list[dict[str, Any]]:
    """Return the rows of the aliases of before."""
    return delta.read(warehouse, "aliases", {"alias": list(_BEFORE_CURRENT)}).rows(named=True)
