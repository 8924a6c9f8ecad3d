"""The logs of a case, read into a warehouse."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.warehouse.storage.store import Warehouse


def taken_in(files: Mapping[str, bytes], place: Path) -> Warehouse:
    """Write the files of a case to a folder and ingest her logs as `kempf ingest` does it.

    Parameters
    ----------
    files : mapping
        Content by name, ``profile.yaml`` among them; see `benchmarks.diagnose.hidden_effects.write.logs_of`.
    place : Path
        An empty folder; the warehouse is in it.
    """
    for name, content in files.items():
        (place / name).write_bytes(content)
    warehouse = Warehouse(str(place / "warehouse"))
    logs = sorted(place / name for name in files if name != "profile.yaml")
    ingest(warehouse, logs, None, read_profiles([place / "profile.yaml"]))
    return warehouse
