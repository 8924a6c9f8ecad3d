"""The job that reads vessels' logs anew where a profile or the code has changed since they were read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from kempf.flows.process.commit_batch import together_or_each
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse import code_version, logs, raw, vessels
from kempf.warehouse.logs import LogRow
from kempf.warehouse.store import Warehouse

if TYPE_CHECKING:
    from kempf.flows.jobs.ingest_logs import ReadLog

#: Logs that are stored together, at most; and their bytes as delivered, which compression may hide twentyfold.
_MOST_LOGS, _MOST_BYTES = 60, 8 << 20


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


@dataclass(frozen=True)
class Stale:
    """Logs of a vessel that were read with another profile or other code than the present.

    Attributes
    ----------
    profile : VesselProfile
        The present one.
    logs : int
        Of hers in all.
    rows : tuple of LogRow
    """

    profile: VesselProfile
    logs: int
    rows: tuple[LogRow, ...]


def stale_logs(warehouse: Warehouse, vessel: str) -> Stale:
    """Find the logs of a vessel that are to be read anew.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    profile = vessels.current(warehouse, vessel)
    hers, code = logs.current(warehouse, vessel), code_version.fingerprint()
    stale = [row for row in hers if (row.profile_sha256, row.code_version) != (profile.sha256, code)]
    return Stale(profile, len(hers), tuple(stale))


def refresh_logs(warehouse: Warehouse, vessel: str, progress: Progress = silent) -> Refreshed:
    """Read anew, from the raw bytes, every log that was read with another profile or other code than the present.

    Results carry the code that made them in their identity; so nothing may be computed from readings of other code.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    return read_anew(warehouse, {vessel: stale_logs(warehouse, vessel)}, progress)[vessel]


def read_anew(warehouse: Warehouse, stale: Mapping[str, Stale], progress: Progress = silent) -> dict[str, Refreshed]:
    """Read the logs of several vessels anew; many short ones are stored in one commit a table.

    Parameters
    ----------
    warehouse : Warehouse
    stale : mapping of str to Stale
        By vessel.
    progress : Progress, optional

    Returns
    -------
    dict of str to Refreshed
        By vessel.
    """
    rows = [row for hers in stale.values() for row in hers.rows]
    if not rows:
        return {vessel: Refreshed(hers.logs, 0, {}) for vessel, hers in stale.items()}
    # the readers, the finder of zigzags and the doctor, which a vessel whose logs are up to date needs none of
    from kempf.flows.jobs.ingest_logs import look_through, store
    from kempf.flows.jobs.spool import spooled

    failed: dict[str, KempfError] = {}
    done = 0
    for chunk in _chunks(rows):
        read: dict[str, ReadLog] = {}
        with ExitStack() as until_stored:
            for row in chunk:
                progress(done, len(rows), f"reading {row.file_name}")
                done += 1
                profile = stale[row.vessel].profile
                try:
                    log = until_stored.enter_context(raw.opened(warehouse, row.log_id))
                    readings = until_stored.enter_context(spooled(row.file_name, log, profile))
                    read[row.ingest_id] = look_through(row.vessel, row.file_name, log, profile, readings)
                except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
                    failed[row.ingest_id] = wrapped(error)
            failed |= together_or_each(read, partial(store, warehouse))
    return {vessel: _refreshed(hers, failed) for vessel, hers in stale.items()}


def _refreshed(stale: Stale, failed: Mapping[str, KempfError]) -> Refreshed:
    own = {row.ingest_id: failed[row.ingest_id] for row in stale.rows if row.ingest_id in failed}
    return Refreshed(stale.logs, len(stale.rows) - len(own), own)


def _chunks(stale: Sequence[LogRow]) -> list[list[LogRow]]:
    """Return logs in groups that are stored by one commit a table and held in memory together; a long one alone."""
    chunks: list[list[LogRow]] = []
    for row in stale:
        last = chunks[-1] if chunks else []
        if last and len(last) < _MOST_LOGS and sum(r.size_bytes for r in last) + row.size_bytes <= _MOST_BYTES:
            last.append(row)
        else:
            chunks.append([row])
    return chunks
