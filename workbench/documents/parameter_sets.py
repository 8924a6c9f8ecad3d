"""Parameter sets, each with the names that point to it."""

from __future__ import annotations

from typing import Any

from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, vessels


def listed_sets(warehouse: Warehouse, vessel: str | None) -> list[dict[str, Any]]:
    """Return the parameter sets of one vessel or of all, in the order of time, as JSON content.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    if vessel is not None:
        vessels.require(warehouse, vessel)
    # a pooled set begins with its first manoeuvre: it comes behind that manoeuvre's own, whatever their ids
    summaries = parameter_sets.summaries(warehouse, vessel)
    rows = summaries.sort("vessel", "start_utc_ns", "estimator", "parameter_set_id").rows(named=True)
    pointed: dict[str, list[str]] = {}
    for name in sorted({row["vessel"] for row in rows}):
        for alias, target in aliases.of_vessel(warehouse, name).items():
            pointed.setdefault(target, []).append(alias)
    return [
        {**row, "start": iso_utc(row["start_utc_ns"]), "aliases": pointed.get(row["parameter_set_id"], [])}
        for row in rows
    ]
