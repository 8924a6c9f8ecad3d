"""Direct spirals (Dieudonne): the rudder goes from side to side in steps, and back, each held until the rate is steady.

The steady rates over the rudder angle are the ship's curve; where the way there and the way back differ it has a loop,
and she is unstable on a straight course. The reversed spiral (Bech), steered by yaw rate, is not looked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, nan
from typing import Literal

import numpy as np

from kempf.pipeline.segment.figure import MeasuredFigure
from kempf.pipeline.segment.rudder.held_rudder import HeldRudder, band
from kempf.pipeline.segment.rudder.measured import Signals
from kempf.pipeline.segment.rudder.yaw_rate import settling_rate
from kempf.pipeline.segment.settings import SegmentSettings
from kempf.schemas.side import Side

#: Whether the way there and the way back differ.
Loop = Literal["seen", "none seen", "not judged"]

#: Fewest angles of one way from side to side.
_FEWEST_STEPS = 5

#: Shortest hold, as a share of a usual one of the record; longest movement between two, as a share of the shorter hold.
_SHORT_SHARE, _MOVING_SHARE = 0.1, 0.5

#: Largest change of the rate in the last third of a hold, as a share of the largest rate.
_STEADY_SHARE = 0.1

#: Smallest share of steps whose rate became steady.
_STEADY_STEPS = 0.7

#: Smallest change of the heading under the outermost angles, rad: in course keeping the rudder does not turn the ship.
_TURNED_RAD = float(np.deg2rad(30.0))

#: Largest rudder, as a share of the outermost, at which a loop is looked for: none reaches out to where both ways turn.
_INNER = 0.6

#: Smallest difference between both ways that is a loop, in standard errors, and as a share of the largest rate.
_LOOP_ERRORS, _LOOP_SHARE = 3.0, 0.05


#: Why a loop is not judged.
_ONE_WAY = "The rudder went one way only: a loop cannot be seen."
_NONE_SHARED = "The two ways hold no rudder angle in common: a loop cannot be seen."
_TOO_SHORT = "She was far from a steady rate at the small angles that both ways hold: hold each longer."


@dataclass(frozen=True)
class SpiralPoint:
    """One step: a rudder angle and the yaw rate that the ship came to."""

    #: Held rudder, starboard positive, deg.
    rudder_deg: float
    #: Rate to which the hold comes, starboard positive, deg/s: that of its last third, and what was still missing then.
    yaw_rate_deg_s: MeasuredFigure
    #: Whether it was steady there.
    steady: bool
    #: start_utc_ns, end_utc_ns: From when to when the rudder was held.
    start_utc_ns: int
    end_utc_ns: int


@dataclass(frozen=True)
class Spiral:
    """One direct spiral."""

    #: One of {"starboard", "port"}. Side of the first rudder angle.
    side: Side
    #: Largest rudder angle, deg.
    delta0_deg: float
    #: Heading at the beginning, 0 to 360 deg.
    base_heading_deg: float
    #: start_utc_ns, end_utc_ns: From the first hold to the end of the last one.
    start_utc_ns: int
    end_utc_ns: int
    #: In order of time.
    points: tuple[SpiralPoint, ...]
    #: Ways from one side to the other: 2 for a spiral there and back.
    n_ways: int
    #: One of {"seen", "none seen", "not judged"}.
    loop: Loop
    #: ``loop_width_deg``, ``loop_height_deg_s``; the interval of the width is what the steps leave open.
    figures: Mapping[str, MeasuredFigure]
    #: What a person should know, one sentence each.
    reasons: tuple[str, ...]

    def holds(self, time_utc_ns: int) -> bool:
        """Return whether an instant lies within it."""
        return self.start_utc_ns <= time_utc_ns <= self.end_utc_ns


def find_spirals(signals: Signals, stretches: Sequence[HeldRudder], settings: SegmentSettings) -> list[Spiral]:
    """Find the direct spirals among held rudder angles.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    stretches : sequence of HeldRudder
        In order of time.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    list of Spiral
        In order of time.

    References
    ----------
    IMO MSC/Circ.1053, spiral manoeuvres; ITTC 7.5-04-02-01; ISO 13643-3.
    """
    smallest = float(np.deg2rad(settings.smallest_rudder_deg))
    spirals = []
    for chain in _chains(signals, stretches):
        ways = [way for way in _ways(chain) if _from_side_to_side(chain, way, smallest)]
        groups: list[list[tuple[int, int]]] = []
        for way in ways:
            if groups and groups[-1][-1][1] == way[0]:
                groups[-1].append(way)
            else:
                groups.append([way])
        spirals += [spiral for group in groups if (spiral := _described(signals, chain, group)) is not None]
    return spirals


def _chains(signals: Signals, stretches: Sequence[HeldRudder]) -> list[list[HeldRudder]]:
    """Join holds that follow each other by one movement; moments are left out."""
    if not stretches:
        return []
    durations = np.sort([stretch.duration_s for stretch in stretches])
    # half of the held time lies in holds at least this long
    usual = float(durations[int(np.searchsorted(np.cumsum(durations), np.sum(durations) / 2))])
    chains: list[list[HeldRudder]] = [[]]
    for stretch in stretches:
        if stretch.duration_s < _SHORT_SHARE * usual:
            continue
        before = chains[-1][-1] if chains[-1] else None
        if before is not None and stretch.start_s - before.end_s > _MOVING_SHARE * min(
            before.duration_s, stretch.duration_s
        ):
            chains.append([])
        chains[-1].append(stretch)
    return chains


def _ways(chain: Sequence[HeldRudder]) -> list[tuple[int, int]]:
    """Return the first and last hold of every run of angles that only rise or only fall."""
    signs = [np.sign(after.rudder - before.rudder) for before, after in pairwise(chain)]
    ways, begin = [], 0
    for k in range(1, len(signs) + 1):
        if k == len(signs) or signs[k] != signs[begin]:
            ways.append((begin, k))
            begin = k
    return ways if signs else []


def _from_side_to_side(chain: Sequence[HeldRudder], way: tuple[int, int], smallest: float) -> bool:
    ends = sorted((chain[way[0]].rudder, chain[way[1]].rudder))
    return way[1] - way[0] + 1 >= _FEWEST_STEPS and ends[0] <= -smallest and ends[1] >= smallest


def _described(signals: Signals, chain: Sequence[HeldRudder], ways: list[tuple[int, int]]) -> Spiral | None:
    first, last = ways[0][0], ways[-1][1]
    holds = chain[first : last + 1]
    begin_s, end_s = max(holds[0].start_s, float(signals.heading_s[0])), min(holds[-1].end_s, signals.heading_s[-1])
    rates = [settling_rate(signals, max(hold.start_s, begin_s), min(hold.end_s, end_s)) for hold in holds]
    largest = max(abs(rate.last.value) for rate in rates)
    steady = [abs(rate.last.change) <= _STEADY_SHARE * largest for rate in rates]
    if not np.mean(steady) >= _STEADY_STEPS:
        return None
    outermost = [k - first for way in ways for k in way]
    if not all(holds[k].rudder * rate > 0 for k in outermost for rate in (rates[k].last.value, rates[k].comes_to)):
        return None
    if not all(abs(rates[k].last.value) * holds[k].duration_s >= _TURNED_RAD for k in outermost):
        return None
    points = tuple(
        SpiralPoint(
            rudder_deg=float(np.rad2deg(hold.rudder)),
            yaw_rate_deg_s=MeasuredFigure.of(degrees(rate.comes_to), degrees(rate.comes_to_std)),
            steady=at_rest,
            start_utc_ns=signals.utc_ns(hold.start_s),
            end_utc_ns=signals.utc_ns(hold.end_s),
        )
        for hold, rate, at_rest in zip(holds, rates, steady, strict=True)
    )
    parts = [points[a - first : b - first + 1] for a, b in ways]
    loop, figures, reasons = _loop(parts, float(np.rad2deg(band(0.0, signals.rudder_noise))), degrees(largest))
    unsteady = steady.count(False)
    if unsteady:
        reasons.append(f"The yaw rate was not steady yet at the end of {unsteady} of {len(steady)} steps.")
    return Spiral(
        side="starboard" if holds[0].rudder > 0 else "port",
        delta0_deg=max(abs(point.rudder_deg) for point in points),
        base_heading_deg=float(np.rad2deg(np.interp(begin_s, signals.heading_s, signals.heading))) % 360.0,
        start_utc_ns=signals.utc_ns(begin_s),
        end_utc_ns=signals.utc_ns(float(end_s)),
        points=points,
        n_ways=len(ways),
        loop=loop,
        figures=figures,
        reasons=tuple(reasons),
    )


def _loop(
    ways: list[tuple[SpiralPoint, ...]], same_deg: float, largest_deg_s: float
) -> tuple[Loop, dict[str, MeasuredFigure], list[str]]:
    """Compare the first way with the second at the angles that both hold; return what is to be said of it, too."""
    if len(ways) < 2:
        return "not judged", _no_loop("the rudder went one way only"), [_ONE_WAY]
    falling, rising = ways[:2] if ways[0][0].rudder_deg > ways[0][-1].rudder_deg else (ways[1], ways[0])
    inner = _INNER * max(abs(point.rudder_deg) for way in ways[:2] for point in way)
    heights = [
        MeasuredFigure.of((a.yaw_rate_deg_s.value or 0.0) - (b.yaw_rate_deg_s.value or 0.0), _both(a, b))
        for a in falling
        for b in rising
        if abs(a.rudder_deg - b.rudder_deg) <= same_deg and abs(a.rudder_deg) <= inner
    ]
    if not heights:
        return "not judged", _no_loop("the two ways hold no rudder angle in common"), [_NONE_SHARED]
    if not any(_LOOP_ERRORS * height.std < largest_deg_s for height in heights):
        return "not judged", _no_loop("the rates are not known well enough"), [_TOO_SHORT]
    seen = [h for h in heights if (h.value or 0.0) > max(_LOOP_ERRORS * h.std, _LOOP_SHARE * largest_deg_s)]
    if not seen:
        return "none seen", _no_loop("the way there and the way back agree"), []
    height = max(seen, key=lambda h: h.value or 0.0)
    (down, down_low, down_high), (up, up_low, up_high) = _crossing(falling), _crossing(rising)
    width = MeasuredFigure(up - down, max(up_low - down_high, 0.0), up_high - down_low)
    return "seen", {"loop_width_deg": width, "loop_height_deg_s": height}, []


def _no_loop(why: str) -> dict[str, MeasuredFigure]:
    return {name: MeasuredFigure.of(nan, nan, why) for name in ("loop_width_deg", "loop_height_deg_s")}


def _both(one: SpiralPoint, other: SpiralPoint) -> float:
    return float(np.hypot(one.yaw_rate_deg_s.std, other.yaw_rate_deg_s.std))


def _crossing(way: Sequence[SpiralPoint]) -> tuple[float, float, float]:
    """Return at which rudder the ship turns to the other side: on the line between two steps, and both of them, deg."""
    for before, after in pairwise(way):
        r0, r1 = before.yaw_rate_deg_s.value or 0.0, after.yaw_rate_deg_s.value or 0.0
        if r0 * r1 <= 0.0 and r0 != r1:
            share = r0 / (r0 - r1)
            at = before.rudder_deg + share * (after.rudder_deg - before.rudder_deg)
            return at, min(before.rudder_deg, after.rudder_deg), max(before.rudder_deg, after.rudder_deg)
    raise ValueError("the outermost steps turn to both sides, so the rate changes its sign between two of them")
