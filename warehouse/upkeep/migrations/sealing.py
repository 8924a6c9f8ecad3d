"""Sealing what earlier versions, or a migration that was killed, left without a seal."""

from __future__ import annotations

from pathlib import Path

from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import seals
from kempf.warehouse.storage.store import Warehouse


def unsealed(warehouse: Warehouse) -> int:
    """Return how many commits of all tables have no seal; none in a bucket, where there are no seals."""
    return sum(len(seals.unsealed(folder)) for folder in _folders(warehouse))


def seal_all(warehouse: Warehouse) -> None:
    """Seal every commit of every table that is not sealed yet."""
    for folder in _folders(warehouse):
        seals.seal_every(folder)


def _folders(warehouse: Warehouse) -> list[Path]:
    """Return the folders of the tables that were written; none in a bucket."""
    root = warehouse.folder
    return [root / name for name in TABLES if (root / name / "_delta_log").is_dir()] if root is not None else []
