"""Windows of a manoeuvre: pieces one leg long, each begun from what was measured around its first instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.moves import moves

Rows = NDArray[np.int64]
#: around the first instant of a window the measurements are smoothed over this part of it to either side
_SMOOTHED = 1.0 / 16.0
#: fewest instants of a window
_FEWEST = 8


@dataclass(frozen=True, eq=False)
class Windows:
    """The windows of one manoeuvre; each begins in the middle of the one before, where nothing else is asked for."""

    run: GridRun
    #: First and last instant of every window, shape (w,).
    begins: Rows
    ends: Rows
    #: Measurements at the first instants, smoothed, and their standard errors, shape (w, 3); NaN where not measured.
    start: Float
    start_std: Float

    @cached_property
    def rows(self) -> Rows:
        """Instant of every row, window after window, shape (m,)."""
        return np.concatenate([np.arange(b, e + 1) for b, e in zip(self.begins, self.ends, strict=True)])

    @cached_property
    def of_row(self) -> Rows:
        """Window of every row, shape (m,)."""
        return np.repeat(np.arange(self.begins.size), self.ends - self.begins + 1)

    @cached_property
    def course(self) -> Float:
        """What was measured at every instant of the run, means over `_SMOOTHED` of a window, shape (n, 3); 0 if never.

        For what moves slowly beside it: the states of effects.
        """
        reach = max(2, round(_SMOOTHED * int(np.max(self.ends - self.begins))))
        return np.column_stack([_box_means(column, reach) for column in self.run.measured.T])

    @cached_property
    def measured(self) -> Float:
        """What was measured at every row, shape (m, 3)."""
        return self.run.measured[self.rows]


def leg_s(runs: Sequence[GridRun]) -> float:
    """Return how long a leg of these manoeuvres lasts, s: the median over them."""
    return float(np.median([run.time_s[-1] / max(moves(run.rudder_rad), 1) for run in runs]))


def windows_of(run: GridRun, horizon_s: float, every: float = 0.5) -> Windows:
    """Cut a manoeuvre into windows.

    Parameters
    ----------
    horizon_s : float
        Length of a window; a manoeuvre that is shorter is one window.
    every : float, optional
        Part of a window after which the next one begins.
    """
    n = run.measured.shape[0]
    length = int(np.clip(round(horizon_s / run.step_s), _FEWEST, n - 1))
    apart, half = max(1, int(every * length)), max(1, length // 2)
    begins = np.arange(0, max(1, n - 1 - half), apart, dtype=np.int64)
    ends = np.minimum(begins + length, n - 1)
    start, std = _smoothed(run, begins, max(2, round(_SMOOTHED * length)))
    return Windows(run, begins, ends, start, std)


def noise_of(column: Float) -> float:
    """Return the standard deviation of white noise on a smooth course, from its third differences; NaN for too few."""
    third = np.diff(column, 3)
    third = third[np.isfinite(third)]
    # median of the absolute value of a Gaussian is 0.6745 of its standard deviation; 20 = 1 + 9 + 9 + 1
    return float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20.0)) if third.size > 3 else float("nan")


def _box_means(column: Float, reach: int) -> Float:
    """Return the means of what there is within some instants to either side, shape (n,), linear over what is empty."""
    n, there = column.size, np.isfinite(column)
    if not there.any():
        return np.zeros(n)
    at = np.arange(n)
    first, last = np.maximum(at - reach, 0), np.minimum(at + reach + 1, n)
    count, total = (np.concatenate([[0.0], np.cumsum(c)]) for c in (there, np.where(there, column, 0.0)))
    many = count[last] - count[first]
    full = many > 0.0
    mean: Float = np.interp(at, at[full], (total[last] - total[first])[full] / many[full])
    return mean


def _smoothed(run: GridRun, begins: Rows, reach: int) -> tuple[Float, Float]:
    """Fit a parabola to the measurements around every first instant."""
    n = run.measured.shape[0]
    value, std = np.full((begins.size, 3), np.nan), np.full((begins.size, 3), np.nan)
    for i in range(3):
        column = run.measured[:, i]
        noise = noise_of(column)
        if np.isnan(noise):
            # of a slow instrument no four readings follow each other on the grid
            noise = noise_of(column[np.isfinite(column)])
        for w, begin in enumerate(begins):
            rows = np.arange(max(0, begin - reach), min(n, begin + reach + 1))
            rows = rows[np.isfinite(column[rows])]
            if rows.size < 2 or np.isnan(noise):
                continue
            away = (rows - begin + run.offset_s[rows, i] / run.step_s) / reach
            A = np.vander(away, min(3, rows.size - 1), increasing=True)
            inverse = np.linalg.pinv(A)
            value[w, i] = inverse[0] @ column[rows]
            left = column[rows] - A @ (inverse @ column[rows])
            spare = rows.size - A.shape[1]
            own = float(np.sqrt(left @ left / spare)) if spare > 1 else noise
            std[w, i] = np.sqrt(inverse[0] @ inverse[0]) * max(noise, own)
    return value, std
