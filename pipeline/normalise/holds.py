"""Sample-and-hold logs: the rows at which a held value was really measured.

A logger that writes every channel at its own row rate repeats the last value of a slower instrument. Taken as
measurements, the repeats invent information and delay the channel by half its period on average. Here they collapse to
the instants of measurement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.normalise.series import Float, Nanoseconds

#: fewer runs than this tell nothing about an instrument's period
_MIN_RUNS = 20
#: a run this much shorter than the period cannot be one whole hold
_SHORT = 0.6


@dataclass(frozen=True, eq=False)
class Held:
    """Which rows carry a new measurement.

    Attributes
    ----------
    rows : ndarray of int, shape (m,)
        Rows to keep.
    delay_s : float
        Mean time between measurement and the row that first shows it, s: half a row where values are held, else 0.
    rows_per_value : int
        Rows that one measurement is held for; 1 where nothing is held.
    """

    rows: NDArray[np.int64]
    delay_s: float
    rows_per_value: int


def find_held(time_utc_ns: Nanoseconds, values: Float) -> Held:
    """Find the rows at which the instrument behind one or more columns measured.

    The period is the commonest length of the runs of equal rows. A channel at rest and quantised also repeats itself:
    a run of several periods keeps one row a period, so that a rudder standing still stays sampled.

    Parameters
    ----------
    time_utc_ns : ndarray, shape (n,)
        Time of the rows.
    values : ndarray, shape (n, n_columns)
        The columns that one instrument delivers together.

    Returns
    -------
    Held

    Examples
    --------
    >>> rows = np.arange(200)
    >>> held = find_held(rows * 100_000_000, np.sin(rows // 5)[:, None])
    >>> held.rows_per_value, held.rows[:3].tolist(), held.delay_s
    (5, [0, 5, 10], 0.05)
    """
    n_rows = time_utc_ns.size
    everything = Held(np.arange(n_rows, dtype=np.int64), 0.0, 1)
    if n_rows < 2:
        return everything
    changed = np.concatenate(([True], np.any(values[1:] != values[:-1], axis=1)))
    starts = np.flatnonzero(changed)
    lengths = np.diff(np.append(starts, n_rows))
    if starts.size < _MIN_RUNS:
        return everything
    period = int(np.bincount(lengths).argmax())
    near = np.abs(lengths - period) <= max(1.0, 0.2 * period)
    # The first and last run may be cut by the ends of the log.
    short = np.mean(lengths[1:-1] < _SHORT * period)
    if period < 2 or np.mean(near) < 0.3 or short > 0.05:
        return everything
    copies = np.maximum(1, np.floor(lengths / period + (1.0 - _SHORT)).astype(np.int64))
    within = np.arange(copies.sum()) - np.repeat(np.cumsum(copies) - copies, copies)
    rows = np.repeat(starts, copies) + within * period
    row_s = float(np.median(np.diff(time_utc_ns))) * 1e-9
    return Held(rows, 0.5 * row_s, period)
