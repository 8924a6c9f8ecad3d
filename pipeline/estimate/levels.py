"""Noise levels of a run under a ship that is given: the search of every fit, hull and effects held."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.level_bounds import to_intensities
from kempf.pipeline.estimate.pooled_fit import CommonLikelihood
from kempf.pipeline.estimate.search.starts import noise_levels
from kempf.pipeline.estimate.search.variances import climb_in_variances

_DECREMENT, _MAX_ITERATIONS = 1e-2, 30


@dataclass(frozen=True, eq=False)
class Levels:
    """Noise levels of one run."""

    #: Shape (6,). Logarithms, see `kempf.pipeline.estimate.pooled_fit.PooledFit`.
    levels: Float
    log_likelihood: float
    converged: bool


def first_levels(filtered: RunFilter) -> Float:
    """Return logarithms of noise levels to start from, shape (6,)."""
    return np.log(noise_levels(filtered.run.instants(), filtered.spec)) + to_intensities(filtered.spec)


def fit_levels(filtered: RunFilter, hull: Float, values: Float, start: Float) -> Levels:
    """Climb the likelihood in the noise levels, hull and effects held.

    Parameters
    ----------
    hull, values : ndarray, shapes (6,) and (p,)
    start : ndarray, shape (6,)
        Logarithms of the levels.

    Returns
    -------
    Levels
        Not converged, with a log-likelihood of -inf, where the ship runs away from the measurements.
    """
    with ThreadPoolExecutor(max_workers=1) as workers:
        objective = CommonLikelihood([filtered], workers)
        objective.active[: objective.shared] = False
        begin = np.concatenate([hull, values / objective.unit, start])
        search = climb_in_variances(objective, begin, _MAX_ITERATIONS, _DECREMENT)
    return Levels(search.theta[objective.shared :], search.log_likelihood, search.converged)
