"""How fast the rudder goes over, read off the executes of the logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, radians

import numpy as np

from kempf.pipeline.channels.robust_std import robust_std
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.record import Record

#: from 35 deg on one side to 30 deg on the other in 28 s: SOLAS chapter II-1, regulation 29
SOLAS_RAD_S = radians(65.0 / 28.0)
_SOLAS_STD = 0.25
#: the part of the way from side to side over which the rate is taken
_INNER = 0.6
#: a way over that the readings cut into fewer steps shows no rate
_STEPS = 2.5
#: how well a rate is known at best
_LEAST = 0.01


@dataclass(frozen=True)
class RudderRate:
    """The rudder's rate."""

    rad_s: float
    std_rad_s: float
    #: How many executes show it; 0 where it is assumed.
    executes: int
    #: What a user should know; empty where it was seen.
    remark: str


def rudder_rate(records: Sequence[Record]) -> RudderRate:
    """Return the rate with which the rudder goes from side to side.

    Parameters
    ----------
    records : sequence of Record
        Manoeuvres with the rudder as it was read.
    """
    rates: list[float] = []
    floor = 0.0
    for record in records:
        for rate, steps in _ways_over(record.time_s, record.rudder_rad, record.rudder_period_s):
            if steps >= _STEPS:
                rates.append(rate)
            else:
                floor = max(floor, rate)
    if rates:
        middle = float(np.median(rates))
        spread = robust_std(np.array(rates) - middle) / np.sqrt(len(rates))
        return RudderRate(middle, max(spread, _LEAST * middle), len(rates), "")
    taken = max(SOLAS_RAD_S, floor)
    why = "as SOLAS asks for" if taken == SOLAS_RAD_S else "the least that the readings allow"
    remark = f"the logs do not show how fast the rudder goes over: {degrees(taken):.2g} deg/s taken, {why}"
    return RudderRate(taken, _SOLAS_STD * taken, 0, remark)


def _ways_over(time_s: Float, rudder_rad: Float, period_s: float) -> list[tuple[float, float]]:
    """Return rate, rad/s, and readings of every way from one side to the other."""
    largest = float(np.percentile(np.abs(rudder_rad), 90.0))
    if not largest > radians(2.0):
        return []
    level = _INNER * largest
    side = np.where(rudder_rad >= level, 1, np.where(rudder_rad <= -level, -1, 0))
    ways = []
    there = np.flatnonzero(side)
    for i, j in pairwise(there.tolist()):
        if side[i] != side[j]:
            left = _crossing(time_s, rudder_rad, i, side[i] * level)
            arrived = _crossing(time_s, rudder_rad, j - 1, side[j] * level)
            if arrived > left:
                ways.append((2.0 * level / (arrived - left), (arrived - left) / max(period_s, 1e-9)))
    return ways


def _crossing(time_s: Float, rudder_rad: Float, i: int, level: float) -> float:
    """Return when the rudder passes a level between two instants."""
    step = rudder_rad[i + 1] - rudder_rad[i]
    share = (level - rudder_rad[i]) / step if step != 0.0 else 0.5
    return float(time_s[i] + share * (time_s[i + 1] - time_s[i]))
