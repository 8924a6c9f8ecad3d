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
from kempf.pipeline.segment.by_hand import zigzag_between
from kempf.pipeline.segment.corrections import Marked, Standing
from kempf.pipeline.segment.find import find_manoeuvres
from kempf.pipeline.segment.find_turning import find_turning
from kempf.pipeline.segment.imo import judge
from kempf.pipeline.segment.imo_turning import judge_circle
from kempf.pipeline.segment.lateral import lateral_summary
from kempf.pipeline.segment.pull_out import PullOut
from kempf.pipeline.segment.random_manoeuvre import RandomManoeuvre, find_random
from kempf.pipeline.segment.spiral import Spiral
from kempf.pipeline.segment.turning_circle import TurningCircle
from kempf.pipeline.segment.zigzag import Zigzag
from kempf.schemas.correction import Correction
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.segments import Segment, segment_id


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
    ingest: Ingest, profile: VesselProfile, instruments: Instruments, said: Sequence[Correction] = ()
) -> tuple[list[Segment], tuple[str, ...]]:
    """Find the manoeuvres of one ingest; nothing is stored.

    Parameters
    ----------
    instruments : Instruments
        Its channels.
    said : sequence of Correction, optional
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
    standing = corrections.standing(said)
    marked, notes = corrections.applied(
        find_manoeuvres(heading, rudder, speed),
        standing,
        lambda bounds: zigzag_between(heading, rudder, speed, *bounds),
    )
    manoeuvres = [_marked(one, ingest, profile, instruments) for one in marked]
    turning = find_turning(instruments, [one.zigzag for one in marked])
    others = [_kept_aside(one, ingest, profile) for one in turning]
    taken = [(one.start_utc_ns, one.end_utc_ns) for one in (*manoeuvres, *others)]
    others += [_random(one, ingest, profile, instruments) for one in find_random(instruments, taken)]
    return [*manoeuvres, *(_with(one, standing) for one in others)], (*instruments.notes, *notes)


def _marked(one: Marked, ingest: Ingest, profile: VesselProfile, instruments: Instruments) -> Segment:
    """Return a zigzag with what a person said of it."""
    segment = _segment(one.zigzag, ingest, profile, instruments)
    return segment if one.standing is None else _with(segment, [one.standing])


def _with(segment: Segment, said: Sequence[Standing]) -> Segment:
    """Return a segment with what was said of its manoeuvre."""
    mine = next((one for one in said if one.concerns(segment.start_utc_ns, segment.end_utc_ns)), None)
    if mine is None:
        return segment
    subject = dict(zip(("start_utc_ns", "end_utc_ns"), mine.subject_utc_ns, strict=True))
    by_hand = {"action": mine.action, "reason": mine.reason, "subject": subject}
    return replace(segment, excluded=mine.excluded, detail={**segment.detail, "by_hand": by_hand})


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


def _random(one: RandomManoeuvre, ingest: Ingest, profile: VesselProfile, instruments: Instruments) -> Segment:
    detail = {"heading_range_deg": one.heading_range_deg, **_of_fitted(one, ingest, profile, instruments)}
    quality = {"gap_s": one.gap_s, "reasons": one.reasons}
    return _no_zigzag(one, ingest, "random_manoeuvre", one.orders_utc_ns, quality, detail)


def _of_fitted(
    one: Zigzag | RandomManoeuvre, ingest: Ingest, profile: VesselProfile, instruments: Instruments
) -> dict[str, Any]:
    """Return the detail of a manoeuvre that a model is fitted to."""
    bounds = one.start_utc_ns, one.end_utc_ns
    return {
        "lateral_speed": lateral_summary(instruments, *bounds, one.base_heading_deg),
        # which others may help one without a log is decided before any is read again
        "has_log": has_log(instruments, *bounds),
        "shaft_speed_per_s": shaft_speed(instruments, *bounds),
        **({} if _own_time(one.start_utc_ns, ingest, profile) else {"own_time": False}),
    }


def _own_time(start_utc_ns: int, ingest: Ingest, profile: VesselProfile) -> bool:
    """Return whether the log has the time itself; one of before `CLOCK_FIRST_NS` has a clock that was never set."""
    source = profile.source_for(ingest.file_name)
    stated = source is not None and source.time is not None and source.time.stated
    return not stated and start_utc_ns >= CLOCK_FIRST_NS


def _kept_aside(one: TurningCircle | PullOut | Spiral, ingest: Ingest, profile: VesselProfile) -> Segment:
    """Return a manoeuvre that no model is fitted to, with its figures."""
    if isinstance(one, TurningCircle):
        return _turning_circle(one, ingest, profile)
    quality = {"reasons": one.reasons}
    detail: dict[str, Any] = {
        "length_m": profile.length_m,
        "figures": {name: asdict(figure) for name, figure in one.figures.items()},
    }
    if isinstance(one, PullOut):
        detail |= {
            "delta0_measured_deg": one.delta0_measured_deg,
            "rudder_after_deg": one.rudder_after_deg,
            "partner_start_utc_ns": one.partner_start_utc_ns,
            "verdict": one.verdict,
        }
        return _no_zigzag(one, ingest, "pull_out", (one.start_utc_ns,), quality, detail)
    detail |= {"loop": one.loop, "n_ways": one.n_ways, "points": [asdict(point) for point in one.points]}
    executes = tuple(point.start_utc_ns for point in one.points)
    return _no_zigzag(one, ingest, "spiral", executes, quality, detail)


def _turning_circle(one: TurningCircle, ingest: Ingest, profile: VesselProfile) -> Segment:
    made = one.measured
    detail = {
        "length_m": profile.length_m,
        "figures": {name: asdict(figure) for name, figure in made.figures.items()},
        "figures_over_ground": made.over_ground,
        "figures_less_drift": made.less_drift,
        "track": made.track,
        "circle_drift": asdict(made.drift) if made.drift else None,
        "corrected_for_current": made.corrected,
        "delta0_measured_deg": one.delta0_measured_deg,
        "execute_uncertainty_s": one.execute_uncertainty_s,
        "heading_change_deg": one.heading_change_deg,
        "approach_speed_m_s": made.approach_speed_m_s,
        "approach_speed_trend_percent": made.approach_speed_trend_percent,
    }
    executes = () if one.execute_utc_ns is None else (one.execute_utc_ns,)
    criteria = judge_circle(one, profile.length_m, profile.trial_speed_m_s)
    segment = _no_zigzag(one, ingest, "turning_circle", executes, asdict(one.quality), detail)
    return replace(segment, imo={shown.pop("name"): shown for shown in map(asdict, criteria)})


def _no_zigzag(
    one: TurningCircle | PullOut | Spiral | RandomManoeuvre,
    ingest: Ingest,
    kind: str,
    executes_utc_ns: tuple[int, ...],
    quality: dict[str, Any],
    detail: dict[str, Any],
) -> Segment:
    """Return a manoeuvre with neither a nominal heading deviation nor overshoots, without criteria."""
    return Segment(
        segment_id=segment_id(ingest.log_id, kind, one.start_utc_ns, one.end_utc_ns),
        vessel=ingest.vessel,
        log_id=ingest.log_id,
        ingest_id=ingest.ingest_id,
        kind=kind,
        psi0_deg=nan,
        delta0_deg=one.delta0_deg,
        first_side=one.side,
        base_heading_deg=one.base_heading_deg,
        start_utc_ns=one.start_utc_ns,
        end_utc_ns=one.end_utc_ns,
        executes_utc_ns=executes_utc_ns,
        overshoots_deg=(),
        code_version=ingest.code_version,
        imo={},
        quality=quality,
        detail=detail,
    )
