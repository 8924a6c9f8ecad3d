"""All zigzags of a vessel as diagnosis and comparison take them, with ships to start from."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np

from flows.parameter_set_of import arm_of
from flows.progress import Progress, silent
from flows.refresh_logs import refresh_logs
from pipeline.diagnose.run import Run, Ship, make_run, step_of
from pipeline.diagnose.start import Start, start_of
from pipeline.identify.record import Record, make_record
from pipeline.normalise.instruments import Instruments, from_readings
from schemas.errors import KempfError, NotFound
from schemas.model_spec import ModelSpec
from schemas.profile import VesselProfile
from warehouse import logs, readings, segments, vessels
from warehouse.segments import Segment
from warehouse.store import Warehouse

#: where the profile does not tell a length; only the scale of non-dimensional coefficients hangs on it
_LENGTH_M = 100.0
#: executes this close in two logs are one
_SAME_INSTANT_S = 2.0


@dataclass(frozen=True, eq=False)
class VesselRuns:
    """What a vessel's logs hold, ready for a model.

    Attributes
    ----------
    vessel : str
    profile : VesselProfile
    spec : ModelSpec
        With the arm and the moment decided.
    runs : tuple of Run
        In order of time.
    found : tuple of Segment
        One a run.
    start : Start
        Hull and noise levels to start a fit from.
    skipped : dict of str to str
        Why a segment is no run, by its id.
    profile_sha256 : str
    """

    vessel: str
    profile: VesselProfile
    spec: ModelSpec
    runs: tuple[Run, ...]
    found: tuple[Segment, ...]
    start: Start
    skipped: dict[str, str]
    profile_sha256: str


def vessel_runs(warehouse: Warehouse, vessel: str, spec: ModelSpec, progress: Progress = silent) -> VesselRuns:
    """Read every zigzag of a vessel that can be used.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    spec : ModelSpec
        Disturbances; effects are not looked at.
    progress : Progress, optional

    Raises
    ------
    NotFound
        ``no_runs``: none can be used; the details say why.
    """
    refreshed = refresh_logs(warehouse, vessel, progress)
    rows = {row.ingest_id: row for row in logs.current(warehouse, vessel) if row.ingest_id not in refreshed.failed}
    found = [s for s in segments.current(warehouse, vessel) if s.ingest_id in rows]
    if not found:
        raise NotFound(
            "no_segments",
            f"No zigzag was found in the {len(rows)} logs of {vessel!r}.",
            "Ingest a log that holds one; `kempf ingest` says for each log why none was found.",
            {"vessel": vessel},
        )
    profile_sha256 = rows[max(found, key=lambda s: s.start_utc_ns).ingest_id].profile_sha256
    profile = vessels.get(warehouse, profile_sha256)
    kept, skipped = once([s for s in found if rows[s.ingest_id].profile_sha256 == profile_sha256])
    skipped |= {
        s.segment_id: "its log is read with an older profile"
        for s in found
        if rows[s.ingest_id].profile_sha256 != profile_sha256
    }
    records, instruments = _records(warehouse, kept, rows, skipped, progress)
    if not records:
        raise NotFound(
            "no_runs",
            f"None of the {len(found)} zigzags of {vessel!r} can be used: "
            + "; ".join(f"{name}: {why}" for name, why in sorted(skipped.items())[:5]),
            "See docs/bad_input.md for every reason and what mends it.",
            {"skipped": skipped},
        )
    arm = arm_of(spec, profile)
    ready = spec.with_arm(arm)
    ship = Ship(profile.length_m or _LENGTH_M, profile.draught_m or 1.0, arm or 0.0)
    step = step_of([record for _, record in records], ship.length_m)
    days = {log_id: k for k, log_id in enumerate(dict.fromkeys(segment.log_id for segment, _ in records))}
    runs = tuple(
        make_run(s.segment_id, record, instruments[s.ingest_id], ready, ship, step, days[s.log_id])
        for s, record in records
    )
    progress(len(records), len(records), "finding a ship to start from")
    with ThreadPoolExecutor(max_workers=cpu_count()) as workers:
        start = start_of([record for _, record in records], runs, ready, workers)
    return VesselRuns(
        vessel, profile, ready, runs, tuple(s for s, _ in records), start, skipped, profile_sha256
    )


def _records(
    warehouse: Warehouse,
    kept: Sequence[Segment],
    rows: dict[str, logs.LogRow],
    skipped: dict[str, str],
    progress: Progress,
) -> tuple[list[tuple[Segment, Record]], dict[str, Instruments]]:
    instruments: dict[str, Instruments] = {}
    records = []
    for done, segment in enumerate(sorted(kept, key=lambda s: (s.start_utc_ns, s.segment_id))):
        if segment.ingest_id not in instruments:
            progress(done, len(kept), f"reading {rows[segment.ingest_id].file_name}")
            instruments[segment.ingest_id] = from_readings(readings.read(warehouse, segment.ingest_id))
        try:
            record = make_record(instruments[segment.ingest_id], segment.start_utc_ns, segment.end_utc_ns)
        except KempfError as error:
            skipped[segment.segment_id] = str(error)
        else:
            records.append((segment, record))
    return records, instruments


def once(found: Sequence[Segment]) -> tuple[list[Segment], dict[str, str]]:
    """Return each manoeuvre once, and why the others are left out.

    Two logs of one voyage hold the same noise of the sea, and twice is not two. Of equal ones the longest stays, then
    the first by log. Broken-off zigzags stay: their rudder moved too.
    """
    kept: list[Segment] = []
    left: dict[str, str] = {}
    for one in sorted(found, key=lambda s: (s.start_utc_ns - s.end_utc_ns, s.log_id, s.start_utc_ns)):
        twin = next((other for other in kept if _same(one, other)), None)
        if twin is None:
            kept.append(one)
        else:
            left[one.segment_id] = f"another log holds the same manoeuvre, {twin.segment_id}"
    return kept, left


def _same(one: Segment, other: Segment) -> bool:
    """Tell whether two segments are one manoeuvre: at the same time, to the same side, executes at the same instants.

    The time alone does not tell: logs of a tank count from one stated start.
    """
    if one.end_utc_ns <= other.start_utc_ns or other.end_utc_ns <= one.start_utc_ns:
        return False
    theirs = np.array(other.executes_utc_ns)
    late = [float(np.min(np.abs(theirs - ns))) * 1e-9 for ns in one.executes_utc_ns]
    return one.first_side == other.first_side and max(late, default=0.0) < _SAME_INSTANT_S
