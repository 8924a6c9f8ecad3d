"""Sample-and-hold logs: the rows at which a held value was really measured.

A logger that writes every channel at its own row rate repeats the last value of a slower instrument. Taken as
measurements, the repeats invent information and delay the channel by half its period on average. Here they collapse to
the instants of measurement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float, Nanoseconds
from kempf.schemas.units import SECOND_NS

#: fewer runs than this say nothing about an instrument's period
_MIN_RUNS = 20
#: a channel that knows no more values than this is an order (starboard, port, amidships), not a measurement
_ORDERS = 5
#: share of the runs that must be as long as the period, give or take the row that a sample near a row's edge may slip
_REGULAR = 0.9
#: share of the changes that are of the smallest size where a channel is only rounded
_ONE_STEP = 0.9
#: standard deviation of what lies anywhere between 0 and 1; share of the scatter on either side that is left out;
#: part of a row that is never known
WITHIN, _SCATTER, _BENT = 12.0**-0.5, 0.025, 0.3
#: part of a row by which scatter must lean to one side before it says that few measurements cross an edge
_LOPSIDED = 0.1
#: samples over which an instrument's clock is taken for steady
_BLOCK = 400


@dataclass(frozen=True, eq=False)
class Held:
    """Which rows carry a new measurement, and when it was made."""

    #: Shape (m,). Rows to keep.
    rows: NDArray[np.int64]
    #: Shape (m,). Instants of measurement, strictly increasing.
    time_utc_ns: Nanoseconds
    #: Rows that one measurement is held for; 1 where nothing is held.
    rows_per_value: int
    #: Standard error of the instants that they have in common, s; 0 where nothing is held.
    std_s: float = 0.0


def find_held(time_utc_ns: Nanoseconds, values: Float) -> Held:
    """Find the rows at which the instrument behind one or more columns measured, and when.

    The period is the commonest length of the runs of equal rows, give or take a row. A channel at rest and quantised
    also repeats itself: a run of several periods keeps one row a period, so that a rudder standing still stays sampled.
    A measurement was made within the row that ends where its value first shows: the middle of it is taken, and where
    the instrument keeps a steady clock, the straight line through these middles.

    Parameters
    ----------
    time_utc_ns : ndarray, shape (n,)
        Time of the rows.
    values : ndarray, shape (n, n_columns)
        The columns that one instrument delivers together.

    Examples
    --------
    >>> rows = np.arange(200)
    >>> held = find_held(rows * 100_000_000, np.sin(rows // 5)[:, None])
    >>> held.rows_per_value, held.rows[:3].tolist(), held.time_utc_ns[:3].tolist()
    (5, [0, 5, 10], [-50000000, 450000000, 950000000])
    """
    n_rows = time_utc_ns.size
    everything = Held(np.arange(n_rows, dtype=np.int64), time_utc_ns, 1)
    if n_rows < 2:
        return everything
    changed = np.concatenate(([True], np.any(values[1:] != values[:-1], axis=1)))
    starts = np.flatnonzero(changed)
    if starts.size < _MIN_RUNS or starts.size == n_rows:
        return everything
    lengths = np.diff(np.append(starts, n_rows))
    # smoothed, because a sample on the edge of a row slips: runs of one row less and more are of the same period
    period = int(np.convolve(np.bincount(lengths, minlength=4), [1, 2, 1], "same").argmax())
    inner = lengths[1:-1]  # the first and last run may be cut by the ends of the log
    single = inner[inner < 1.5 * period + 1]
    regular = np.abs(single - period) <= max(1.0, 0.2 * period)
    if period < 2 or single.size < 0.3 * inner.size or np.mean(regular) < _REGULAR:
        return everything
    if _rounded(values[starts]):
        return everything  # a slow channel in coarse steps repeats itself without being held
    if np.unique(values[starts], axis=0).shape[0] <= _ORDERS:
        return everything  # the legs of a regular zigzag are equally long too
    copies = np.maximum(1, np.floor(lengths / period + 0.4).astype(np.int64))
    within = np.arange(copies.sum()) - np.repeat(np.cumsum(copies) - copies, copies)
    rows = np.repeat(starts, copies) + within * period
    instants, std_s = _instants(time_utc_ns, rows, period)
    return Held(rows, instants, period, std_s)


def _rounded(values: Float) -> bool:
    """Whether the values of successive runs, shape (n, n_columns), differ by one and the same smallest step."""
    steps = np.abs(np.diff(values, axis=0))
    for column in steps.T:
        moved = column[column > 0.0]
        if moved.size and np.mean(moved < 1.5 * np.min(moved)) < _ONE_STEP:
            return False
    return True


def _instants(time_utc_ns: Nanoseconds, rows: NDArray[np.int64], period: int) -> tuple[Nanoseconds, float]:
    """Return when the values that first show in these rows were measured, shape (m,), and their common error, s."""
    row_ns = float(np.median(np.diff(time_utc_ns)))
    middle = time_utc_ns[rows] - round(0.5 * row_ns)
    # By blocks: a sample that equals its neighbour to the last digit is lost, and shifts the count from there on.
    blocks = [_steady(middle[first : first + _BLOCK], period * row_ns, row_ns) for first in range(0, rows.size, _BLOCK)]
    instants = np.concatenate([block for block, _ in blocks])
    if not bool(np.all(np.diff(instants) > 0)):
        return middle, row_ns * WITHIN / SECOND_NS
    # the last block may be short, and its clock unknown
    sizes = [block.size for block, _ in blocks]
    variance = np.average([std_ns**2 for _, std_ns in blocks], weights=sizes)
    return instants, float(np.sqrt(variance)) / SECOND_NS


def _steady(middle: Nanoseconds, period_ns: float, row_ns: float) -> tuple[Nanoseconds, float]:
    """Return the instants of a steady clock that explain the middles of the rows, or these where there is none.

    Returns
    -------
    (ndarray of shape (m,), float)
        And their common error, ns. Where the clock and the rows keep step, every measurement shows at the same place of
        its row, and nothing shows which. Where they do not, or the clock jitters, measurements cross the rows' edges
        and their middles scatter around the clock's line, over a whole row at most: what they do not scatter over is
        where the line may lie.
    """
    if middle.size < _MIN_RUNS:
        return middle, row_ns * WITHIN
    elapsed = (middle - middle[0]).astype(np.float64)
    apart = np.diff(elapsed) / period_ns
    # neighbours are one tick apart even where a sample slipped into the next row; a longer pause lost samples
    ticks = np.concatenate(([0.0], np.cumsum(np.where(apart < 1.75, 1.0, np.round(apart)))))
    slope, offset = np.polyfit(ticks, elapsed, 1)
    steady = slope * ticks + offset
    if np.max(np.abs(steady - elapsed)) > 1.2 * row_ns:
        return middle, row_ns * WITHIN
    # a message that came late for once says nothing of the clock
    low, high = np.quantile(elapsed - steady, [_SCATTER, 1.0 - _SCATTER])
    # and a clock that crosses one edge only, in all its time, bends the line
    std_ns = max(_BENT * row_ns, row_ns - float(high - low)) * WITHIN
    edge = 0.5 * float(low + high)
    if abs(edge) > _LOPSIDED * row_ns:
        # few measurements cross an edge: jitter over a whole row puts the clock on the line, none at all on the edge
        steady, std_ns = steady + 0.5 * edge, float(np.hypot(std_ns, edge * WITHIN))
    result: Nanoseconds = middle[0] + np.round(steady).astype(np.int64)
    return result, std_ns
