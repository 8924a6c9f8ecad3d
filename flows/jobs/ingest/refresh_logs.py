"""The job that reads and looks through vessels' logs anew where a profile or the code has changed since."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import TYPE_CHECKING

from kempf.flows.jobs.state.out_of_date import unread, unsearched
from kempf.flows.process.commit_batch import together_or_each
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import corrections, logs, raw, vessels
from kempf.warehouse.tables.equivalents import codes_of
from kempf.warehouse.tables.logs import LogRow

if TYPE_CHECKING:
    from kempf.flows.jobs.ingest.ingest_logs import ReadLog
    from kempf.flows.jobs.ingest.search_log import SearchedLog

#: Logs that are stored together, at most; and their bytes as delivered, which compression may hide twentyfold.
_MOST_LOGS, _MOST_BYTES = 60, 8 << 20

_log = logging.getLogger("kempf.jobs")


@dataclass(frozen=True)
class Refreshed:
    """What was done."""

    #: logs, reread, searched: Logs in all, those read anew, and those of the others whose readings were looked through
    #: anew.
    logs: int
    reread: int
    searched: int
    #: By ingest id: logs that could not be read or looked through anew; what was read of them before stands, but is out
    #: of date.
    failed: dict[str, KempfError]


@dataclass(frozen=True)
class Stale:
    """Logs of a vessel of which something was made with another profile or by other code than the present."""

    #: The present one.
    profile: VesselProfile
    #: Of hers in all.
    logs: int
    #: Read with another profile or by other code.
    unread: tuple[LogRow, ...]
    #: Those of the others in whose readings other code has looked for manoeuvres.
    unsearched: tuple[LogRow, ...]

    @property
    def rows(self) -> tuple[LogRow, ...]:
        """All of them."""
        return self.unread + self.unsearched


def stale_logs(warehouse: Warehouse, vessel: str) -> Stale:
    """Find the logs of a vessel that are to be read, or to be looked through, anew.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    profile = vessels.current(warehouse, vessel)
    hers = logs.current(warehouse, vessel)
    old = unread(warehouse, hers, {vessel: profile.sha256})
    names = {row.ingest_id for row in old}
    others = [row for row in hers if row.ingest_id not in names]
    return Stale(profile, len(hers), tuple(old), tuple(unsearched(warehouse, others)))


def refresh_logs(warehouse: Warehouse, vessel: str, progress: Progress = silent) -> Refreshed:
    """Read anew, from the raw bytes, the logs that were read with another profile or by other code than the present.

    Those that were only looked through by other code are looked through anew, from the readings that are stored.
    Results carry the code that made them in their identity; so nothing may be computed from what other code made.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    return refresh_all(warehouse, {vessel: stale_logs(warehouse, vessel)}, progress)[vessel]


def refresh_all(warehouse: Warehouse, stale: Mapping[str, Stale], progress: Progress = silent) -> dict[str, Refreshed]:
    """Do as `refresh_logs` for several vessels; many short logs are stored in one commit a table.

    Parameters
    ----------
    stale : mapping of str to Stale
        By vessel.

    Returns
    -------
    dict of str to Refreshed
        By vessel.
    """
    done, steps = count(), sum(len(hers.rows) for hers in stale.values())

    def begin(what: str) -> None:
        progress(next(done), steps, what)

    profiles = {vessel: hers.profile for vessel, hers in stale.items()}
    if steps:
        unread_logs = sum(len(hers.unread) for hers in stale.values())
        _log.info("%d logs to be read anew, %d only searched anew", unread_logs, steps - unread_logs)
    failed = _read_anew(warehouse, [row for hers in stale.values() for row in hers.unread], profiles, begin)
    failed |= _search_anew(warehouse, [row for hers in stale.values() for row in hers.unsearched], begin)
    return {vessel: _refreshed(hers, failed) for vessel, hers in stale.items()}


def _read_anew(
    warehouse: Warehouse, rows: Sequence[LogRow], profiles: Mapping[str, VesselProfile], begin: Callable[[str], None]
) -> dict[str, KempfError]:
    """Read logs anew and store them; return those that failed, by ingest id."""
    if not rows:
        return {}
    # the readers, the finder of zigzags and the doctor, which a vessel whose logs are up to date needs none of
    from kempf.flows.jobs.ingest.ingest_logs import look_through, store
    from kempf.flows.jobs.ingest.spool import spooled

    failed: dict[str, KempfError] = {}
    codes, corrections_by_log = codes_of(warehouse), corrections.of_logs(warehouse, [row.log_id for row in rows])
    for chunk in _chunks(rows):
        read: dict[str, ReadLog] = {}
        with ExitStack() as until_stored:
            for row in chunk:
                begin(f"reading {row.file_name}")
                profile = profiles[row.vessel]
                try:
                    log = until_stored.enter_context(raw.opened(warehouse, row.log_id))
                    readings = until_stored.enter_context(spooled(row.file_name, log, profile))
                    read[row.ingest_id] = look_through(
                        row.vessel, row.file_name, log, profile, readings, corrections_by_log.get(row.log_id, ()), codes
                    )
                except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
                    failed[row.ingest_id] = wrapped(error)
            failed |= together_or_each(read, partial(store, warehouse))
    return failed


def _search_anew(warehouse: Warehouse, rows: Sequence[LogRow], begin: Callable[[str], None]) -> dict[str, KempfError]:
    """Look through stored readings anew and store what is found; return the logs that failed, by ingest id."""
    if not rows:
        return {}
    from kempf.flows.jobs.ingest.search_log import search_again, store

    failed: dict[str, KempfError] = {}
    corrections_by_log = corrections.of_logs(warehouse, [row.log_id for row in rows])
    for chunk in _chunks(rows):
        searched: dict[str, SearchedLog] = {}
        for row in chunk:
            begin(f"looking for manoeuvres in {row.file_name}")
            try:
                searched[row.ingest_id] = search_again(warehouse, row, corrections_by_log.get(row.log_id, ()))
            except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
                failed[row.ingest_id] = wrapped(error)
        failed |= together_or_each(searched, partial(store, warehouse))
    return failed


def _refreshed(stale: Stale, failed: Mapping[str, KempfError]) -> Refreshed:
    reread, searched = (sum(row.ingest_id not in failed for row in rows) for rows in (stale.unread, stale.unsearched))
    own = {row.ingest_id: failed[row.ingest_id] for row in stale.rows if row.ingest_id in failed}
    return Refreshed(stale.logs, reread, searched, own)


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
