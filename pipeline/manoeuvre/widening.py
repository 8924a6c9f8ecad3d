"""How much wider than its covariance the errors of a set are, as its own prediction errors show.

The covariance of maximum likelihood takes the prediction errors for independent. Where the model lacks something they
remember: over a leg they pull the parameters one way. The scores of the legs show how much, whatever the reason: if the
model were right, the sum of their squares would be the information. The factor is the root of the mean over the
parameters of the one over the other (Huber 1967, "The behavior of maximum likelihood estimates under nonstandard
conditions", Proc. 5th Berkeley Symposium; by clusters: Liang & Zeger 1986, "Longitudinal data analysis using
generalized linear models", Biometrika 73).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import Passed, RunFilter

#: a leg begins where the rudder has come to this share of its largest angle on the other side
_OVER = 0.5
#: step of the difference quotients, in standard errors
_STEP = 0.1
#: so few legs say nothing
_FEWEST = 6


def widening(
    filters: Sequence[RunFilter], levels: Sequence[Float], hull: Float, values: Float, covariance: Float
) -> float:
    """Return the factor on the standard errors, at least 1.

    Parameters
    ----------
    filters : sequence of RunFilter
        The manoeuvres that were fitted.
    levels : sequence of ndarray, shape (6,)
        Noise levels of each, as fitted.
    hull, values : ndarray, shape (6,) and (p,)
        Estimates.
    covariance : ndarray, shape (6 + p, 6 + p)
        Of them.
    """
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    free = np.flatnonzero(std > 0.0)
    if free.size == 0:
        return 1.0
    legs = np.concatenate(
        [_scores(*pair, hull, values, _STEP * std, free) for pair in zip(filters, levels, strict=True)]
    )
    if len(legs) < _FEWEST:
        return 1.0
    meat = legs.T @ legs * len(legs) / (len(legs) - 1.0)
    mean = float(np.trace(meat @ covariance[np.ix_(free, free)])) / free.size
    return float(np.sqrt(max(mean, 1.0))) if np.isfinite(mean) else 1.0


def _scores(run_filter: RunFilter, levels: Float, hull: Float, values: Float, steps: Float, free: np.ndarray) -> Float:
    """Return the derivative of every leg's log-likelihood by the free parameters, shape (legs, free)."""
    theta = np.concatenate([hull, values])
    moved = np.repeat(theta[:, None], 2 * free.size, axis=1)
    for k, parameter in enumerate(free):
        moved[parameter, 2 * k] += steps[parameter]
        moved[parameter, 2 * k + 1] -= steps[parameter]
    passes = run_filter.run_filters(moved[:6], np.repeat(levels[:, None], 2 * free.size, axis=1), moved[6:])
    at = np.column_stack([_log_likelihoods(passed) for passed in passes])
    slopes = (at[:, 0::2] - at[:, 1::2]) / (2.0 * steps[free])
    leg = _legs(run_filter.run.rudder_rad)
    scores: Float = np.stack([slopes[leg == k].sum(axis=0) for k in range(int(leg[-1]) + 1)])
    return scores


def _log_likelihoods(passed: Passed) -> Float:
    """Return what every instant adds to the log-likelihood, but for constants, shape (n,)."""
    terms: Float = -0.5 * np.nansum(np.log(passed.variance) + passed.innovation**2 / passed.variance, axis=1)
    return terms


def _legs(rudder_rad: Float) -> np.ndarray:
    """Return the number of the leg at every instant."""
    level = _OVER * float(np.max(np.abs(rudder_rad)))
    side = np.where(rudder_rad > level, 1, np.where(rudder_rad < -level, -1, 0))
    number, last, legs = 0, 0, np.zeros(side.size, dtype=int)
    for k, here in enumerate(side.tolist()):
        if here and last and here != last:
            number += 1
        last = here or last
        legs[k] = number
    return legs
