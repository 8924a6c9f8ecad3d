"""The runs of a steering gear from stand to stand, each a straight line, of readings that are noisy.

`corners` finds where a gear starts and stops from two readings on either side, which noise soon hides. The whole of a
run says it better: the line through all its readings meets the angles between which it goes.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.units import SECOND_NS

#: readings of a stand, see `standing.without_noise`, and of a run whose rate is to be its own
_STAND, _RUN = 3, 4
#: of the noise of a reading: what is nearer to a stand may be of it; a run is no shorter than so many of it
_NEAR, _SHORTEST = 4.0, 20.0
#: of the noise: how far a reading may lie from the line, and all of them in the root of their mean square
_FARTHEST, _SCATTER = 4.5, 1.4
#: of the median period: a longer interval is a gap
_LONGEST = 1.5


def with_straight_runs(rudder: Series, noise_std: float) -> Series:
    """Return the rudder with every run from stand to stand as a straight line with its two corners.

    Parameters
    ----------
    rudder : Series
        Rudder angle without the noise of its stands, see `standing.without_noise`, rad.
    noise_std : float
        Standard deviation of the noise of one reading, rad.

    Returns
    -------
    Series
        With the readings of every such run on its line and two more for its corners; the same where there is no noise.
        What is no straight line within the noise, and what does not go from stand to stand, is left as it was read.

    Examples
    --------
    >>> time = np.arange(0, 20)
    >>> noise = 0.002 * np.array([0] * 6 + [1, -1, 1, -1, 1, -1, 1] + [0] * 7)
    >>> angle = np.interp(time, [0, 5.5, 13.5, 20], [0, 0, 0.4, 0.4]) + noise
    >>> found = with_straight_runs(Series(time * 1_000_000_000, angle), 0.002)
    >>> [round(float(t), 1) for t in np.setdiff1d(found.time_utc_ns, time * 1_000_000_000) / 1e9]
    [5.5, 13.5]
    """
    if len(rudder) < 2 * _STAND or not noise_std > 0.0:
        return rudder
    time, value = rudder.seconds_since(int(rudder.time_utc_ns[0])), rudder.value.copy()
    longest = _LONGEST * float(np.median(np.diff(time)))
    corners: list[tuple[float, float]] = []
    for (_, last), (first, _) in pairwise(_stands(value)):
        inside = slice(last + 1, first)
        if np.diff(time[last : first + 1]).max() > longest:
            continue
        run = _straight(time[last : first + 1], value[last : first + 1], noise_std)
        if run is not None:
            value[inside] = np.interp(time[inside], run, [value[last], value[first]])
            corners += [(run[0], float(value[last])), (run[1], float(value[first]))]
    if not corners:
        return rudder
    at, angles = np.array(corners).T
    instants = rudder.time_utc_ns[0] + np.round(at * SECOND_NS).astype(np.int64)
    return Series(rudder.time_utc_ns, value).with_points(instants, angles)


def _stands(value: Float) -> list[tuple[int, int]]:
    """Return the first and the last reading of every stand: where one angle stands for all of them."""
    same = np.concatenate([[False], np.diff(value) == 0.0, [False]])
    first, behind = np.flatnonzero(~same[:-1] & same[1:]), np.flatnonzero(same[:-1] & ~same[1:])
    long = behind - first + 1 >= _STAND
    return list(zip(first[long].tolist(), behind[long].tolist(), strict=True))


def _straight(time: Float, value: Float, noise: float) -> tuple[float, float] | None:
    """Return when a run begins and ends, s, from the last reading of one stand to the first of the next, or None."""
    a, b = float(value[0]), float(value[-1])
    side, way = np.sign(b - a), abs(b - a)
    if way < _SHORTEST * noise:
        return None
    gone = side * (value - a)
    own = (gone > _NEAR * noise) & (gone < way - _NEAR * noise)
    if np.count_nonzero(own) < _RUN:
        return None
    rate, begin = np.polyfit(time[own], gone[own], 1)
    if not rate > 0.0:
        return None
    start, stop = -begin / rate, (way - begin) / rate
    slack = noise / rate
    if start < time[0] - slack or stop > time[-1] + slack:
        return None
    start, stop = max(float(start), float(time[0])), min(float(stop), float(time[-1]))
    left = gone[1:-1] - np.interp(time[1:-1], [start, stop], [0.0, way])
    if np.abs(left).max() > _FARTHEST * noise or np.sqrt(np.mean(left**2)) > _SCATTER * noise:
        return None
    return start, stop
