"""Which tables were ever written, kept outside their folders: one that is lost whole is none that never was.

Beside the marker, in the folder ``written``, is a small file for each table. It is written once the table is there and
before its first row, and stays: where it is there and the table is not, the table is lost.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime

from kempf.warehouse.storage.store import Warehouse

#: below the warehouse
FOLDER = "written"


def note(warehouse: Warehouse, name: str) -> None:
    """Keep that a table is there; where that is kept already nothing is written."""
    if not is_noted(warehouse, name):
        _write(warehouse, name, None)


def note_anew(warehouse: Warehouse, name: str) -> None:
    """Keep that a table that was lost is made anew: its versions begin from 0 once more."""
    _write(warehouse, name, int(datetime.now(UTC).timestamp() * 1000.0))


def is_noted(warehouse: Warehouse, name: str) -> bool:
    """Return whether it is kept that a table was written."""
    return warehouse.size_of(FOLDER, name) is not None


def made_anew_at_ms(warehouse: Warehouse, name: str) -> int | None:
    """Return when a table that was lost was made anew, ms since 1970: versions named before that are another table's.

    None where the table was never lost.
    """
    data = warehouse.read_bytes(FOLDER, name)
    try:
        content = None if data is None else json.loads(data)
    except ValueError:
        return None
    return content.get("made_anew_at_ms") if isinstance(content, dict) else None


def _write(warehouse: Warehouse, name: str, made_anew_at_ms: int | None) -> None:
    content = {"table": name, "made_anew_at_ms": made_anew_at_ms}
    warehouse.write_bytes(json.dumps(content).encode() + b"\n", FOLDER, name)
