"""A series reduced to its smallest and largest value of every stretch of time that a screen can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

Places = NDArray[np.int64]
#: lengths of blocks whose extremes alone are looked at, where two of them fit into a bin; short ones cost more
_BLOCKS = (256, 64)


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
    """Return the places of the smallest and the largest value of every bin that has any, in the order of time.

    A bin begins with a block of values where it holds several, and is of equal length but for that.
    """
    length = next((n for n in _BLOCKS if value.size >= 2 * n * bins), 1)
    low, high = _of_blocks(value, length)
    width = end_utc_ns - start_utc_ns + 1
    edges = start_utc_ns - (-np.arange(bins) * width) // bins
    begins = np.searchsorted(time[::length], edges)
    begins = begins[(np.diff(begins, prepend=-1) > 0) & (begins < low.size)]
    first = low[_first(np.minimum, value[low], begins)]
    return _in_order(first, high[_first(np.maximum, value[high], begins)])


def _of_blocks(value: Float, length: int) -> tuple[Places, Places]:
    """Return the places of the smallest and of the largest value of blocks of equal length, the last one shorter."""
    if length == 1:
        return np.arange(value.size), np.arange(value.size)
    whole = value.size // length
    blocks, begin, rest = value[: whole * length].reshape(whole, length), length * np.arange(whole), whole * length
    low, high = begin + blocks.argmin(axis=1), begin + blocks.argmax(axis=1)
    if rest == value.size:
        return low, high
    return np.append(low, rest + value[rest:].argmin()), np.append(high, rest + value[rest:].argmax())


def _first(extreme: np.ufunc, value: Float, begins: Places) -> Places:
    """Return the place of the extreme of every stretch that begins at some places, the first of equal ones."""
    counts = np.diff(begins, append=value.size)
    at = np.flatnonzero(value == np.repeat(extreme.reduceat(value, begins), counts))
    result: Places = at[np.searchsorted(at, begins)]
    return result


def _in_order(first: Places, second: Places) -> Places:
    """Return pairs of places in order, the same place once."""
    pairs = np.stack([np.minimum(first, second), np.maximum(first, second)], axis=1)
    result: Places = pairs[np.stack([np.ones(first.size, dtype=np.bool_), first != second], axis=1)]
    return result


def _broken(seconds: Float, value: Float, limit_s: float) -> tuple[Float, Float]:
    """Put a NaN between neighbours that are farther apart than a limit."""
    gaps = np.flatnonzero(np.diff(seconds) > limit_s) + 1
    if not gaps.size:
        return seconds, value
    return np.insert(seconds, gaps, seconds[gaps - 1]), np.insert(value, gaps, np.nan)
