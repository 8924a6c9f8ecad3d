"""How many logs, manoeuvres to fit and parameter sets each vessel has, and what her models rest on."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, segments, vessels


@dataclass(frozen=True)
class VesselCount:
    """What there is of one vessel."""

    vessel: str
    logs: int
    #: Manoeuvres that a model is fitted to.
    segments: int
    parameter_sets: int
    #: Effects in any of her sets, whether it is her current one or not.
    effects: frozenset[str]
    #: Whether each of her sets of several manoeuvres, of all where there is none, rests on one that counts no longer.
    outdated: bool

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {name: getattr(self, name) for name in ("vessel", "logs", "segments", "parameter_sets")}


def counted(warehouse: Warehouse) -> list[VesselCount]:
    """Return what there is of each vessel, by name, with four reads of tables however many there are.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    rows = logs.current(warehouse)
    held = Counter(row.vessel for row in rows)
    every = segments.of_ingests(warehouse, [row.ingest_id for row in rows])
    fitted = [segment for segment in every if segment.is_fitted and segment.excluded is None]
    manoeuvres, counting = Counter(segment.vessel for segment in fitted), {segment.segment_id for segment in fitted}
    columns = ("vessel", "model_name", "segment_ids")
    sets: dict[str, list[tuple[str, list[str]]]] = {}
    for vessel, model, names in delta.read(warehouse, "parameter_sets", {}, columns).rows():
        sets.setdefault(vessel, []).append((model, names))
    return [
        VesselCount(
            name,
            held[name],
            manoeuvres[name],
            len(sets.get(name, ())),
            # a model is called by all that is in it, such as "plain + rudder_lag"
            frozenset(effect for model, _ in sets.get(name, ()) for effect in model.split(" + ")[1:]),
            _outdated([names for _, names in sets.get(name, ())], counting),
        )
        for name in vessels.names(warehouse)
    ]


def _outdated(sets: list[list[str]], counting: set[str]) -> bool:
    models = [names for names in sets if len(names) > 1] or sets
    return bool(models) and not any(counting.issuperset(names) for names in models)


def vessel_counts(warehouse: Warehouse) -> list[dict[str, Any]]:
    """Return ``vessel``, ``logs``, ``segments`` and ``parameter_sets`` of each vessel, by name.

    The segments are those that a model is fitted to.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    return [vessel.as_json() for vessel in counted(warehouse)]
