"""Which part of a chain of rudder legs is one zigzag: the heading must switch the rudder at K0 + psi0 and K0 - psi0.

Overshoots may grow and the speed may fall: that is the ship's answer, the manoeuvre is a zigzag for as long as the
order was carried out. It is none where no course was steady before and too few switchings agree to give K0 instead, as
when a ship that no longer obeys is given the next order. Overshoots and phases are measured later.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.segment.rudder.legs import Leg
from kempf.pipeline.segment.rudder.ramps import Ramp
from kempf.pipeline.segment.settings import SegmentSettings

#: How the first leg of a zigzag begins, see `Switching.start`.
Start = Literal["steady", "turning", "switching", "unknown"]


@dataclass(frozen=True, eq=False)
class Chain:
    """A chain of legs with what was measured at its executes."""

    #: The legs, alternating.
    legs: list[Leg]
    #: The movement that begins each leg; None where the log begins with the rudder over.
    ramps: list[Ramp | None]
    #: Shape (n,). Heading at each execute, rad; NaN where there is none.
    heading: Float
    #: Shape (n,). Yaw rate at each execute, rad/s.
    yaw_rate: Float
    #: Shape (n - 1,). Whether heading and rudder were recorded from each leg to the next.
    unbroken: list[bool]


@dataclass(frozen=True)
class Switching:
    """A zigzag within a chain."""

    #: first, last: First and last leg in the chain.
    first: int
    last: int
    #: One of {"steady", "turning", "switching", "unknown"}. How the first leg begins: from a steady course; from K0
    #: with the ship still turning; at the opposite switching heading, so that the log or another manoeuvre hides the
    #: approach; or unseen.
    start: Start
    #: K0: the heading at the first execute where it starts from K0, else the middle of both switching headings, rad.
    base_heading: float
    #: Middle of the switching headings, rad.
    centre: float
    #: Measured psi0: half the distance of the switching headings, or the only one's from K0, rad.
    heading_change: float
    #: Largest difference of a switching heading from ``centre +- heading_change``, rad.
    scatter: float


#: Chooses among the zigzags that begin with one leg; None where none starts in the way that is looked for.
_Rule = Callable[[list["Switching"], SegmentSettings], "Switching | None"]


def zigzags_in(chain: Chain, settings: SegmentSettings) -> list[Switching]:
    """Find the zigzags in a chain, from the left, each as long as it goes.

    One that starts from a steady approach is looked for first. What is left over may be one whose approach was not
    steady or not recorded; since K0 then follows from the switchings alone, more of them must agree. Last come those of
    fewer switchings that start from K0 with the ship still turning.

    Parameters
    ----------
    chain : Chain
        Legs and what was measured at their executes.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    list of Switching
        In order of time, without common legs.
    """
    zigzags: list[Switching] = []
    for look_for in (_from_steady, _of_many_switchings, _from_turning):
        borders = [-1, *(k for s in zigzags for k in (s.first, s.last)), len(chain.legs)]
        zigzags += [
            zigzag
            for begin, end in zip(borders[::2], borders[1::2], strict=True)
            for zigzag in _scan(chain, begin + 1, end - 1, settings, look_for)
        ]
        zigzags.sort(key=lambda s: s.first)
    return zigzags


def _scan(chain: Chain, first: int, last: int, settings: SegmentSettings, look_for: _Rule) -> list[Switching]:
    """Go through a range of legs and take the longest zigzag that starts at each."""
    zigzags: list[Switching] = []
    leg = first
    while leg < last:
        best = look_for(_candidates(chain, leg, last, settings), settings)
        if best is None:
            leg += 1
            continue
        zigzags.append(best)
        leg = best.last + 1
    return zigzags


def _candidates(chain: Chain, leg: int, last: int, settings: SegmentSettings) -> list[Switching]:
    """Return the zigzags from a leg on, from the shortest to the longest."""
    candidates: list[Switching] = []
    for end in range(leg + 1, last + 1):
        if not chain.unbroken[end - 1] or not np.isfinite(chain.heading[end]):
            break
        candidate = _judge(chain, leg, end, settings)
        if candidate is not None:
            candidates.append(candidate)
        elif end >= leg + 3:
            break
    return candidates


def _is_long(candidates: list[Switching], settings: SegmentSettings) -> bool:
    """Whether the longest one has switchings enough to give K0, and starts otherwise than from a steady course."""
    if not candidates or candidates[-1].start == "steady":
        return False
    return candidates[-1].last - candidates[-1].first >= settings.switchings_without_approach


def _from_steady(candidates: list[Switching], settings: SegmentSettings) -> Switching | None:
    """Choose the longest from a steady course."""
    steady = [c for c in candidates if c.start == "steady"]
    # a long zigzag from a course that was not quite steady is not cut down to a short one that was
    return steady[-1] if steady and not _is_long(candidates, settings) else None


def _of_many_switchings(candidates: list[Switching], settings: SegmentSettings) -> Switching | None:
    """Choose the longest where its switchings give K0 whatever the approach was."""
    return candidates[-1] if _is_long(candidates, settings) else None


def _from_turning(candidates: list[Switching], settings: SegmentSettings) -> Switching | None:
    """Choose the longest from K0 with the ship still turning: the switchings must lie symmetric about where she was."""
    turning = [c for c in candidates if c.start == "turning" and c.last - c.first >= settings.switchings_from_turning]
    return turning[-1] if turning else None


def _judge(chain: Chain, first: int, last: int, settings: SegmentSettings) -> Switching | None:
    """Whether the executes after the first one switch symmetrically about a heading, and how the first one starts."""
    switched = np.arange(first + 1, last + 1)
    heading = chain.heading[switched]
    side = np.array([chain.legs[k - 1].side for k in switched])
    start = float(chain.heading[first])
    if switched.size == 1:
        centre, change = start, float(side[0] * (heading[0] - start))
    else:
        starboard, port = float(np.mean(heading[side > 0])), float(np.mean(heading[side < 0]))
        centre, change = (starboard + port) / 2, (starboard - port) / 2
    # written so that NaN fails
    if not np.deg2rad(settings.smallest_heading_deg) <= change <= np.deg2rad(settings.largest_heading_deg):
        return None
    slack = float(np.deg2rad(settings.switching_slack_deg))
    tolerance = max(settings.switching_scatter * change, slack)
    scatter = float(np.max(np.abs(heading - centre - side * change)))
    if scatter > tolerance or not _one_rate(chain.ramps[first + 1 : last + 1], settings):
        return None
    swing = float(np.mean(np.abs(chain.yaw_rate[switched])))
    how = _start(chain, first, settings, centre=centre, change=change, swing=swing)
    base = start if how in ("steady", "turning") else centre
    return Switching(first, last, how, base, centre, change, scatter)


def _start(chain: Chain, first: int, settings: SegmentSettings, *, centre: float, change: float, swing: float) -> Start:
    """Return how the first leg begins."""
    ramp, leg = chain.ramps[first], chain.legs[first]
    if ramp is None or not np.isfinite(chain.heading[first]):
        return "unknown"
    away = float(chain.heading[first]) - centre
    slack = float(np.deg2rad(settings.switching_slack_deg))
    # nearer to the opposite switching heading than to K0, however far switching headings may scatter
    if abs(away + leg.side * change) <= max(min(settings.switching_scatter, 0.5) * change, slack):
        return "switching"
    next_leg = chain.legs[first + 1]
    offset, amplitude = (leg.rudder + next_leg.rudder) / 2, abs(leg.rudder - next_leg.rudder) / 2
    if not _one_rate([ramp, *chain.ramps[first + 1 : first + 3]], settings):
        return "unknown"
    # a helmsman starts from a steady course with the rudder about amidships
    amidships = abs(ramp.held_before - offset) <= settings.approach_rudder_share * amplitude
    if not amidships or abs(away) > max(settings.approach_share * change, slack):
        return "unknown"
    return "steady" if abs(float(chain.yaw_rate[first])) <= settings.steady_share * swing else "turning"


def _one_rate(ramps: list[Ramp | None], settings: SegmentSettings) -> bool:
    """Whether the rudder moved at one rate, as a steering gear does when ordered over; an autopilot's is any."""
    rates = [abs(ramp.rate) for ramp in ramps if ramp is not None and np.isfinite(ramp.rate)]
    return not rates or min(rates) >= settings.rate_share * max(rates)
