"""Tables to which rows are only ever added; the commit says when.

The number of a row is the place of its commit, so that of two who add at once one comes second.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse

if TYPE_CHECKING:
    from deltalake import DeltaTable


def add(warehouse: Warehouse, name: str, *rows: Mapping[str, Any]) -> int:
    """Add rows to a table of the warehouse by one commit, with the next ``number``.

    Parameters
    ----------
    name : str
        Of the table, which has a column ``number``.
    *rows : mapping
        Every other column; at least one row.

    Returns
    -------
    int
        Their number, from 1: the place of the commit.
    """

    def attempt() -> int:
        with delta.ensured(warehouse, name) as table:
            # also where rows were lost: a number is never given again
            number = len(_writes(table)) + 1
            # the predicate names what another writer would add at the same moment: the second one comes again
            delta.replace(table, name, [{**row, "number": number} for row in rows], f"number = {number}")
            return number

    return with_retry(attempt)


def times(warehouse: Warehouse, name: str) -> dict[int, datetime]:
    """Return when the rows of a table were added, by their number."""
    with delta.reading(warehouse, name) as table:
        if table is None:
            return {}
        instants = [datetime.fromtimestamp(int(entry["timestamp"]) / 1000.0, UTC) for entry in _writes(table)]
        return dict(enumerate(instants, start=1))


def _writes(table: DeltaTable) -> list[dict[str, Any]]:
    """Return the commits of a table that added rows, in order; what brought it forward wrote rows again."""
    every = table.history()[::-1]
    return [entry for entry in every if entry.get("operation") == "WRITE" and delta.BROUGHT not in entry]
