"""Turning circles: the rudder put over from a straight course and held until the heading has changed by 180 deg.

Found here and described; the figures themselves are read off in `turning_figures`, their intervals in `circle_figures`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.segment.circles.circle_figures import CircleFigures, circle_figures
from kempf.pipeline.segment.circles.turn_track import track_of
from kempf.pipeline.segment.circles.turning_figures import STEADY_FROM_RAD
from kempf.pipeline.segment.rudder.held_rudder import HeldRudder
from kempf.pipeline.segment.rudder.local_fit import value_and_rate
from kempf.pipeline.segment.rudder.measured import Signals, said_of_gap
from kempf.pipeline.segment.rudder.nominal import RUDDER_TOLERANCE, nominal_angle
from kempf.pipeline.segment.rudder.ramps import Ramp, approach_before, measure_ramp
from kempf.pipeline.segment.rudder.switching import Start
from kempf.pipeline.segment.rudder.yaw_rate import mean_yaw_rate
from kempf.pipeline.segment.settings import SegmentSettings
from kempf.schemas.side import Side

#: Heading change that makes a circle of a turn from a steady approach, rad; from any other one it has to be steady.
_HALF_TURN = pi

#: Largest difference of the heading in the approach from the one at the execute, rad.
_APPROACH_RAD = float(np.deg2rad(3.0))

#: Longest and shortest approach, as a share of the time for the first 90 deg.
_LONGEST_APPROACH, _SHORTEST_APPROACH = 1.0, 0.25

#: Largest yaw rate at the execute, as a share of the one at the end.
_STEADY_SHARE = 0.15

#: Slowest movement of the rudder, as a share of the time for the first 90 deg, and the smallest one, as a share of the
#: held angle: a rudder that was over already was not put over.
_SLOWEST_RUDDER, _TRAVEL_SHARE = 0.5, 0.5

#: Fewest values of the heading in a turn.
_FEWEST = 10

#: Largest share of the record in which the drift angle is an impossible one.
_ACROSS_SHARE = 0.3

#: Change of speed over the approach from which it is said, percent.
_SPEED_TREND_PERCENT = 5.0


@dataclass(frozen=True)
class CircleQuality:
    """How good a turning circle is."""

    #: One of {"steady", "turning", "unknown"}. How it begins: from a steady course, from a turn, or unseen.
    start: Start
    #: Largest difference of the heading in the approach from its mean, deg.
    approach_heading_scatter_deg: float
    #: Largest difference of the held rudder from its median, deg.
    rudder_scatter_deg: float
    #: Time within it for which heading or rudder were not recorded, s.
    gap_s: float
    #: What a person should know before trusting it, one sentence each.
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class MeasuredCircle:
    """One turning circle."""

    #: One of {"starboard", "port"}.
    side: Side
    #: delta0_deg, delta0_measured_deg: Rudder as it was most likely ordered, and as it was held, deg.
    delta0_deg: float
    delta0_measured_deg: float
    #: Heading of the approach, 0 to 360 deg.
    base_heading_deg: float
    #: start_utc_ns, end_utc_ns: From the approach until the rudder leaves its angle.
    start_utc_ns: int
    end_utc_ns: int
    #: When the rudder starts to move; None where the log begins with the rudder over.
    execute_utc_ns: int | None
    #: Half the interval that the rudder's samples leave open, s.
    execute_uncertainty_s: float
    #: From the execute to the end, starboard positive, deg.
    heading_change_deg: float
    #: What it measures, with intervals.
    measured: CircleFigures
    #: How good it is.
    quality: CircleQuality


def turning_circle(
    signals: Signals, instruments: Instruments, held: HeldRudder, settings: SegmentSettings
) -> MeasuredCircle | None:
    """Describe the turning circle under a held rudder.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    instruments : Instruments
        Series of the log, for the track.
    held : HeldRudder
        The rudder held.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    MeasuredCircle or None
        None where it is none: the rudder is too small or was not put over by one movement, the heading changed by less
        than 180 deg or away from the rudder's side, or by less than 350 deg from an approach that was not steady; or
        she went across her bow for long, as no ship under way does.

    References
    ----------
    IMO MSC.137(76), 4.2.1 and 5.3.1; ISO 13643-2; ITTC 7.5-04-02-01.
    """
    side = 1.0 if held.rudder > 0 else -1.0
    first, last = np.searchsorted(signals.heading_s, [held.start_s, held.end_s])
    turned = side * (signals.heading[first:last] - signals.heading[min(first, signals.heading.size - 1)])
    over = abs(held.rudder) >= np.deg2rad(settings.smallest_rudder_deg)
    if not over or turned.size < _FEWEST or float(np.max(turned)) < _HALF_TURN - 0.5:
        return None
    quarter_s = float(signals.heading_s[first + int(np.argmax(turned >= pi / 2))] - held.start_s)
    end_s = min(held.end_s, float(signals.heading_s[-1]))
    ramp = _execute(signals, held, quarter_s)
    broken = signals.longest_gap_s(held.start_s, end_s) > settings.gap_share * quarter_s
    if broken or not _put_over(signals, held, ramp, quarter_s):
        return None
    begin_s = max(held.start_s, float(signals.heading_s[0])) if ramp is None else ramp.start_s
    approach_s = _approach_start(signals, begin_s, quarter_s)
    steady = mean_yaw_rate(signals, (begin_s + end_s) / 2, end_s)
    start = _start(signals, ramp, begin_s, approach_s, quarter_s, steady.value)
    approach = (signals.heading_s >= approach_s) & (signals.heading_s <= begin_s)
    from_approach = start == "steady" and bool(np.any(approach))
    at_execute = value_and_rate(signals.heading_s, signals.heading, begin_s, 0.08 * quarter_s)[0]
    base = float(np.mean(signals.heading[approach])) if from_approach else at_execute
    scatter = float(np.max(np.abs(signals.heading[approach] - base))) if from_approach else float("nan")
    if not from_approach:
        approach_s = begin_s
    at_end = value_and_rate(signals.heading_s, signals.heading, end_s, 0.08 * quarter_s)[0]
    change = side * (at_end - base)
    if change < (_HALF_TURN if start == "steady" else STEADY_FROM_RAD):
        return None
    track = track_of(instruments, signals.origin_ns, approach_s, end_s, quarter_s)
    if track.bridged_share > _ACROSS_SHARE or track.time_s.size < _FEWEST:
        return None
    measured = circle_figures(
        track,
        execute_s=None if ramp is None else ramp.start_s,
        execute_std_s=float("nan") if ramp is None else ramp.start_uncertainty_s,
        begin_s=begin_s,
        course_std_rad=float(np.std(signals.heading[approach])) if from_approach else float("nan"),
    )
    rudder_deg = np.rad2deg(signals.rudder[held.first : held.last + 1])
    return MeasuredCircle(
        side="starboard" if side > 0 else "port",
        delta0_deg=nominal_angle(abs(float(np.rad2deg(held.rudder))), 0.0, RUDDER_TOLERANCE),
        delta0_measured_deg=abs(float(np.rad2deg(held.rudder))),
        base_heading_deg=float(np.rad2deg(base)) % 360.0,
        start_utc_ns=signals.utc_ns(approach_s),
        end_utc_ns=signals.utc_ns(end_s),
        execute_utc_ns=None if ramp is None else signals.utc_ns(ramp.start_s),
        execute_uncertainty_s=float("nan") if ramp is None else ramp.start_uncertainty_s,
        heading_change_deg=side * float(np.rad2deg(change)),
        measured=measured,
        quality=CircleQuality(
            start=start,
            approach_heading_scatter_deg=float(np.rad2deg(scatter)),
            rudder_scatter_deg=float(np.max(np.abs(rudder_deg - np.median(rudder_deg)))),
            gap_s=signals.gap_s(approach_s, end_s),
            reasons=_reasons(start, ramp, measured, signals.gap_s(approach_s, end_s)),
        ),
    )


def _execute(signals: Signals, held: HeldRudder, quarter_s: float) -> Ramp | None:
    """Measure the movement of the rudder that begins a turn; None where it is not recorded or too slow to be one."""
    time_s, rudder, noise = signals.rudder_s, signals.rudder, signals.rudder_noise
    earliest = int(np.searchsorted(time_s, held.start_s - _SLOWEST_RUDDER * quarter_s))
    if earliest >= held.first:
        return None
    # the gear's rate: the quickest movement to the side of the turn, over two samples so that noise is not taken for it
    moved = np.sign(held.rudder) * (rudder[earliest + 2 : held.first + 1] - rudder[earliest : held.first - 1])
    took = time_s[earliest + 2 : held.first + 1] - time_s[earliest : held.first - 1]
    rate = float(np.max(moved / took, initial=0.0)) or float("nan")
    begin, before = approach_before(
        time_s, rudder, held.first, held_after=held.rudder, earliest=earliest, noise=noise, rate=rate
    )
    return measure_ramp(
        time_s,
        rudder,
        held.first,
        held_after=held.rudder,
        held_before=before,
        earliest=begin,
        noise=noise,
        known_rate=rate,
    )


def _put_over(signals: Signals, held: HeldRudder, ramp: Ramp | None, quarter_s: float) -> bool:
    """Whether the rudder was put over by one movement, or was over when the log began."""
    if ramp is None:
        recorded = max(float(signals.heading_s[0]), float(signals.rudder_s[0]))
        return held.start_s - recorded < _SHORTEST_APPROACH * quarter_s
    travel = abs(ramp.held_after - ramp.held_before)
    return ramp.end_s - ramp.start_s <= _SLOWEST_RUDDER * quarter_s and travel >= _TRAVEL_SHARE * abs(held.rudder)


def _approach_start(signals: Signals, execute_s: float, quarter_s: float) -> float:
    """Go back from the execute for as long as the course stays what it was."""
    first, last = np.searchsorted(signals.heading_s, [execute_s - _LONGEST_APPROACH * quarter_s, execute_s])
    if first >= last:
        return execute_s
    value = signals.heading[first:last]
    away = np.flatnonzero(np.abs(value - value[-1]) > _APPROACH_RAD)
    k = first + int(away[-1]) + 1 if away.size else first
    return float(min(signals.heading_s[min(k, signals.heading_s.size - 1)], execute_s))


def _start(
    signals: Signals, ramp: Ramp | None, begin_s: float, approach_s: float, quarter_s: float, steady_rate: float
) -> Start:
    """Return how a turn begins."""
    recorded = max(float(signals.heading_s[0]), float(signals.rudder_s[0]))
    if ramp is None or begin_s - recorded < _SHORTEST_APPROACH * quarter_s:
        return "unknown"
    rate = value_and_rate(signals.heading_s, signals.heading, begin_s, 0.15 * quarter_s)[1]
    short = begin_s - approach_s < _SHORTEST_APPROACH * quarter_s
    return "turning" if short or abs(rate) > _STEADY_SHARE * abs(steady_rate) else "steady"


def _reasons(start: Start, ramp: Ramp | None, measured: CircleFigures, gap_s: float) -> tuple[str, ...]:
    sentences = {
        "turning": "The ship was turning at the execute: the approach was not steady.",
        "unknown": "The approach is not recorded: the figures are referred to the heading at the execute."
        if ramp is not None
        else "The log begins with the rudder over: what is measured from the execute is not known.",
    }
    shown = [sentences[start]] if start in sentences else []
    trend = measured.approach_speed_trend_percent
    if abs(trend) > _SPEED_TREND_PERCENT:
        shown.append(f"The speed changed by {trend:.0f} % over the approach.")
    return (*shown, *said_of_gap(gap_s), *measured.reasons)
