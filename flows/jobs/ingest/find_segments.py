"""The job that finds the manoeuvres of one ingest, as they are stored: those fitted, and those kept to validate on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import nan
from typing import Any

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.no_log.companions import has_log, shaft_speed
from kempf.pipeline.ingest.screen import CLOCK_FIRST_NS
from kempf.pipeline.segment import corrections
from kempf.pipeline.segment.circles.imo_turning import judge_circle
from kempf.pipeline.segment.circles.turning_circle import MeasuredCircle
from kempf.pipeline.segment.corrections import Marked, Standing
from kempf.pipeline.segment.find_circles_and_spirals import find_circles_and_spirals
from kempf.pipeline.segment.lateral import lateral_summary
from kempf.pipeline.segment.particulars import Particulars
from kempf.pipeline.segment.spirals.pull_out import PullOut
from kempf.pipeline.segment.spirals.random_manoeuvre import RandomManoeuvre, find_random
from kempf.pipeline.segment.spirals.spiral import Spiral
from kempf.pipeline.segment.zigzags.by_hand import zigzag_between
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.segment.zigzags.imo import judge
from kempf.pipeline.segment.zigzags.zigzag import Zigzag
from kempf.schemas.correction import Correction
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.tables.segments import Segment, segment_id


@dataclass(frozen=True)
class Ingest:
    """Whose log it is, the ids of the log and of this reading of it, and the name of its file."""

    vessel: str
    log_id: str
    ingest_id: str
    file_name: str
    #: Fingerprint under which the present code finds manoeuvres.
    code_version: str


def find_segments(
    ingest: Ingest, profile: VesselProfile, instruments: Instruments, log_corrections: Sequence[Correction] = ()
) -> tuple[list[Segment], tuple[str, ...]]:
    """Find the manoeuvres of one ingest; nothing is stored.

    Parameters
    ----------
    instruments : Instruments
        Its channels.
    log_corrections : sequence of Correction, optional
        What a person said of the manoeuvres of this log, in the order in which it was said.

    Returns
    -------
    list of Segment
        The zigzags, and behind them what else was found; those that a person excluded are among them.
    tuple of str
        What a person should know: choices made in normalising, or the channel whose absence forbids the search.
    """
    heading, rudder = instruments.get("heading"), instruments.get("rudder_angle")
    absent = [name for name, series in (("heading", heading), ("rudder_angle", rudder)) if series is None]
    if heading is None or rudder is None:
        missing = " and ".join(absent)
        note = f"no {missing} in this log: manoeuvres cannot be looked for; map it in the profile if the log has it"
        return [], (*instruments.notes, note)
    speed = instruments.get("speed_through_water") or instruments.get("speed_over_ground")
    standing = corrections.standing(log_corrections)
    marked, notes = corrections.applied(
        find_zigzags(heading, rudder, speed),
        standing,
        lambda bounds: zigzag_between(heading, rudder, speed, *bounds),
    )
    manoeuvres = [_marked(marked_zigzag, ingest, profile, instruments) for marked_zigzag in marked]
    turning = find_circles_and_spirals(instruments, [marked_zigzag.zigzag for marked_zigzag in marked])
    others = [_kept_aside(manoeuvre, ingest, profile) for manoeuvre in turning]
    spans = [(segment.start_utc_ns, segment.end_utc_ns) for segment in (*manoeuvres, *others)]
    others += [_random(manoeuvre, ingest, profile, instruments) for manoeuvre in find_random(instruments, spans)]
    return [*manoeuvres, *(_with(segment, standing) for segment in others)], (*instruments.notes, *notes)


def _marked(marked_zigzag: Marked, ingest: Ingest, profile: VesselProfile, instruments: Instruments) -> Segment:
    """Return a zigzag with what a person said of it."""
    segment = _segment(marked_zigzag.zigzag, ingest, profile, instruments)
    return segment if marked_zigzag.standing is None else _with(segment, [marked_zigzag.standing])


def _with(segment: Segment, standings: Sequence[Standing]) -> Segment:
    """Return a segment with what was said of its manoeuvre."""
    mine = next(
        (standing for standing in standings if standing.concerns(segment.start_utc_ns, segment.end_utc_ns)), None
    )
    if mine is None:
        return segment
    subject = dict(zip(("start_utc_ns", "end_utc_ns"), mine.subject_utc_ns, strict=True))
    by_hand = {"action": mine.action, "reason": mine.reason, "subject": subject}
    return replace(segment, excluded=mine.excluded, detail={**segment.detail, "by_hand": by_hand})


def _segment(zigzag: Zigzag, ingest: Ingest, profile: VesselProfile, instruments: Instruments) -> Segment:
    criteria = judge(zigzag, Particulars.of(profile))
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
        code_version=ingest.code_version,
        imo={shown.pop("name"): shown for shown in map(asdict, criteria)},
        quality=asdict(zigzag.quality),
        detail={
            "psi0_measured_deg": zigzag.psi0_measured_deg,
            "delta0_measured_deg": zigzag.delta0_measured_deg,
            "executes": [asdict(execute) for execute in zigzag.executes],
            "overshoots": [asdict(overshoot) for overshoot in zigzag.overshoots],
            "phases": [asdict(phase) for phase in zigzag.phases],
            "speed": asdict(zigzag.speed) if zigzag.speed else None,
            **_of_fitted(zigzag, ingest, profile, instruments),
        },
    )


def _random(manoeuvre: RandomManoeuvre, ingest: Ingest, profile: VesselProfile, instruments: Instruments) -> Segment:
    detail = {"heading_range_deg": manoeuvre.heading_range_deg, **_of_fitted(manoeuvre, ingest, profile, instruments)}
    quality = {"gap_s": manoeuvre.gap_s, "reasons": manoeuvre.reasons}
    return _no_zigzag(manoeuvre, ingest, "random_manoeuvre", manoeuvre.orders_utc_ns, quality, detail)


def _of_fitted(
    manoeuvre: Zigzag | RandomManoeuvre, ingest: Ingest, profile: VesselProfile, instruments: Instruments
) -> dict[str, Any]:
    """Return the detail of a manoeuvre that a model is fitted to."""
    bounds = manoeuvre.start_utc_ns, manoeuvre.end_utc_ns
    return {
        "lateral_speed": lateral_summary(instruments, *bounds, manoeuvre.base_heading_deg),
        # which others may help one without a log is decided before any is read again
        "has_log": has_log(instruments, *bounds),
        "shaft_speed_per_s": shaft_speed(instruments, *bounds),
        **({} if _own_time(manoeuvre.start_utc_ns, ingest, profile) else {"own_time": False}),
    }


def _own_time(start_utc_ns: int, ingest: Ingest, profile: VesselProfile) -> bool:
    """Return whether the log has the time itself; one of before `CLOCK_FIRST_NS` has a clock that was never set."""
    source = profile.source_for(ingest.file_name)
    stated = source is not None and source.time is not None and source.time.stated
    return not stated and start_utc_ns >= CLOCK_FIRST_NS


def _kept_aside(manoeuvre: MeasuredCircle | PullOut | Spiral, ingest: Ingest, profile: VesselProfile) -> Segment:
    """Return a manoeuvre that no model is fitted to, with its figures."""
    if isinstance(manoeuvre, MeasuredCircle):
        return _turning_circle(manoeuvre, ingest, profile)
    quality = {"reasons": manoeuvre.reasons}
    detail: dict[str, Any] = {
        "length_m": profile.length_m,
        "figures": {name: asdict(figure) for name, figure in manoeuvre.figures.items()},
    }
    if isinstance(manoeuvre, PullOut):
        detail |= {
            "delta0_measured_deg": manoeuvre.delta0_measured_deg,
            "rudder_after_deg": manoeuvre.rudder_after_deg,
            "partner_start_utc_ns": manoeuvre.partner_start_utc_ns,
            "verdict": manoeuvre.verdict,
        }
        return _no_zigzag(manoeuvre, ingest, "pull_out", (manoeuvre.start_utc_ns,), quality, detail)
    detail |= {
        "loop": manoeuvre.loop,
        "n_ways": manoeuvre.n_ways,
        "points": [asdict(point) for point in manoeuvre.points],
    }
    executes = tuple(point.start_utc_ns for point in manoeuvre.points)
    return _no_zigzag(manoeuvre, ingest, "spiral", executes, quality, detail)


def _turning_circle(circle: MeasuredCircle, ingest: Ingest, profile: VesselProfile) -> Segment:
    measurement = circle.measured
    detail = {
        "length_m": profile.length_m,
        "figures": {name: asdict(figure) for name, figure in measurement.figures.items()},
        "figures_over_ground": measurement.over_ground,
        "figures_less_drift": measurement.less_drift,
        "track": measurement.track,
        "circle_drift": asdict(measurement.drift) if measurement.drift else None,
        "corrected_for_current": measurement.corrected,
        "delta0_measured_deg": circle.delta0_measured_deg,
        "execute_uncertainty_s": circle.execute_uncertainty_s,
        "heading_change_deg": circle.heading_change_deg,
        "approach_speed_m_s": measurement.approach_speed_m_s,
        "approach_speed_trend_percent": measurement.approach_speed_trend_percent,
    }
    executes = () if circle.execute_utc_ns is None else (circle.execute_utc_ns,)
    criteria = judge_circle(circle, Particulars.of(profile))
    segment = _no_zigzag(circle, ingest, "turning_circle", executes, asdict(circle.quality), detail)
    return replace(segment, imo={shown.pop("name"): shown for shown in map(asdict, criteria)})


def _no_zigzag(
    manoeuvre: MeasuredCircle | PullOut | Spiral | RandomManoeuvre,
    ingest: Ingest,
    kind: str,
    executes_utc_ns: tuple[int, ...],
    quality: dict[str, Any],
    detail: dict[str, Any],
) -> Segment:
    """Return a manoeuvre with neither a nominal heading deviation nor overshoots, without criteria."""
    return Segment(
        segment_id=segment_id(ingest.log_id, kind, manoeuvre.start_utc_ns, manoeuvre.end_utc_ns),
        vessel=ingest.vessel,
        log_id=ingest.log_id,
        ingest_id=ingest.ingest_id,
        kind=kind,
        psi0_deg=nan,
        delta0_deg=manoeuvre.delta0_deg,
        first_side=manoeuvre.side,
        base_heading_deg=manoeuvre.base_heading_deg,
        start_utc_ns=manoeuvre.start_utc_ns,
        end_utc_ns=manoeuvre.end_utc_ns,
        executes_utc_ns=executes_utc_ns,
        overshoots_deg=(),
        code_version=ingest.code_version,
        imo={},
        quality=quality,
        detail=detail,
    )
