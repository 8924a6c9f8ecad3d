"""The job that brings an earlier warehouse to the layout of this version."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kempf.flows.process.progress import Progress, silent
from kempf.warehouse.storage.marker import LAYOUT
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.migrations import chain


@dataclass(frozen=True)
class Migration:
    """What brings a warehouse forward, or brought it."""

    #: since: Layout that it had, the present one where there is nothing to do; until: layout that it has after.
    since: int
    until: int
    #: What is to be done in the next step, a phrase each.
    to_do: list[str]
    #: What was compared in the end, a sentence each; empty before.
    compared: list[str]

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {"from": self.since, "to": self.until, "done": self.to_do, "compared": self.compared}


def planned(warehouse: Warehouse) -> Migration:
    """Return what has to be done to a warehouse; nothing is.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``warehouse_layout``: it is newer; ``warehouse_marker_damaged``.
    """
    return Migration(chain.standing(warehouse), LAYOUT, chain.to_do(warehouse), [])


def migrate(warehouse: Warehouse, progress: Progress = silent) -> Migration:
    """Bring a warehouse to the layout of this version; one that was interrupted goes on.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``warehouse_damaged``, ``warehouse_busy``, ``migration_differs``, ``disk_full``, ...
    """
    plan = planned(warehouse)
    return Migration(plan.since, plan.until, plan.to_do, chain.migrate(warehouse, progress))
