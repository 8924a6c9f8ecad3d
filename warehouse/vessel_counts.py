"""How many logs, manoeuvres to fit and parameter sets each vessel has."""

from __future__ import annotations

from collections import Counter
from typing import Any

from kempf.warehouse import logs, parameter_sets, segments, vessels
from kempf.warehouse.store import Warehouse


def vessel_counts(warehouse: Warehouse) -> list[dict[str, Any]]:
    """Return ``vessel``, ``logs``, ``segments`` and ``parameter_sets`` of each vessel, by name.

    The segments are those that a model is fitted to.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    rows = logs.current(warehouse)
    held = Counter(row.vessel for row in rows)
    every = segments.of_ingests(warehouse, [row.ingest_id for row in rows])
    manoeuvres = Counter(segment.vessel for segment in every if segment.is_fitted and segment.excluded is None)
    sets = Counter(parameter_sets.summaries(warehouse)["vessel"].to_list())
    return [
        {"vessel": name, "logs": held[name], "segments": manoeuvres[name], "parameter_sets": sets[name]}
        for name in vessels.names(warehouse)
    ]
