"""Which manoeuvres of a vessel a model is fitted to: each manoeuvre once, all read with the newest profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from kempf.flows.jobs.identify.loads_of_logs import loads_of_logs
from kempf.flows.jobs.ingest.refresh_logs import Refreshed, refresh_logs
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.errors import NotFound
from kempf.warehouse.queries.deduplicate import once
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, notes, segments
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.segments import Segment

#: so many manoeuvres with a speed through the water do without those that have none
_ENOUGH = 2


@dataclass(frozen=True, eq=False)
class Chosen:
    """Which segments of a vessel count, and how her logs are read."""

    vessel: str
    profile_sha256: str
    #: Fingerprint under which the present code estimates.
    code_version: str
    #: Sorted by log and time, as the inputs of a parameter set are.
    segments: tuple[Segment, ...]
    #: Ingest by log, of these segments.
    ingests: dict[str, str]
    #: By log.
    file_names: dict[str, str]
    #: Why a segment does not count, by its id: of every one that the current reading of the logs holds.
    skipped: dict[str, str]
    #: Draught by log as it was noted, m, where it was for every log; else empty.
    draughts_m: dict[str, float] = field(default_factory=dict)
    #: Load by log, see `pipeline.estimate.record.loads`.
    loads: dict[str, float] = field(default_factory=dict)


def without_log(segment: Segment) -> bool:
    """Return whether a segment has no speed through the water of its own."""
    return segment.detail.get("has_log") is False


def choose(warehouse: Warehouse, vessel: str, failed: Mapping[str, str] = MappingProxyType({})) -> Chosen:
    """Choose the manoeuvres of a vessel to fit, as they are stored: each manoeuvre once, all read with one profile.

    Parameters
    ----------
    failed : mapping of str to str, optional
        Ingests whose manoeuvres do not count, and why.

    Raises
    ------
    NotFound
        ``no_segments``.
    """
    rows = {row.ingest_id: row for row in logs.current(warehouse, vessel)}
    every = [s for s in segments.current(warehouse, vessel) if s.ingest_id in rows]
    manoeuvres = [s for s in every if s.ingest_id not in failed]
    left = {s.segment_id: failed[s.ingest_id] for s in every if s.ingest_id in failed}
    if not manoeuvres:
        raise no_segments(vessel, list(rows.values()), left)
    profile_sha256 = rows[max(manoeuvres, key=lambda s: s.start_utc_ns).ingest_id].profile_sha256
    # a broken-off zigzag stays: its rudder moved too
    kept, twins = once([s for s in manoeuvres if rows[s.ingest_id].profile_sha256 == profile_sha256])
    skipped = left | twins
    for segment in manoeuvres:
        if rows[segment.ingest_id].profile_sha256 != profile_sha256:
            skipped[segment.segment_id] = "its log is read with an older profile"
    logged = [s for s in kept if not without_log(s)]
    if len(logged) >= _ENOUGH:
        # over ground a stream along the course is taken for speed: beside manoeuvres with a log it only misleads
        skipped |= {s.segment_id: "no speed through the water, unlike others" for s in kept if without_log(s)}
        kept = logged
    kept.sort(key=lambda s: (s.log_id, s.start_utc_ns, s.end_utc_ns))
    noted, laden = _laden(warehouse, vessel, kept)
    return Chosen(
        vessel,
        profile_sha256,
        code_of(warehouse, "estimate"),
        tuple(kept),
        {s.log_id: s.ingest_id for s in kept},
        {s.log_id: rows[s.ingest_id].file_name for s in kept},
        skipped,
        noted,
        laden,
    )


def _laden(warehouse: Warehouse, vessel: str, kept: Sequence[Segment]) -> tuple[dict[str, float], dict[str, float]]:
    """Return the draught of every log as it was noted, where it was for all of them, and how each is laden."""
    noted = notes.draughts_m(notes.of_vessel(warehouse, vessel), kept)
    laden = loads_of_logs([(s.segment_id, s) for s in kept], noted)
    return (noted if noted.keys() == laden.keys() else {}), laden


def choose_refreshed(warehouse: Warehouse, vessel: str, progress: Progress = silent) -> Chosen:
    """Choose as `choose`, once what other code read and found is brought up to date: for what is stored.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``, ``no_segments``.
    """
    return choose(warehouse, vessel, out_of_date(refresh_logs(warehouse, vessel, progress)))


def out_of_date(refreshed: Refreshed) -> dict[str, str]:
    """Return for each ingest that could not be brought up to date why its manoeuvres do not count."""
    return {ingest: f"its log cannot be read anew: {error.message}" for ingest, error in refreshed.failed.items()}


def no_segments(vessel: str, rows: Sequence[LogRow], left_out: Mapping[str, str] = MappingProxyType({})) -> NotFound:
    """Return the error that a vessel has no manoeuvre that a model is fitted to.

    Parameters
    ----------
    rows : sequence of LogRow
        Her logs.
    left_out : mapping of str to str, optional
        Why a manoeuvre does not count, by its id.
    """
    return NotFound(
        "no_segments",
        f"Neither a zigzag nor a random manoeuvre was found in the {len(rows)} logs of {vessel!r}, so there is nothing "
        "to identify from."
        if not left_out
        else f"None of the {len(left_out)} manoeuvres of {vessel!r} counts: "
        f"{'; '.join(sorted(set(left_out.values())))}.",
        "Ingest a log that holds one: `kempf segments` lists what her logs hold, also circles and pull-outs, to which "
        "no model is fitted.",
        {"vessel": vessel, "logs": [row.file_name for row in rows]}
        if not left_out
        else {"vessel": vessel, "skipped": dict(left_out)},
    )
