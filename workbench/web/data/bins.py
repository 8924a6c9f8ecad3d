"""A series reduced to its smallest and largest value of every stretch of time that a screen can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import SECOND_NS, Float, Nanoseconds, Series

Places = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Shown:
    """What of a series is drawn."""

    #: Shape (n,). s after the beginning of the window.
    time_s: Float
    #: Shape (n,). As measured; NaN where a gap ends, so that no line crosses it.
    value: Float
    #: Values in the window, and of these the ones that are drawn.
    total: int
    drawn: int


def reduced(series: Series, start_utc_ns: int, end_utc_ns: int, bins: int) -> Shown:
    """Return the values of a window, with one beyond each of its edges, so that lines leave it.

    Every value is one that was measured, at its own instant: where there are more than two a bin, the smallest and
    the largest of each bin are drawn in place of all.

    Parameters
    ----------
    start_utc_ns, end_utc_ns : int
        The window, UTC nanoseconds, both ends included.
    bins : int
        Stretches of time of equal length.
    """
    time = series.time_utc_ns
    first, last = (int(i) for i in np.searchsorted(time, [start_utc_ns, end_utc_ns + 1]))
    total = last - first
    if total > 2 * bins:
        inside = first + _extremes(time[first:last], series.value[first:last], start_utc_ns, end_utc_ns, bins)
    else:
        inside = np.arange(first, last)
    before, after = np.arange(max(first - 1, 0), first), np.arange(last, min(last + 1, time.size))
    kept = np.concatenate([before, inside, after])
    seconds = (time[kept] - start_utc_ns).astype(np.float64) / SECOND_NS
    return Shown(
        *_broken(seconds, series.value[kept], _limit_s(series, start_utc_ns, end_utc_ns, total, bins)),
        total,
        inside.size,
    )


def _limit_s(series: Series, start_utc_ns: int, end_utc_ns: int, total: int, bins: int) -> float:
    """Return from which distance on two drawn values are not joined, s."""
    width = (end_utc_ns - start_utc_ns) / SECOND_NS / bins if total > 2 * bins else 0.0
    return gap_limit_s(series) + 2.0 * width


def _extremes(time: Nanoseconds, value: Float, start_utc_ns: int, end_utc_ns: int, bins: int) -> Places:
    """Return the places of the smallest and the largest value of every bin that has any, in the order of time."""
    number = (time - start_utc_ns) * bins // max(end_utc_ns - start_utc_ns + 1, 1)
    begins = np.flatnonzero(np.concatenate(([True], number[1:] != number[:-1])))
    counts = np.diff(np.append(begins, value.size))
    places = []
    for extreme in (np.minimum.reduceat(value, begins), np.maximum.reduceat(value, begins)):
        at = np.flatnonzero(value == np.repeat(extreme, counts))
        # the first of a bin that has it
        owner = np.repeat(np.arange(begins.size), counts)[at]
        places.append(at[np.concatenate(([True], owner[1:] != owner[:-1]))])
    return np.unique(np.concatenate(places))


def _broken(seconds: Float, value: Float, limit_s: float) -> tuple[Float, Float]:
    """Put a NaN between neighbours that are farther apart than a limit."""
    gaps = np.flatnonzero(np.diff(seconds) > limit_s) + 1
    return np.insert(seconds, gaps, seconds[gaps - 1] if gaps.size else seconds[:0]), np.insert(value, gaps, np.nan)
