"""Tables of what people said: rows are only ever added, one a commit, and the commit says when.

The number of a row is its place in the table, so that of two people who speak at once one comes second.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from kempf.warehouse import delta
from kempf.warehouse.retry import with_retry
from kempf.warehouse.store import Warehouse


def add(warehouse: Warehouse, name: str, row: Mapping[str, Any]) -> int:
    """Add a row to a table of the warehouse, with the next ``number``.

    Parameters
    ----------
    name : str
        Of the table, which has a column ``number``.
    row : mapping
        Every other column.

    Returns
    -------
    int
        Its number, from 1.
    """

    def attempt() -> int:
        with delta.ensured(warehouse, name) as table:
            last = delta.rows(table, name, columns=("number",))["number"].max()
            number = (int(last) if isinstance(last, int) else 0) + 1
            # the predicate names what another writer would add at the same moment: the second one comes again
            delta.replace(table, name, [{**row, "number": number}], f"number = {number}")
            return number

    return with_retry(attempt)


def times(warehouse: Warehouse, name: str) -> dict[int, datetime]:
    """Return when each row of a table was added, by its number."""
    with delta.reading(warehouse, name) as table:
        if table is None:
            return {}
        writes = [entry for entry in table.history() if entry.get("operation") == "WRITE"][::-1]
        instants = [datetime.fromtimestamp(int(entry["timestamp"]) / 1000.0, UTC) for entry in writes]
        return dict(enumerate(instants, start=1))
