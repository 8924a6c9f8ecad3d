"""What a warehouse says, without how it came to say it: file names, commits and table versions left out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pyarrow import fs

from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse

#: Runs record how the work went, which an interruption changes.
RUNS = ("runs", "run_history")
LASTING = tuple(name for name in TABLES if name not in RUNS)


def seen(warehouse: Warehouse) -> dict[str, list[dict[str, Any]]]:
    """The rows of every table that can be reached from a recorded ingest, sorted; the raw logs by their hash."""
    content: dict[str, list[dict[str, Any]]] = {name: delta.read(warehouse, name).rows(named=True) for name in LASTING}
    ingests = {row["ingest_id"] for row in content["logs"]}
    for name in ("readings", "rejected", "lost", "examinations", "segments"):
        content[name] = [row for row in content[name] if row["ingest_id"] in ingests]
    for row in content["parameter_sets"]:
        stated = json.loads(row["provenance_json"])
        row["provenance_json"] = json.dumps({k: v for k, v in stated.items() if k != "table_versions"}, sort_keys=True)
    files, root = warehouse._files
    kept = [
        f
        for f in files.get_file_info(fs.FileSelector(f"{root}/raw", recursive=True, allow_not_found=True))
        if f.is_file
    ]
    content["raw"] = [{"name": f.base_name, "size": f.size} for f in kept if not f.base_name.startswith(".")]
    return {name: sorted(rows, key=lambda row: json.dumps(row, sort_keys=True)) for name, rows in content.items()}


def versions(warehouse: Warehouse) -> dict[str, int]:
    """The newest version of every table but the runs."""
    return {name: version for name, version in delta.versions(warehouse).items() if name not in RUNS}


def fresh(path: Path) -> Warehouse:
    return Warehouse(str(path))
