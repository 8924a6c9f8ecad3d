"""From a zigzag found in a chain of legs to its record: angles, instants, phases, quality."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.rudder.local_fit import peak, value_and_rate
from kempf.pipeline.segment.rudder.measured import Signals, said_of_gap
from kempf.pipeline.segment.rudder.nominal import measured_angles, nominal_angles
from kempf.pipeline.segment.rudder.switching import Chain, Switching
from kempf.pipeline.segment.settings import SegmentSettings
from kempf.pipeline.segment.zigzags.constancy import speed_constancy
from kempf.pipeline.segment.zigzags.phases import leg_phases
from kempf.pipeline.segment.zigzags.zigzag import (
    Execute,
    Overshoot,
    Phase,
    PhaseName,
    Quality,
    SpeedConstancy,
    Zigzag,
)
from kempf.schemas.side import Side

#: Change of speed after the second execute from which it is called not constant, percent.
_SPEED_TREND_PERCENT = 10.0
#: A speed that falls by so much of its mean along a straight line comes to nothing before the end, percent.
_STOPS_PERCENT = 200.0


@dataclass(frozen=True)
class _Leg:
    """One leg of the zigzag on the clock of the log, s."""

    start_s: float
    held_s: float
    end_s: float
    side: int
    execute: bool
    from_approach: bool
    peak: tuple[float, float] | None


def describe(
    signals: Signals,
    chain: Chain,
    switching: Switching,
    window_s: float,
    *,
    speed: Series | None,
    settings: SegmentSettings,
) -> Zigzag:
    """Measure everything that is recorded of a zigzag.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    chain : Chain
        The chain of legs.
    switching : Switching
        Which legs of it are the zigzag.
    window_s : float
        Half width of the local cubic, s.
    speed : Series or None
        Speed through the water, m/s.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    Zigzag
        The record.
    """
    legs = _legs(signals, chain, switching, window_s)
    psi0, delta0 = _nominal(chain, switching)
    executes = _executes(signals, chain, switching)
    overshoots = _overshoots(signals, legs, switching, psi0, window_s)
    start_s = _approach_start(signals, chain, switching, legs, settings)
    phases = _phases(signals, legs, start_s, window_s)
    start_ns, end_ns = signals.utc_ns(start_s), signals.utc_ns(legs[-1].end_s)
    first_ns = executes[0].time_utc_ns
    constancy = speed_constancy(
        speed, start_ns, first_ns, executes[1].time_utc_ns if len(executes) > 1 else first_ns, end_ns
    )
    side: Side = "starboard" if legs[0].side > 0 else "port"
    quality = _quality(signals, chain, switching, start_s=start_s, end_s=legs[-1].end_s, speed=constancy)
    return Zigzag(
        kind="zigzag" if len(overshoots) >= 2 else "zigzag_broken_off",
        psi0_deg=psi0,
        delta0_deg=delta0,
        psi0_measured_deg=float(np.rad2deg(switching.heading_change)),
        delta0_measured_deg=measured_angles(chain, switching)[1],
        first_side=side,
        base_heading_deg=float(np.rad2deg(switching.base_heading)) % 360.0,
        start_utc_ns=start_ns,
        end_utc_ns=end_ns,
        executes=executes,
        overshoots=overshoots,
        phases=phases,
        speed=constancy,
        quality=quality,
    )


def _legs(signals: Signals, chain: Chain, switching: Switching, window_s: float) -> list[_Leg]:
    """Put the legs on the clock, the last one cut where the next execute would have been due."""
    legs: list[_Leg] = []
    for k in range(switching.first, switching.last + 1):
        leg, ramp = chain.legs[k], chain.ramps[k]
        opening = k == switching.first
        execute = ramp is not None and not (opening and switching.start == "unknown")
        start = ramp.start_s if execute and ramp is not None else leg.start_s
        held = ramp.end_s if execute and ramp is not None else leg.start_s
        from_approach = opening and switching.start != "switching"
        after = chain.ramps[k + 1] if k < switching.last else None
        end = leg.end_s if after is None else after.start_s
        turned = None
        if not from_approach:
            # when and at which heading she turns back
            turned = peak(signals.heading_s, signals.heading, start, end, side=-leg.side, half_window_s=window_s)
        if k == switching.last:
            end = _due(signals, switching, leg.side, turned[0] if turned else start, end)
        legs.append(_Leg(start, held, max(end, held), leg.side, execute, from_approach, turned))
    return legs


def _due(signals: Signals, switching: Switching, side: int, from_s: float, to_s: float) -> float:
    """Return when the heading reaches the next switching heading, at most the end of the leg."""
    first, last = np.searchsorted(signals.heading_s, [from_s, to_s])
    past = side * (signals.heading[first:last] - switching.centre) >= switching.heading_change
    return float(signals.heading_s[first + int(np.argmax(past))]) if bool(np.any(past)) else to_s


def _nominal(chain: Chain, switching: Switching) -> tuple[float, float]:
    """Return psi0 and delta0 as they were most likely ordered, deg."""
    return nominal_angles(*measured_angles(chain, switching))


def _executes(signals: Signals, chain: Chain, switching: Switching) -> tuple[Execute, ...]:
    executes = []
    for k in range(switching.first, switching.last + 1):
        ramp = chain.ramps[k]
        if ramp is None or (k == switching.first and switching.start == "unknown"):
            continue
        executes.append(
            Execute(
                time_utc_ns=signals.utc_ns(ramp.start_s),
                time_uncertainty_s=ramp.start_uncertainty_s,
                rudder_held_utc_ns=signals.utc_ns(ramp.end_s),
                rudder_before_deg=float(np.rad2deg(ramp.held_before)),
                rudder_after_deg=float(np.rad2deg(ramp.held_after)),
                heading_deg=float(np.rad2deg(chain.heading[k] - switching.base_heading)),
                yaw_rate_deg_s=float(np.rad2deg(chain.yaw_rate[k])),
            )
        )
    return tuple(executes)


def _overshoots(
    signals: Signals, legs: list[_Leg], switching: Switching, psi0_deg: float, window_s: float
) -> tuple[Overshoot, ...]:
    overshoots: list[Overshoot] = []
    for leg in legs:
        if leg.peak is None:
            continue
        instant, heading = leg.peak
        swing = -leg.side
        at_execute = value_and_rate(signals.heading_s, signals.heading, leg.start_s, window_s)[0]
        overshoots.append(
            Overshoot(
                number=len(overshoots) + 1,
                side="starboard" if swing > 0 else "port",
                peak_utc_ns=signals.utc_ns(instant),
                duration_s=instant - leg.start_s,
                beyond_nominal_deg=float(np.rad2deg(swing * (heading - switching.base_heading))) - psi0_deg,
                beyond_execute_deg=float(np.rad2deg(swing * (heading - at_execute))),
            )
        )
    return tuple(overshoots)


def _approach_start(
    signals: Signals, chain: Chain, switching: Switching, legs: list[_Leg], settings: SegmentSettings
) -> float:
    """Go back from the first execute for at most one leg, as long as course and rudder stay where they were."""
    ramp = chain.ramps[switching.first]
    if switching.start not in ("steady", "turning") or ramp is None:
        return legs[0].start_s
    spacing = float(np.median(np.diff([leg.start_s for leg in legs])))
    earliest = max(ramp.start_s - spacing, float(signals.heading_s[0]), float(signals.rudder_s[0]))
    course = max(settings.approach_share * switching.heading_change, np.deg2rad(settings.switching_slack_deg))
    rudder = 0.25 * abs(ramp.held_after - ramp.held_before)
    start = earliest
    for time_s, value, level, band in (
        (signals.heading_s, signals.heading, switching.base_heading, course),
        (signals.rudder_s, signals.rudder, ramp.held_before, rudder),
    ):
        first, last = np.searchsorted(time_s, [earliest, ramp.start_s])
        away = np.flatnonzero(np.abs(value[first:last] - level) > band)
        if away.size:
            start = max(start, float(time_s[min(first + int(away[-1]) + 1, time_s.size - 1)]))
        pauses = np.flatnonzero(np.diff(time_s[first:last]) > settings.gap_share * spacing)
        if pauses.size:
            start = max(start, float(time_s[first + int(pauses[-1]) + 1]))
    return min(start, ramp.start_s)


def _phases(signals: Signals, legs: list[_Leg], start_s: float, window_s: float) -> tuple[Phase, ...]:
    parts: list[tuple[PhaseName, int, float, float]] = []
    if start_s < legs[0].start_s:
        parts.append(("approach", 0, start_s, legs[0].start_s))
    for number, leg in enumerate(legs):
        divided = leg_phases(
            signals,
            start_s=leg.start_s,
            held_s=leg.held_s,
            peak_s=leg.peak[0] if leg.peak else None,
            end_s=leg.end_s,
            side=leg.side,
            window_s=window_s,
            first=leg.from_approach,
        )
        parts += [(name, number, begin, end) for name, begin, end in divided]
    return tuple(Phase(name, n, signals.utc_ns(begin), signals.utc_ns(end)) for name, n, begin, end in parts)


def _quality(
    signals: Signals,
    chain: Chain,
    switching: Switching,
    *,
    start_s: float,
    end_s: float,
    speed: SpeedConstancy | None,
) -> Quality:
    angles_deg = np.rad2deg([leg.rudder for leg in chain.legs[switching.first : switching.last + 1]])
    port, starboard = float(np.median(angles_deg[angles_deg < 0])), float(np.median(angles_deg[angles_deg > 0]))
    gap_s = signals.gap_s(start_s, end_s)
    reasons = {
        "turning": "The ship was still turning at the first execute: the approach was not steady.",
        "switching": "The approach is not there: the first execute recorded is a switching one.",
        "unknown": "The approach is not there: the first leg begins before the log or after another manoeuvre.",
    }
    shown = [reasons[switching.start]] if switching.start in reasons else []
    # a ship does not lose all of her speed in a zigzag; nan: the mean is nothing
    if speed is not None and not speed.trend_percent > -_STOPS_PERCENT:
        shown.append(
            f"The speed after the second execute is {speed.mean_m_s:.2g} m/s in the mean and falls to nothing: does "
            "the log stop?"
        )
    elif speed is not None and abs(speed.trend_percent) > _SPEED_TREND_PERCENT:
        shown.append(f"The speed changed by {speed.trend_percent:.0f} % after the second execute.")
    return Quality(
        n_legs=switching.last - switching.first + 1,
        rudder_scatter_deg=float(np.max(np.abs(angles_deg - np.where(angles_deg > 0, starboard, port)))),
        rudder_offset_deg=(starboard + port) / 2,
        switching_scatter_deg=float(np.rad2deg(switching.scatter)),
        switching_centre_deg=float(np.rad2deg(switching.centre - switching.base_heading)),
        start=switching.start,
        gap_s=gap_s,
        reasons=(*shown, *said_of_gap(gap_s)),
    )
