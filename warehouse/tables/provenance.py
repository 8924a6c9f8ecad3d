"""What is written down of how a parameter set was made, so that it can be made again from the raw bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kempf.warehouse.code import code_version
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations
from kempf.warehouse.tables.parameter_set import Inputs


def collect(
    warehouse: Warehouse | None,
    inputs: Inputs,
    ingest_ids: Sequence[str],
    flow_run: str | None = None,
    table_versions: Mapping[str, int] | None = None,
    vessel: str | None = None,
) -> dict[str, Any]:
    """Return the provenance of a parameter set made now from these inputs.

    Parameters
    ----------
    warehouse : Warehouse or None
        Whose table versions are written down; None for none.
    inputs : Inputs
        What the id is made of.
    ingest_ids : sequence of str
        Where the readings were taken from.
    flow_run : str, optional
        Run that made it.
    table_versions : mapping of str to int, optional
        Taken before the work began; the present ones by default.
    vessel : str, optional
        Whose logs they are: what others have need not be looked into.

    Returns
    -------
    dict
        JSON content with the keys ``inputs``, ``ingest_ids``, ``profile_sha256``, ``code_version`` (that
        under which the code goes on), ``made_by`` (its own), ``git_commit``,
        ``packages``, ``python``, ``machine`` (system, processor, hash of all that is installed), ``table_versions``,
        ``flow_run``, ``channels``: what the channel doctor said of the logs when the set was made, by log id, those
        with nothing to say left out.
    """
    whose = None if vessel is None else [vessel]
    seen = (
        examinations.of_ingests(warehouse, ingest_ids, whose).values() if warehouse is not None and ingest_ids else ()
    )
    if table_versions is None:
        table_versions = delta.versions(warehouse) if warehouse is not None else {}
    installed = code_version.packages()
    return {
        "inputs": inputs.as_json(),
        "ingest_ids": sorted(set(ingest_ids)),
        "profile_sha256": inputs.profile_sha256,
        "code_version": inputs.code_version,
        "made_by": code_version.fingerprint("estimate"),
        "git_commit": code_version.git_commit(),
        "packages": {name: version for name, version in installed.items() if name != "python"},
        "python": installed["python"],
        "machine": code_version.machine(),
        "table_versions": dict(sorted(table_versions.items())),
        "flow_run": flow_run,
        "channels": {examination.log_id: list(examination.findings) for examination in seen if examination.findings},
    }
