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
from kempf.pipeline.shooting.normal_equations import NormalEquations, normal_equations
from kempf.pipeline.shooting.reduced import Reduced, Scales, reduce
from kempf.pipeline.shooting.shot_run import Moved, ShotRun, Unknowns
from kempf.schemas.model_spec import N_HULL

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
        return normal_equations(self.shots, self.parts).information

    @property
    def covariance(self) -> Float:
        """Of the shared unknowns, shape (6 + p, 6 + p), from the spread of what windows say; NaN for a diverged fit.

        Windows overlap, and what is misfitted hangs together from one to the next (Newey & West 1987, "A simple,
        positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix", Econometrica 55).
        """
        spread = np.zeros((self.shared.size, self.shared.size))
        if not np.isfinite(self.cost):
            return np.full(spread.shape, np.nan)
        for part in self.parts:
            spread += part.scores.T @ part.scores
            for lag in range(1, min(_LAGS, part.scores.shape[0] - 1) + 1):
                both = part.scores[lag:].T @ part.scores[:-lag]
                spread += (1.0 - lag / (_LAGS + 1.0)) * (both + both.T)
        here = normal_equations(self.shots, self.parts)
        scale = here.scale
        inverse = np.linalg.pinv(here.information / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale)
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
    here, damping, converged = normal_equations(shots, parts), _DAMPING, False
    for _ in range(iterations):
        step = here.step(damping)
        trial = _reduced(shots, [part.stepped(step) for part in parts], scales, workers)
        there = normal_equations(shots, trial)
        if np.isfinite(there.cost) and there.cost <= here.cost:
            settled = here.cost - there.cost < _SETTLED * here.cost
            parts, here, damping = trial, there, max(0.1 * damping, _LEAST_DAMPING)
            if settled:
                converged = True
                break
        else:
            damping *= 10.0
            if damping > _MOST_DAMPING or not np.isfinite(here.cost):
                break
    return ShootingFit(tuple(shots), scales, parts[0].at.shared, tuple(parts), here.cost, converged)


def moved(shots: Sequence[ShotRun], at: Sequence[Unknowns], scales: Scales, workers: Executor) -> list[Moved]:
    """Return what is predicted of every manoeuvre at a point, and its derivatives."""
    return list(workers.map(lambda pair: pair[0].moved(pair[1], scales.error), zip(shots, at, strict=True)))


def linearised(
    shots: Sequence[ShotRun],
    at: Sequence[Unknowns],
    scales: Scales,
    workers: Executor,
    without: Sequence[Moved] | None = None,
) -> NormalEquations | None:
    """Return the normal equations at a point; None where a window diverges there.

    Parameters
    ----------
    without : sequence of (ndarray, ndarray), optional
        See `ShotRun.moved`; one a manoeuvre.
    """
    equations = normal_equations(shots, _reduced(shots, at, scales, workers, without))
    return equations if np.isfinite(equations.cost) else None


def foreseen(here: NormalEquations) -> float:
    """Return what the sum of squares would fall to by one step of Gauss-Newton."""
    scale = here.scale
    step = np.linalg.lstsq(here.information / np.outer(scale, scale), -here.gradient / scale, rcond=1e-9)[0] / scale
    return here.cost + float(here.gradient @ step)


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
    own_misfit = misfit(part.errors)
    return (own_misfit if np.isfinite(part.cost) else float("inf")), part.at, part.errors


def _reduced(
    shots: Sequence[ShotRun],
    at: Sequence[Unknowns],
    scales: Scales,
    workers: Executor,
    without: Sequence[Moved] | None = None,
) -> list[Reduced]:
    predictions: Sequence[Moved | None] = without or [None] * len(shots)
    return list(
        workers.map(lambda job: reduce(job[0], job[1], scales, job[2]), zip(shots, at, predictions, strict=True))
    )
