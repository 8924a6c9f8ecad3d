"""Readings averaged over the cells of a grid: the measurements that every likelihood takes.

The grid is fine beside the ship's own time, so that what she does within a cell is a parabola: the mean of its
readings, at the mean of their instants and less what the parabola adds to it, says what they say together, and there
are several times fewer of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.moves import moves
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings

#: the grid's step in times that the ship needs for her length, and in legs of the zigzag; its bounds, s
_STEP_LENGTHS, _STEP_LEGS, _FINEST_S, _COARSEST_S = 0.06, 1.0 / 60.0, 0.05, 1.0
#: second derivative of the parabola through seven means a step apart, by least squares (Savitzky & Golay 1964,
#: Analytical Chemistry 36): what noise adds to a corrected mean is a hundredth of its own
_CURVATURE = np.array([5.0, 0.0, -3.0, -4.0, -3.0, 0.0, 5.0]) / 42.0


def step_of(records: Sequence[Record], length_m: float | None) -> float:
    """Return the grid's step for a vessel, s: fine for her length, and no finer than what was measured.

    Parameters
    ----------
    length_m : float or None
        Of the ship; without it the legs of her zigzags say how fast she answers.
    """
    if length_m is None:
        step = _STEP_LEGS * float(np.median([r.time_s[-1] / max(moves(r.rudder_rad), 1) for r in records]))
    else:
        speed = float(np.median([record.mean_speed_m_s for record in records]))
        step = _STEP_LENGTHS * length_m / max(speed, 0.1)
    fastest = min(_period(record) for record in records)
    return float(f"{max(float(np.clip(step, _FINEST_S, _COARSEST_S)), fastest):.2g}")


def _period(record: Record) -> float:
    periods = []
    for column in record.measured.T:
        time = record.time_s[np.isfinite(column)]
        if time.size > 1:
            periods.append(float(np.median(np.diff(time))))
    return min(periods)


def instants_of(record: Record, step_s: float) -> int:
    """Return how many instants the grid has over a record."""
    return int(np.floor(record.time_s[-1] / step_s)) + 1


def cells(time_s: Float, step_s: float) -> NDArray[np.int64]:
    """Return the number of the instant of the grid that each time lies nearest to."""
    number: NDArray[np.int64] = np.floor(time_s / step_s + 0.5).astype(np.int64)
    return number


def cell_means(time_s: Float, column: Float, step_s: float, n: int) -> tuple[Float, Float]:
    """Return what the readings around each instant of the grid say, and how much later than it their mean time is.

    The mean of a parabola at instants t is not its value at their mean, but half its second derivative times the
    variance of t more: a hundredth of the yaw rate's rise while a rudder moves, always to the same side. Readings after
    the last instant belong to none: the filters go no further.

    Parameters
    ----------
    time_s, column : ndarray, shape (m,)
        Readings, NaN where there is none.
    n : int
        Instants of the grid.

    Returns
    -------
    mean, late : ndarray, shape (n,)
        NaN and 0 where a cell has no reading.
    """
    good = np.isfinite(column)
    inside = time_s[good] <= step_s * (n - 1)
    cell = cells(time_s[good][inside], step_s)
    counts = np.bincount(cell, minlength=n)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell, column[good][inside], minlength=n) / counts
        off = time_s[good][inside] - step_s * cell
        late = np.bincount(cell, off, minlength=n) / counts
        apart = np.bincount(cell, (off - late[cell]) ** 2, minlength=n) / counts
    curvature = np.zeros(n)
    reach = _CURVATURE.size // 2
    if n > 2 * reach:
        curvature[reach : n - reach] = np.convolve(mean, _CURVATURE, mode="valid") / step_s**2
    # where a mean is missing beside it, a cell's curvature is not known
    return mean - 0.5 * np.nan_to_num(curvature) * apart, np.nan_to_num(late)


def readings_averaged(readings: SpeedReadings, step_s: float, n: int) -> SpeedReadings:
    """Return the means of readings around the instants of the grid, each at the mean instant of its readings.

    Parameters
    ----------
    n : int
        Instants of the grid.
    """
    mean, late = cell_means(readings.time_s, readings.speed_m_s, step_s, n)
    there = np.isfinite(mean)
    return SpeedReadings((step_s * np.arange(n) + late)[there], mean[there], readings.mean_s)
