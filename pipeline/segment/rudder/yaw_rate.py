"""The mean yaw rate over a while, from the heading, and how steady it was.

The compass is taken rather than the rate gyro: the bias of a gyro is as large as the residual rate of a stable ship.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kempf.pipeline.segment.rudder.local_fit import value_and_rate
from kempf.pipeline.segment.rudder.measured import Signals

#: Parts into which the while is divided.
_PARTS = 4
#: Smallest change from one third of a while to the next, in standard errors, that shows how the rate goes on; largest
#: one, as a share of the change before: what hardly slows down does not say where it comes to.
_MOVES_ERRORS, _SLOWS = 2.0, 0.95


@dataclass(frozen=True)
class MeanYawRate:
    """A mean yaw rate."""

    #: Starboard positive, rad/s.
    value: float
    #: Its standard error, from the rates of four parts, rad/s.
    std: float
    #: By how much the rate of the last part exceeds the one of the first, rad/s.
    change: float


def mean_yaw_rate(signals: Signals, start_s: float, end_s: float) -> MeanYawRate:
    """Measure the mean yaw rate between two instants.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    start_s, end_s : float
        From when to when, s; within the record.

    Returns
    -------
    MeanYawRate
        NaN where the heading is not recorded.
    """
    border = np.linspace(start_s, end_s, _PARTS + 1)
    window = (end_s - start_s) / (4 * _PARTS)
    heading = np.array([value_and_rate(signals.heading_s, signals.heading, float(t), window)[0] for t in border])
    rates = np.diff(heading) / np.diff(border)
    return MeanYawRate(
        float(heading[-1] - heading[0]) / (end_s - start_s),
        float(np.std(rates, ddof=1) / np.sqrt(_PARTS)),
        float(rates[-1] - rates[0]),
    )


@dataclass(frozen=True)
class SettlingRate:
    """A yaw rate that dies down, or grows, to a steady one."""

    #: Of the last third of the while.
    last: MeanYawRate
    #: comes_to, comes_to_std: The steady rate and its standard error, rad/s.
    comes_to: float
    comes_to_std: float
    #: Whether it was still on the way, and how, so that what was missing is in ``comes_to``.
    on_the_way: bool


def settling_rate(signals: Signals, start_s: float, end_s: float) -> SettlingRate:
    """Measure the yaw rate to which a ship comes with the rudder that she holds.

    What is missing dies away exponentially, so that the changes of the mean from third to third are a geometric series,
    of which the rest is added to the last, no more than has changed already, with the whole of it as an error: sway and
    yaw die away at two rates. A stable ship that is not given the time lags behind her rudder, and the same rudder has
    two rates, which looks like the loop of an unstable one. Where the changes are lost in the noise the mean of the
    last third is the rate, with its change as an error; where they do not become smaller it is, too, and the error is
    what would be missing if they hardly did.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    start_s, end_s : float
        From when to when the rudder is held, s; within the record.
    """
    borders = np.linspace(start_s, end_s, 4).tolist()
    first, second, last = (mean_yaw_rate(signals, *border) for border in pairwise(borders))
    before, now = second.value - first.value, last.value - second.value
    # written so that NaN fails
    if not (before * now > 0.0 and _clear(before, first, second) and _clear(now, second, last)):
        return SettlingRate(last, last.value, float(np.hypot(last.std, last.change)), on_the_way=False)
    slows = now / before < _SLOWS
    ratio = min(now / before, _SLOWS)
    missing = now * ratio / (1.0 - ratio)
    std, changed = float(np.hypot(last.std, missing)), abs(last.value - first.value)
    more = float(np.clip(missing, -changed, changed)) if slows else 0.0
    return SettlingRate(last, last.value + more, std, on_the_way=slows)


def _clear(change: float, one: MeanYawRate, other: MeanYawRate) -> bool:
    return abs(change) > _MOVES_ERRORS * float(np.hypot(one.std, other.std))
