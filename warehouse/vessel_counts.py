"""How many logs, zigzags and parameter sets each vessel has."""

from __future__ import annotations

from typing import Any

from kempf.warehouse import logs, parameter_sets, segments, vessels
from kempf.warehouse.store import Warehouse


def vessel_counts(warehouse: Warehouse) -> list[dict[str, Any]]:
    """Return ``vessel``, ``logs``, ``segments`` and ``parameter_sets`` of each vessel, by name.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    held = [row.vessel for row in logs.current(warehouse)]
    found = [segment.vessel for segment in segments.current(warehouse)]
    sets = parameter_sets.summaries(warehouse)["vessel"].to_list()
    return [
        {"vessel": name, "logs": held.count(name), "segments": found.count(name), "parameter_sets": sets.count(name)}
        for name in vessels.names(warehouse)
    ]
