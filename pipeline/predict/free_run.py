"""How well a fitted model predicts a manoeuvre: its free run, and the likelihood of what was measured.

A free run takes no measurement in. What is no part of the ship is fitted to the manoeuvre itself, the same few
constants for every model: initial sway, yaw rate and heading, a constant wind force (and moment, where the model has
one), a constant current, the bias of the gyro where the model has one. So a steady wind is not mistaken for a poor
model; what changes on the way stays in the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun, spread

#: how far the constants may lie from nothing, SI: v, r, psi, F, M, c_1, c_2, b
_PRIOR = np.array([2.0, 0.1, 0.1, 0.05, 1e-3, 1.0, 1.0, 1e-3])
_STEP = 1e-3 * _PRIOR
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A free run beside what was measured."""

    name: str
    #: predicted, error: Shape (n, 3). What would be measured, and measured less predicted; NaN where not measured. m/s,
    #: rad/s, rad.
    predicted: Float
    error: Float
    #: Shape (8,). Initial v, r, psi and the constant F, M, c_1, c_2, b that were fitted.
    constants: Float

    @property
    def rms(self) -> Float:
        """Root mean square error by channel, shape (3,), NaN where not measured."""
        with np.errstate(invalid="ignore"):
            rms: Float = np.sqrt(np.nansum(self.error**2, axis=0) / np.sum(np.isfinite(self.error), axis=0))
        return rms

    @property
    def relative(self) -> Float:
        """Error by channel over the spread of the measurements, 1 - fit % / 100 as MATLAB's ``compare`` has it."""
        measured = self.error + self.predicted
        result: Float = self.rms / spread(measured)
        return result

    @property
    def relative_error(self) -> float:
        """The error of a model on this manoeuvre in one number: the mean of the channels' relative errors.

        It is what ladder, comparison, diagnosis and report all show: 1 - fit % / 100, mean over the channels. NaN where
        the run diverges.
        """
        return float("nan") if np.any(np.isinf(self.error)) else float(np.nanmean(self.relative))


def free_run(fit: PooledFit, run: GridRun) -> FreeRun:
    """Let the fitted ship run freely through a manoeuvre.

    Parameters
    ----------
    run : GridRun
        Fitted or held out.
    """
    filtered = RunFilter(run, fit.model, fit.runs[0].spec)
    return free_run_of(filtered, fit.hull, fit.values)


def free_run_of(filtered: RunFilter, hull: Float, values: Float) -> FreeRun:
    """As `free_run`, for a model and parameters that stand by themselves."""
    run = filtered.run
    used = np.flatnonzero(filtered.present()).tolist()
    start = np.zeros(8)
    first = [column[np.isfinite(column)][:3] for column in run.measured.T]
    for i in range(3):
        start[i] = float(np.mean(first[i])) if first[i].size else 0.0
    made = np.isfinite(run.measured)
    weight = (1.0 / np.maximum(spread(run.measured), 1e-9))[None, :] * np.ones_like(run.measured)

    def errors(starts: Float) -> Float:
        predicted = filtered.free_from(hull, values, starts)
        weighted: Float = ((run.measured[..., None] - predicted) * weight[..., None])[made]
        return weighted

    constants, base = start.copy(), errors(start[:, None])[:, 0]
    if not np.all(np.isfinite(base)):
        n = run.measured.shape
        return FreeRun(run.name, np.full(n, np.nan), np.where(made, np.inf, np.nan), start)
    anchor = start.copy()
    # beside thousands of measurements the prior only keeps what they do not determine from growing
    loose = 0.05 * np.sqrt(base.size) / _PRIOR[used]
    for _ in range(_ROUNDS):
        steps = np.diag(_STEP)[:, used]
        columns = (errors(constants[:, None] + steps) - base[:, None]) / steps.sum(axis=0)
        J = np.vstack([columns, np.diag(0.02 * loose)])
        e = np.concatenate([base, 0.02 * loose * (constants - anchor)[used]])
        if not np.all(np.isfinite(J)):
            break
        step = np.linalg.lstsq(J, -e, rcond=1e-10)[0]
        trial = constants.copy()
        trial[used] += step
        there = errors(trial[:, None])[:, 0]
        if not np.all(np.isfinite(there)) or there @ there > base @ base:
            break
        settled = base @ base - there @ there < 1e-6 * (base @ base)
        constants, base = trial, there
        if settled:
            break
    predicted = filtered.free(hull, values, constants)
    return FreeRun(run.name, predicted, run.measured - predicted, constants)


def predictive(fit: PooledFit, run: GridRun) -> float:
    """Return the log-likelihood of a manoeuvre that was not fitted, its noise levels the mean of the fitted ones."""
    filtered = RunFilter(run, fit.model, fit.runs[0].spec)
    levels = np.exp(np.mean(fit.levels, axis=0))
    return filtered.run_filter(fit.hull, levels, fit.values).log_likelihood
