"""The measured logs through the main job, each source once: where they are absent the tests skip and say so."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks import measured_ships
from benchmarks.measured_ships import Ship
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome
from kempf.warehouse.storage.store import Warehouse

SHARED = Path(__file__).parents[2].parent / "shared"


@dataclass(frozen=True)
class Voyage:
    """A ship, the warehouse that took her logs in, and what became of each, by file name."""

    ship: Ship
    warehouse: Warehouse
    outcomes: dict[str, IngestOutcome]


def require(*parts: str) -> None:
    """Skip where a folder of the measured data is not there."""
    folder = SHARED.joinpath(*parts)
    if not folder.is_dir():
        pytest.skip(f"the measured data {folder} are not here")


def sail(ship: Ship, warehouse: Warehouse) -> Voyage:
    taken = measured_ships.take_in(warehouse, ship)
    return Voyage(ship, warehouse, {path.name: o for path, o in zip(ship.logs, taken, strict=True)})
