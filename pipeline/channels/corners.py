"""The corners that a rudder turns between its readings: a steering gear runs at one rate, or it stands.

A straight line from reading to reading cuts the corner where the gear starts, stops or turns back. Where the readings
on both sides show the gear standing or running, the lines meet, and the corner is where they do.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.units import SECOND_NS

#: a gear has one rate if so many of its fast intervals, those above half the fastest, agree on it within so much of it
_AGREE, _WITHIN = 0.6, 0.1
_FEWEST_FAST = 6
#: the slope between two readings shows whether a gear runs only if its noise is below this share of the rate; of an
#: instrument read faster the corners are too small to matter
_CLEAR = 0.15
_NOISES = 4.0
#: a corner so near a reading, in intervals, is the reading
_NEAR = 0.02
#: of the median period: a longer interval is a gap, and hides more than one corner
_LONGEST = 1.5


def with_corners(rudder: Series, noise_std: float) -> Series:
    """Return the rudder's readings and, between them, the corners that they show.

    Parameters
    ----------
    rudder : Series
        Rudder angle, rad.
    noise_std : float
        Standard deviation of the noise of one reading, rad.

    Returns
    -------
    Series
        The same where the gear has no single rate, or where noise or too slow readings hide it. A channel that jumps
        from value to value, as an order does, has no corners.

    Notes
    -----
    Linear interpolation between readings h apart is off by up to rate h / 4 at a corner, always to the same side.

    Examples
    --------
    >>> time = np.arange(0, 60, 2)
    >>> angle = np.interp(time, [0, 3, 13, 25, 45, 60], [0, 0, 0.4, 0.4, -0.4, -0.4])
    >>> found = with_corners(Series(time * 1_000_000_000, angle), 0.0)
    >>> [round(float(t), 3) for t in np.setdiff1d(found.time_utc_ns, time * 1_000_000_000) / 1e9]
    [3.0, 13.0, 25.0, 45.0]
    """
    if len(rudder) < _FEWEST_FAST:
        return rudder
    span = np.diff(rudder.time_utc_ns) / SECOND_NS
    slope = np.diff(rudder.value) / span
    noise = np.sqrt(2.0) * max(noise_std, 0.0) / span
    rate = _rate(slope, span)
    if rate is None or float(np.median(noise)) > _CLEAR * rate:
        return rudder
    # what the gear does in each interval: stands 0, runs -1 or 1, turns a corner (or creeps) NaN
    doing = np.full(slope.size, np.nan)
    doing[np.abs(slope) <= _NOISES * noise + 0.02 * rate] = 0.0
    for side in (-1.0, 1.0):
        doing[np.abs(slope - side * rate) <= _NOISES * noise + 0.02 * rate] = side
    usable = span <= _LONGEST * float(np.median(span))
    k = np.arange(1, slope.size - 1)
    before, after = doing[k - 1], doing[k + 1]
    k = k[usable[k - 1] & usable[k] & usable[k + 1] & np.isfinite(before) & np.isfinite(after) & (before != after)]
    left, right = rate * doing[k - 1], rate * doing[k + 1]
    since = (rudder.value[k + 1] - rudder.value[k] - right * span[k]) / (left - right)
    inside = (since > _NEAR * span[k]) & (since < (1.0 - _NEAR) * span[k])
    k, left, since = k[inside], left[inside], since[inside]
    instants = rudder.time_utc_ns[k] + np.round(since * SECOND_NS).astype(np.int64)
    return rudder.with_points(instants, rudder.value[k] + left * since)


def _rate(slope: Float, span: Float) -> float | None:
    """Return the one rate that the gear runs at, rad/s; None where there is none."""
    speed = np.abs(slope[span <= _LONGEST * float(np.median(span))])
    if speed.size < _FEWEST_FAST:
        return None
    # not the fastest of all, which a spike may be
    fastest = float(np.sort(speed)[-min(3, speed.size)])
    fast = speed[speed > 0.5 * fastest]
    if fast.size < _FEWEST_FAST:
        return None
    rate = float(np.median(fast))
    agree = float(np.mean(np.abs(fast - rate) <= _WITHIN * rate))
    return rate if agree >= _AGREE else None
