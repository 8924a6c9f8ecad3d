"""What of the speed's changes in a manoeuvre may be its log's noise: allowed for, not estimated.

A fit takes the speed for known, with the log's noise smoothed away and an error that wanders. Of a ship that keeps her
speed, or whose log is slow or noisy, much of what is left of the speed's changes is noise, or is too little where it
was smoothed away with the noise. Forces that go with the speed are then wrong in proportion to these changes, in all
manoeuvres alike, and look like a force that the model lacks. The part of the changes that may be noise, or missing, is
the error's variance over theirs (the complement of the reliability ratio of Carroll, Ruppert, Stefanski & Crainiceanu
2006, Measurement Error in Nonlinear Models, ch. 1). Here it is a random number with that standard deviation, and what
it does is taken out of innovations and of all that acts on them (Schmidt 1966, "Application of state-space methods to
navigation problems", Advances in Control Systems 3: parameters that are considered, not estimated).
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.sensitivity import difference

#: part of its standard deviation by which the number is moved
_STEP = 0.1
#: squared, what is too small for the digits of the factor below
_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class SpeedNoise:
    """What a standard deviation of the number does to the whitened innovations of every run."""

    #: Shape (2 m,) each, m being a run's measurements; zeros of a run whose speed has no error, and of one that runs
    #: away with it.
    columns: tuple[Float, ...]

    def beside(self, of_all: Float) -> Float:
        """Return what acts on the innovations of all runs, allowing for the noise.

        Parameters
        ----------
        of_all : ndarray, shape (N,) or (N, c)
            The runs one below the other, N being the rows of all ``columns``.

        Returns
        -------
        ndarray
            Of the same shape.
        """
        ends = np.cumsum([column.size for column in self.columns])
        parts = zip(self.columns, np.split(of_all, ends[:-1]), strict=True)
        return np.concatenate([_beside(column, part) for column, part in parts])

    def of(self, fit: PooledFit) -> PooledFit:
        """Return the fit with its linearised runs, u and J, allowing for the noise."""
        pairs = zip(self.columns, fit.linearised, strict=True)
        lines = (replace(line, u=_beside(column, line.u), J=_beside(column, line.J)) for column, line in pairs)
        return replace(fit, linearised=tuple(lines))


def speed_noise(fit: PooledFit, workers: Executor) -> SpeedNoise:
    """Return what the noise of the logs may do.

    The number is the same in all manoeuvres, and would couple their innovations. In its place each of the n manoeuvres
    has one of its own with n times the variance: what is left of a common one is then no larger than what is left of
    one manoeuvre's.

    Parameters
    ----------
    fit : PooledFit
        Linearised where it stands.
    workers : Executor
        Runs share it; nothing depends on it.
    """
    root = float(np.sqrt(len(fit.runs)))
    return SpeedNoise(tuple(workers.map(lambda number: root * _column(fit, number), range(len(fit.runs)))))


def _column(fit: PooledFit, number: int) -> Float:
    filtered, line = fit.runs[number], fit.linearised[number]
    run, nothing = filtered.run, np.zeros(line.u.size)
    changes = _changes_by_noise(run)
    if changes is None:
        return nothing
    inputs = run.inputs.copy()
    inputs[:, 0] += _STEP * changes
    other = replace(filtered, run=replace(run, inputs=inputs))
    passed = other.run_filter(fit.hull, np.exp(fit.levels[number]), fit.values)
    column = difference(line.passed, passed, _STEP)
    return column if np.all(np.isfinite(column)) else nothing


def _changes_by_noise(run: GridRun) -> Float | None:
    """Return what of the speed's changes may be noise, m/s, on the instants of the input table; None of no error."""
    changes = run.inputs[:, 0] - np.mean(run.inputs[:, 0])
    square = float(np.mean(changes**2))
    if not (run.speed_error_std_m_s > 0.0 and square > 0.0):
        return None
    result: Float = min(1.0, run.speed_error_std_m_s**2 / square) * changes
    return result


def _beside(column: Float, part: Float) -> Float:
    """Return a part times (I + c c')^(-1/2), c being the column: free of the correlation that c brings in."""
    square = float(column @ column)
    if square < _NOTHING:
        return part
    taken = (1.0 - (1.0 + square) ** -0.5) / square
    result: Float = part - taken * np.multiply.outer(column, column @ part)
    return result
