"""What follows for a vessel where logs or manoeuvres of hers count no longer: which parameter sets go with them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, segments
from kempf.warehouse.tables.logs import LogRow


@dataclass(frozen=True)
class Affected:
    """What follows for a vessel where logs or manoeuvres of hers count no longer."""

    vessel: str
    #: Logs that go.
    logs: tuple[LogRow, ...]
    #: Ids of the segments that are found no longer, or are found otherwise.
    segment_ids: tuple[str, ...]
    #: Ids of the sets that are superseded.
    set_ids: tuple[str, ...]
    #: Whether her current set is among them.
    current: bool

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {
            "vessel": self.vessel,
            "logs": [{"log_id": row.log_id, "file_name": row.file_name} for row in self.logs],
            "segments": list(self.segment_ids),
            "superseded": list(self.set_ids),
            "current_superseded": self.current,
        }


def of_logs(warehouse: Warehouse, rows: Sequence[LogRow]) -> Affected:
    """Return what follows where some logs of one vessel count no longer.

    Parameters
    ----------
    rows : sequence of LogRow
        Current ones of one vessel, at least one.
    """
    vessel, ingests = rows[0].vessel, {row.ingest_id for row in rows}
    gone = tuple(segment.segment_id for segment in segments.found_in(warehouse, vessel) if segment.ingest_id in ingests)
    return _affected(warehouse, vessel, tuple(rows), gone, {row.log_id for row in rows}, set())


def of_segments(warehouse: Warehouse, vessel: str, segment_ids: Sequence[str]) -> Affected:
    """Return what follows where some manoeuvres of a vessel count no longer, or with other bounds."""
    return _affected(warehouse, vessel, (), tuple(segment_ids), set(), set(segment_ids))


def _affected(
    warehouse: Warehouse,
    vessel: str,
    rows: tuple[LogRow, ...],
    gone: tuple[str, ...],
    log_ids: Collection[str],
    segment_ids: Collection[str],
) -> Affected:
    held = parameter_sets.get_all(warehouse, vessel, standing_ids(warehouse, vessel))
    superseded = [
        parameter_set.parameter_set_id
        for parameter_set in held
        if not (
            set(parameter_set.log_ids).isdisjoint(log_ids) and set(parameter_set.segment_ids).isdisjoint(segment_ids)
        )
    ]
    current = aliases.of_vessel(warehouse, vessel).get(aliases.CURRENT)
    return Affected(vessel, rows, gone, tuple(superseded), current in superseded)
