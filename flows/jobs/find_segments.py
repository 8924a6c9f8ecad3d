"""The job that finds the zigzags of one ingest, as they are stored."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.no_log.companions import has_log, shaft_speed
from kempf.pipeline.ingest.screen import CLOCK_FIRST_NS
from kempf.pipeline.segment.find import find_manoeuvres
from kempf.pipeline.segment.imo import judge
from kempf.pipeline.segment.lateral import lateral_summary
from kempf.pipeline.segment.zigzag import Zigzag
from kempf.schemas.profile import VesselProfile
from kempf.warehouse import code_version
from kempf.warehouse.segments import Segment, segment_id


@dataclass(frozen=True)
class Ingest:
    """Whose log it is, the ids of the log and of this reading of it, and the name of its file."""

    vessel: str
    log_id: str
    ingest_id: str
    file_name: str


def find_segments(
    ingest: Ingest, profile: VesselProfile, instruments: Instruments
) -> tuple[list[Segment], tuple[str, ...]]:
    """Find the zigzags of one ingest; nothing is stored.

    Parameters
    ----------
    instruments : Instruments
        Its channels.

    Returns
    -------
    list of Segment
    tuple of str
        What a person should know: choices made in normalising, or the channel whose absence forbids the search.
    """
    heading, rudder = instruments.get("heading"), instruments.get("rudder_angle")
    absent = [name for name, series in (("heading", heading), ("rudder_angle", rudder)) if series is None]
    if heading is None or rudder is None:
        missing = " and ".join(absent)
        note = f"no {missing} in this log: zigzags cannot be looked for; map it in the profile if the log has it"
        return [], (*instruments.notes, note)
    speed = instruments.get("speed_through_water") or instruments.get("speed_over_ground")
    manoeuvres = [_segment(zigzag, ingest, profile, instruments) for zigzag in find_manoeuvres(heading, rudder, speed)]
    return manoeuvres, instruments.notes


def _segment(zigzag: Zigzag, ingest: Ingest, profile: VesselProfile, instruments: Instruments) -> Segment:
    criteria = judge(zigzag, profile.length_m, profile.trial_speed_m_s)
    return Segment(
        segment_id=segment_id(ingest.log_id, zigzag.kind, zigzag.start_utc_ns, zigzag.end_utc_ns),
        vessel=ingest.vessel,
        log_id=ingest.log_id,
        ingest_id=ingest.ingest_id,
        kind=zigzag.kind,
        psi0_deg=zigzag.psi0_deg,
        delta0_deg=zigzag.delta0_deg,
        first_side=zigzag.first_side,
        base_heading_deg=zigzag.base_heading_deg,
        start_utc_ns=zigzag.start_utc_ns,
        end_utc_ns=zigzag.end_utc_ns,
        executes_utc_ns=zigzag.executes_utc_ns,
        overshoots_deg=tuple(o.beyond_nominal_deg for o in zigzag.overshoots),
        code_version=code_version.fingerprint("segment"),
        imo={shown.pop("name"): shown for shown in map(asdict, criteria)},
        quality=asdict(zigzag.quality),
        detail={
            "psi0_measured_deg": zigzag.psi0_measured_deg,
            "delta0_measured_deg": zigzag.delta0_measured_deg,
            "executes": [asdict(execute) for execute in zigzag.executes],
            "overshoots": [asdict(overshoot) for overshoot in zigzag.overshoots],
            "phases": [asdict(phase) for phase in zigzag.phases],
            "speed": asdict(zigzag.speed) if zigzag.speed else None,
            "lateral_speed": lateral_summary(instruments, zigzag),
            # which other zigzags may help one without a log is decided before any is read again
            "has_log": has_log(instruments, zigzag.start_utc_ns, zigzag.end_utc_ns),
            "shaft_speed_per_s": shaft_speed(instruments, zigzag.start_utc_ns, zigzag.end_utc_ns),
            **({} if _own_time(zigzag, ingest, profile) else {"own_time": False}),
        },
    )


def _own_time(zigzag: Zigzag, ingest: Ingest, profile: VesselProfile) -> bool:
    """Tell whether the log tells the time itself; one of before `CLOCK_FIRST_NS` has a clock that was never set."""
    source = profile.source_for(ingest.file_name)
    stated = source is not None and source.time is not None and source.time.stated
    return not stated and zigzag.start_utc_ns >= CLOCK_FIRST_NS
