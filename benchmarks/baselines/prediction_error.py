"""Prediction error without disturbances: the innovations form with a free gain.

::

    x^[k+1] = A x^[k] + B u[k] + K e[k],    y[k] = x^[k] + e[k]

A and B follow from the hull by an exact step at the logged speed, K is free, and the determinant of the innovations'
covariance is made least (Ljung 1999, System Identification, 2nd ed., secs. 4.3, 7.2 and 9.2-9.4). For a constant
covariance that is weighted least squares; weights and fit take turns until they agree. The predictor, x+ = (A - K) x +
B u + K y, is held to forget its initial state within the record: one that does not fits the noise by way of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from benchmarks.baselines.start import named, ranked_starts
from benchmarks.baselines.step import exact_step, innovations
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.classical.report import NO_UNCERTAINTY, estimate_of
from kempf.pipeline.estimate.classical.resample import even, step_of, without_means
from kempf.pipeline.estimate.one_step_fit import one_step_fit
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate, Value
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec

#: what a run that left all bounds counts as, in standard deviations of the measurement a sample
_ABSURD = 1e3
#: the predictor's slowest mode falls at least to e^-4 within the record; how hard that bound pushes
_FORGOTTEN, _PUSH = 4.0, 30.0


@dataclass(frozen=True)
class PredictionErrorSettings:
    """Settings of the search."""

    #: Common step, s; None takes the GNSS period.
    step_s: float | None = None
    #: How many of the Mariner-like starts are carried to the end.
    starts: int = 2
    #: How often weights and fit may take turns.
    rounds: int = 30
    #: Of the Jacobian in one fit.
    evaluations: int = 60
    #: Converged when a round gains, and the quadratic model promises, less log-likelihood than this; on the bound of
    #: the predictor's memory, where there is no such model, a round's gain alone decides.
    decrement: float = 1e-3
    #: Take the means off measurements and rudder first, the usual remedy against what is constant.
    remove_means: bool = False


@dataclass(frozen=True, eq=False)
class _Fit:
    """Where one search ended; theta in the units of `_Problem`."""

    theta: Float
    log_determinant: float
    jacobian: Float
    decrement: float
    settled: bool
    iterations: tuple[dict[str, Any], ...]


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: PredictionErrorSettings) -> Estimate:
    """Estimate hull and gain by prediction error.

    Parameters
    ----------
    spec : ModelSpec
        Its wind and current are left out; the gain takes what it can of them.
    arm_per_m : float
        Without meaning here.

    Raises
    ------
    DataRejected
        No plausible ship stays bounded over the record.
    """
    uniform = even(record, settings.step_s)
    used = without_means(uniform) if settings.remove_means else uniform
    starts = ranked_starts(used)[: settings.starts]
    if not starts:
        raise DataRejected(
            "no_ship_explains_it",
            "No Mariner-like ship of any length stays bounded when she is simulated over this record.",
            "Look at the speed and the rudder over the segment.",
        )
    fits = []
    for length, hull in starts:
        problem = _Problem(used, hull)
        fits.append((problem, problem.search(settings), length))
    problem, best, length = min(fits, key=lambda entry: entry[1].log_determinant)
    return _report(problem, best, length, spec, settings)


class _Problem:
    """Innovations of one record as a function of theta = (hull / start, K, x0), all of order one."""

    def __init__(self, record: Record, start: Float) -> None:
        self.record, self.start = record, start
        self.measured = np.ascontiguousarray(record.measured[:, :2])
        self.spread = np.nanstd(self.measured, axis=0)
        self.gain_unit = np.outer(self.spread, 1.0 / self.spread)

    def innovations(self, theta: Float) -> Float:
        """Return e / spread, shape (n, 2)."""
        out = np.empty_like(self.measured)
        inside = innovations(
            self.start * theta[:6],
            theta[6:10].reshape(2, 2) * self.gain_unit,
            theta[10:] * self.spread,
            step_of(self.record),
            self.record.speed_m_s,
            self.record.rudder_rad,
            self.measured,
            out,
        )
        if not inside:
            return np.full_like(out, _ABSURD)
        scaled: Float = np.clip(out / self.spread, -_ABSURD, _ABSURD)
        return scaled

    def slowness(self, theta: Float) -> float:
        """Return how far the predictor lies beyond the bound on its memory; 0 inside."""
        A = np.empty((2, 2))
        speed = float(np.mean(self.record.speed_m_s))
        if not exact_step(self.start * theta[:6], speed, step_of(self.record), 0.0, 0.0, A, np.empty(2)):
            return _ABSURD
        slowest = np.max(np.abs(np.linalg.eigvals(A - theta[6:10].reshape(2, 2) * self.gain_unit)))
        left_over = self.measured.shape[0] * np.log(max(float(slowest), 1e-300)) / _FORGOTTEN + 1.0
        return float(np.clip(left_over, 0.0, _ABSURD))

    def covariance(self, theta: Float) -> Float:
        """Return the innovations' covariance in units of the spread, shape (2, 2)."""
        e = self.innovations(theta)
        count = max(1, int(np.count_nonzero(np.all(np.isfinite(self.measured), axis=1))))
        result: Float = e.T @ e / count
        return result

    def search(self, settings: PredictionErrorSettings) -> _Fit:
        """Let weights and fit take turns from this start."""
        theta = np.concatenate([np.ones(6), [0.1, 0.0, 0.0, 0.1], np.nan_to_num(self.measured[0]) / self.spread])
        last = np.inf
        iterations = [self._entry(0, theta)]
        jacobian, decrement, settled = np.zeros((1, theta.size)), np.inf, False
        for count in range(1, settings.rounds + 1):
            whitening = np.linalg.inv(np.linalg.cholesky(self.covariance(theta) + 1e-12 * np.eye(2)))

            def residual(t: Float, whitening: Float = whitening) -> Float:
                white = (self.innovations(t) @ whitening.T).ravel()
                return np.append(white, _PUSH * self.slowness(t))

            # 3-point: the noise of a 2-point difference is as large as what the last rounds still gain
            found = least_squares(residual, theta, jac="3-point", method="trf", max_nfev=settings.evaluations)
            theta, jacobian = found.x, found.jac
            iterations.append(self._entry(count, theta))
            now = self._log_determinant(theta)
            gradient = jacobian.T @ found.fun
            step = np.linalg.lstsq(jacobian.T @ jacobian, gradient, rcond=1e-13)[0]
            decrement = float(0.5 * gradient @ step)
            if abs(last - now) * 0.5 * self.measured.shape[0] < settings.decrement:
                settled = found.status > 0
                break
            last = now
        return _Fit(theta, self._log_determinant(theta), jacobian, decrement, settled, tuple(iterations))

    def _log_determinant(self, theta: Float) -> float:
        return float(np.linalg.slogdet(self.covariance(theta))[1])

    def _entry(self, count: int, theta: Float) -> dict[str, Any]:
        return {"iteration": count, "log_determinant": self._log_determinant(theta), **named(self.start * theta[:6])}


def _report(
    problem: _Problem, best: _Fit, length: float, spec: ModelSpec, settings: PredictionErrorSettings
) -> Estimate:
    hull = problem.start * best.theta[:6]
    slow = problem.slowness(best.theta) > 0.0
    converged = best.settled and (slow or best.decrement < settings.decrement)
    information = best.jacobian.T @ best.jacobian
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    condition = float(np.linalg.cond(information / np.outer(scale, scale)))
    covariance, warnings = NO_UNCERTAINTY, []
    if condition < 1e12:
        inverse = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
        covariance = inverse[:6, :6] * np.outer(problem.start, problem.start)
    else:
        warnings.append("no standard errors: the information is singular")
    if slow:
        warnings.append("the predictor's memory is at its bound: the gain is not that of a free maximum")
    gain = best.theta[6:10].reshape(2, 2) * problem.gain_unit
    out = problem.innovations(best.theta) * problem.spread
    out[~np.isfinite(problem.measured)] = np.nan
    std = np.sqrt(np.nanmean(out**2, axis=0))
    padded = np.column_stack([out, np.full(out.shape[0], np.nan)])
    fit = one_step_fit(problem.record.measured, padded, np.tile([std[0] ** 2, std[1] ** 2, 1.0], (out.shape[0], 1)))
    return estimate_of(
        "prediction-error",
        problem.record,
        hull,
        covariance,
        converged=converged,
        reason="weights and fit agree" if converged else "weights and fit still moved when the rounds ran out",
        report={
            "start": f"Mariner scaled to {length:g} m",
            "log_determinant": best.log_determinant,
            "decrement": best.decrement if np.isfinite(best.decrement) else None,
            "condition": condition if np.isfinite(condition) else None,
            "active_bounds": ["memory of the predictor"] if slow else [],
            "gain": [[float(k) for k in row] for row in gain],
        },
        spec=spec,
        iterations=best.iterations,
        # the innovations' levels: in the innovations form nothing separates noise and disturbance
        noise=(
            Value("innovation_v", float(std[0]), float("nan"), "m/s"),
            Value("innovation_r", float(std[1]), float("nan"), "rad/s"),
        ),
        fit=fit,
        warnings=tuple(warnings),
    )
