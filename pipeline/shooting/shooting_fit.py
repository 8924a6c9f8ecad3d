"""Fitting a model by what it predicts one leg ahead: least squares over the windows of all manoeuvres.

Gauss-Newton with Levenberg's damping (Marquardt 1963, Journal of SIAM 11); the states at the beginnings of the windows
and the constants of every manoeuvre are eliminated, so that a step costs what the shared unknowns cost (Bock 1983,
"Recent advances in parameter identification techniques for ODE"). It is the multi-step prediction error of Farina &
Piroddi (2011), "Simulation error minimization identification based on multi-stage prediction", International Journal of
Adaptive Control and Signal Processing 25.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.shooting.reduced import Reduced, Scales, reduce
from kempf.pipeline.shooting.shot_run import N_HULL, ShotRun, Unknowns

#: standard deviation of the weak prior of the hull's parameters, parts of those of an ordinary hull of her length
_HULL_WIDE = 1.0
_ITERATIONS, _SETTLED = 20, 1e-4
#: windows over which what is misfitted hangs together
_LAGS = 3
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-8, 1e8


@dataclass(frozen=True, eq=False)
class ShootingFit:
    """A model fitted by shooting."""

    shots: tuple[ShotRun, ...]
    scales: Scales
    #: Shape (6 + p,). Hull and effects.
    shared: Float
    #: One a manoeuvre, at the end.
    parts: tuple[Reduced, ...]
    #: Sum of squares with the priors.
    cost: float
    converged: bool

    @property
    def hull(self) -> Float:
        """Parameters of eq. (16), shape (6,)."""
        return self.shared[:N_HULL]

    @property
    def values(self) -> Float:
        """Parameters of the effects, shape (p,)."""
        return self.shared[N_HULL:]

    @property
    def errors(self) -> Float:
        """Mean square error of every manoeuvre in units of the scales, the channels summed, shape (runs,)."""
        return np.array([misfit(part.errors) for part in self.parts])

    @property
    def information(self) -> Float:
        """Of the shared unknowns, with the prior, shape (6 + p, 6 + p)."""
        precision, _ = _prior(self.shots[0], self.shared)
        result: Float = np.sum([part.information for part in self.parts], axis=0) + np.diag(precision)
        return result

    @property
    def covariance(self) -> Float:
        """Of the shared unknowns, shape (6 + p, 6 + p), from the spread of what the windows say.

        Windows overlap, and what is misfitted hangs together from one to the next (Newey & West 1987, "A simple,
        positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix", Econometrica 55).
        """
        spread = np.zeros((self.shared.size, self.shared.size))
        for part in self.parts:
            spread += part.scores.T @ part.scores
            for lag in range(1, min(_LAGS, part.scores.shape[0] - 1) + 1):
                both = part.scores[lag:].T @ part.scores[:-lag]
                spread += (1.0 - lag / (_LAGS + 1.0)) * (both + both.T)
        scale = np.sqrt(np.diag(self.information))
        inverse = np.linalg.pinv(self.information / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale)
        result: Float = inverse @ spread @ inverse
        return result


def misfit(errors: Float) -> float:
    """Return the mean over windows of squares, summed over channels; infinite where a window diverges.

    Parameters
    ----------
    errors : ndarray, shape (w, 3)
        As `kempf.pipeline.shooting.reduced.Reduced` has them.
    """
    measured = ~np.isnan(errors).all(axis=0)
    return float(np.sum(np.nanmean(errors[:, measured], axis=0)))


def fit(
    shots: Sequence[ShotRun],
    shared: Float,
    scales: Scales,
    workers: Executor,
    begin: Sequence[Unknowns] | None = None,
    iterations: int = _ITERATIONS,
) -> ShootingFit:
    """Fit a model to several manoeuvres.

    Parameters
    ----------
    shots : sequence of ShotRun
        All with one model.
    shared : ndarray, shape (6 + p,)
        To start from.
    scales : Scales
        The same for all models that are to be compared.
    begin : sequence of Unknowns, optional
        To start from; states as measured by default.
    """
    at = [replace(own, shared=shared) for own in begin] if begin else [shot.begin(shared) for shot in shots]
    parts = _reduced(shots, at, scales, workers)
    cost, damping, converged = _cost(shots[0], parts), _DAMPING, False
    model = shots[0].model
    low = np.concatenate([np.full(N_HULL, -np.inf), model.low])
    high = np.concatenate([np.full(N_HULL, np.inf), model.high])
    for _ in range(iterations):
        step = _step(shots[0], parts, damping, low, high)
        trial = _reduced(shots, [part.stepped(step) for part in parts], scales, workers)
        there = _cost(shots[0], trial)
        if np.isfinite(there) and there <= cost:
            settled = cost - there < _SETTLED * cost
            parts, cost, damping = trial, there, max(0.1 * damping, _LEAST_DAMPING)
            if settled:
                converged = True
                break
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING or not np.isfinite(cost):
                break
    return ShootingFit(tuple(shots), scales, parts[0].at.shared, tuple(parts), cost, converged)


def foreseen(shots: Sequence[ShotRun], at: Sequence[Unknowns], scales: Scales, workers: Executor) -> float | None:
    """Return what the sum of squares would fall to by one step of Gauss-Newton; None where a window diverges."""
    parts = _reduced(shots, at, scales, workers)
    cost = _cost(shots[0], parts)
    if not np.isfinite(cost):
        return None
    precision, gradient = _prior(shots[0], at[0].shared)
    information = np.sum([part.information for part in parts], axis=0) + np.diag(precision)
    gradient = np.sum([part.gradient for part in parts], axis=0) + gradient
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    step = np.linalg.lstsq(information / np.outer(scale, scale), -gradient / scale, rcond=1e-9)[0] / scale
    return cost + float(gradient @ step)


def alone(shot: ShotRun, shared: Float, scales: Scales, begin: Unknowns | None = None) -> tuple[float, Unknowns, Float]:
    """Return how a model with given shared parameters predicts a manoeuvre, whose own unknowns are fitted to it.

    Returns
    -------
    misfit : float
        Infinite where it diverges.
    at : Unknowns
    errors : ndarray, shape (w, 3)
    """
    at = replace(begin, shared=shared) if begin is not None else shot.begin(shared)
    part = reduce(shot, at, scales)
    for _ in range(3):
        trial = reduce(shot, part.stepped(np.zeros(shared.size)), scales)
        if not np.isfinite(trial.cost) or trial.cost > part.cost:
            break
        settled = part.cost - trial.cost < 1e-4 * part.cost
        part = trial
        if settled:
            break
    found = misfit(part.errors)
    return (found if np.isfinite(part.cost) else float("inf")), part.at, part.errors


def _reduced(shots: Sequence[ShotRun], at: Sequence[Unknowns], scales: Scales, workers: Executor) -> list[Reduced]:
    return list(workers.map(lambda pair: reduce(pair[0], pair[1], scales), zip(shots, at, strict=True)))


def _prior(shot: ShotRun, shared: Float) -> tuple[Float, Float]:
    """Return precision and gradient of the prior of the shared parameters, shape (6 + p,) each."""
    ordinary = mariner_like(shot.windows.run.ship.length_m).array()
    precision = np.zeros(shared.size)
    precision[:N_HULL] = 1.0 / (_HULL_WIDE * ordinary) ** 2
    gradient = np.zeros(shared.size)
    gradient[:N_HULL] = (shared[:N_HULL] - ordinary) * precision[:N_HULL]
    return precision, gradient


def _cost(shot: ShotRun, parts: Sequence[Reduced]) -> float:
    precision, gradient = _prior(shot, parts[0].at.shared)
    away = np.divide(gradient, precision, out=np.zeros_like(gradient), where=precision > 0.0)
    found = sum(part.cost for part in parts) + float(away @ gradient)
    return found if np.isfinite(found) else float("inf")


def _step(shot: ShotRun, parts: Sequence[Reduced], damping: float, low: Float, high: Float) -> Float:
    """Return the damped step of the shared parameters within their bounds; what would leave them is put on them."""
    at = parts[0].at.shared
    precision, gradient = _prior(shot, at)
    information = np.sum([part.information for part in parts], axis=0) + np.diag(precision)
    gradient = np.sum([part.gradient for part in parts], axis=0) + gradient
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    A = information / np.outer(scale, scale) + damping * np.eye(at.size)
    g = gradient / scale
    step, free = np.zeros(at.size), np.ones(at.size, dtype=bool)
    for _ in range(at.size):
        held = step * scale
        held[free] = 0.0
        step[free] = np.linalg.lstsq(A[np.ix_(free, free)], -(g + A @ held)[free], rcond=1e-14)[0] / scale[free]
        out = free & ((at + step < low) | (at + step > high))
        if not out.any():
            break
        step[out] = np.clip(at + step, low, high)[out] - at[out]
        free &= ~out
    return step
