"""The job that reads a vessel's logs anew where her profile or the code has changed since they were read."""

from __future__ import annotations

from dataclasses import dataclass

from flows.ingest_logs import ingest_bytes
from flows.progress import Progress, silent
from flows.unforeseen import as_told
from schemas.errors import KempfError
from warehouse import code_version, logs, raw, vessels
from warehouse.store import Warehouse


@dataclass(frozen=True)
class Refreshed:
    """What was done.

    Attributes
    ----------
    logs, reread : int
        Logs in all, and those read anew.
    failed : dict of str to KempfError
        By ingest id: logs that could not be read anew; what was read of them before stands, but is out of date.
    """

    logs: int
    reread: int
    failed: dict[str, KempfError]


def refresh_logs(warehouse: Warehouse, vessel: str, progress: Progress = silent) -> Refreshed:
    """Read anew, from the raw bytes, every log that was read with another profile or other code than the present.

    Results carry the code that made them in their identity; so nothing may be computed from readings of other code.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    profile = vessels.current(warehouse, vessel)
    hers, code = logs.current(warehouse, vessel), code_version.fingerprint()
    stale = [row for row in hers if (row.profile_sha256, row.code_version) != (profile.sha256, code)]
    failed: dict[str, KempfError] = {}
    for done, row in enumerate(stale):
        progress(done, len(stale), f"reading {row.file_name}")
        try:
            data = raw.get(warehouse, row.log_id)
            ingest_bytes(warehouse, vessel, row.file_name, data, profile, row.file_name)
        except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
            failed[row.ingest_id] = as_told(error)
    return Refreshed(len(hers), len(stale) - len(failed), failed)
