"""Noise levels of a run under a ship that is given: a few scoring steps of the levels alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import Filtered
from kempf.pipeline.estimate.pooled_fit import HIGHEST, LOWEST
from kempf.pipeline.estimate.sensitivity import N_HULL, N_LEVELS, Point

_STEP, _DECREMENT, _MAX_ITERATIONS = 1e-3, 1e-2, 30


@dataclass(frozen=True, eq=False)
class Levels:
    """Noise levels of one run.

    Attributes
    ----------
    levels : ndarray, shape (6,)
        Logarithms, see `kempf.pipeline.estimate.pooled_fit.Fit`.
    log_likelihood : float
    converged : bool
    """

    levels: Float
    log_likelihood: float
    converged: bool


def fit_levels(filtered: Filtered, hull: Float, values: Float, start: Float) -> Levels:
    """Climb the likelihood in the noise levels, hull and effects held.

    Parameters
    ----------
    filtered : Filtered
    hull, values : ndarray, shapes (6,) and (p,)
    start : ndarray, shape (6,)
        Logarithms of the levels.

    Returns
    -------
    Levels
        Not converged, with a log-likelihood of -inf, where the ship runs away from the measurements.
    """
    first = N_HULL + values.size
    used = np.flatnonzero(filtered.levels_used())
    point = Point(hull, values, np.clip(start, LOWEST, HIGHEST))
    passed = sensitivity.passed(filtered, point)
    damping, converged = 1e-4, False
    for _ in range(_MAX_ITERATIONS):
        if not np.isfinite(passed.log_likelihood):
            break
        others = sensitivity.passes(filtered, [point.moved(first + i, _STEP) for i in used.tolist()])
        J = np.column_stack([sensitivity.difference(passed, other, _STEP) for other in others])
        score, information = J.T @ sensitivity.whitened(passed), J.T @ J
        held = ((point.levels <= LOWEST)[used] & (score < 0.0)) | ((point.levels >= HIGHEST)[used] & (score > 0.0))
        free = np.flatnonzero(~held).tolist()
        if not free or _gain(information, score, free) < _DECREMENT:
            converged = True
            break
        rose = False
        while damping < 1e6 and not rose:
            block = information[np.ix_(free, free)]
            step = np.zeros(N_LEVELS)
            damped = block + damping * np.diag(np.maximum(np.diag(block), 1e-12))
            step[used[free]] = np.linalg.lstsq(damped, score[free], rcond=1e-12)[0]
            moved = np.clip(point.levels + np.clip(step, -1.0, 1.0), LOWEST, HIGHEST)
            trial = Point(hull, values, moved)
            there = sensitivity.passed(filtered, trial)
            rose = bool(there.log_likelihood > passed.log_likelihood)
            damping = damping / 10.0 if rose else max(10.0 * damping, 1e-3)
        if not rose:
            break
        point, passed = trial, there
    return Levels(point.levels, passed.log_likelihood, converged)


def _gain(information: Float, score: Float, free: list[int]) -> float:
    """Return the log-likelihood still to be gained."""
    step = np.linalg.lstsq(information[np.ix_(free, free)], score[free], rcond=1e-12)[0]
    return 0.5 * float(score[free] @ step)
