"""How much wider than its covariance the errors of a set are, as its own prediction errors show.

The covariance of maximum likelihood takes the prediction errors for independent. Where the model lacks something they
remember: over a leg they pull the parameters one way. The scores of the legs show how much, whatever the reason: if the
errors were independent, the sum of their squares would be that of the scores of the single instants. The factor is the
root of the mean over the parameters of the one over the other (Huber 1967, "The behavior of maximum likelihood
estimates under nonstandard conditions", Proc. 5th Berkeley Symposium; by clusters: Liang & Zeger 1986, "Longitudinal
data analysis using generalized linear models", Biometrika 73; information by squares of scores: Berndt, Hall, Hall &
Hausman 1974, "Estimation and inference in nonlinear structural models", Annals of Economic and Social Measurement 3).

Of a log whose instants are not quite known every leg pulls the same way, and as far as they are known that is in the
covariance already (`kempf.pipeline.diagnose.screening.unsure_instants`): of such a log only the scatter of its legs
counts.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import Passed, RunFilter

#: a leg begins where the rudder has come to this share of its largest angle on the other side
_OVER = 0.5
#: steps of the difference quotients, in standard errors: the first at which no filter runs away
_STEPS = (0.1, 0.01, 0.001)
#: so few legs say nothing
_FEWEST = 6


def widening(filters: Sequence[RunFilter], levels: Sequence[Float], hull: Float, values: Float, std: Float) -> float:
    """Return the factor on the standard errors, at least 1.

    Parameters
    ----------
    filters : sequence of RunFilter
        The manoeuvres that were fitted.
    levels : sequence of ndarray, shape (6,)
        Noise levels of each, as fitted.
    hull, values : ndarray, shape (6,) and (p,)
        Estimates.
    std : ndarray, shape (6 + p,)
        Standard errors of them, 0 of one that is held: for the steps of the difference quotients alone.
    """
    free = np.flatnonzero(std > 0.0)
    if free.size == 0:
        return 1.0
    every = [(one, _slopes(one, own, hull, values, std, free)) for one, own in zip(filters, levels, strict=True)]
    # a manoeuvre in which the model runs away at the least change of a parameter says nothing
    used = [(one, own) for one, own in every if own is not None]
    if not used:
        return 1.0
    slopes = [own for _, own in used]
    parts = [_by_legs(one.run.rudder_rad, own) for one, own in used]
    count = sum(map(len, parts))
    of_log = np.repeat([one.run.day for one, _ in used], list(map(len, parts)))
    unsure = {one.run.day for one, _ in used if not one.run.instant_errors.known}
    # of the others the maximum takes one mean off, that of all
    legs, means = np.concatenate(parts), max(len(unsure), 1)
    for day in sorted(unsure):
        legs[of_log == day] -= legs[of_log == day].mean(axis=0)
    if count - means < _FEWEST - 1:
        return 1.0
    meat = legs.T @ legs * count / (count - means)
    independent = sum(own.T @ own for own in slopes)
    mean = float(np.trace(np.linalg.pinv(independent, hermitian=True) @ meat)) / free.size
    return float(np.sqrt(max(mean, 1.0))) if np.isfinite(mean) else 1.0


def _slopes(
    run_filter: RunFilter, levels: Float, hull: Float, values: Float, std: Float, free: np.ndarray
) -> Float | None:
    """Return what every instant adds to the scores of the free parameters, in their errors, shape (n, free).

    None where the filter runs away however little they are moved.
    """
    theta = np.concatenate([hull, values])
    for step in _STEPS:
        moved = np.repeat(theta[:, None], 2 * free.size, axis=1)
        for k, parameter in enumerate(free):
            moved[parameter, 2 * k] += step * std[parameter]
            moved[parameter, 2 * k + 1] -= step * std[parameter]
        passes = run_filter.run_filters(moved[:6], np.repeat(levels[:, None], 2 * free.size, axis=1), moved[6:])
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            at = np.column_stack([_log_likelihoods(passed) for passed in passes])
            slopes: Float = (at[:, 0::2] - at[:, 1::2]) / (2.0 * step)
        if np.all(np.isfinite(slopes)):
            return slopes
    return None


def _by_legs(rudder_rad: Float, slopes: Float) -> Float:
    """Return the scores of every leg, shape (legs, free)."""
    leg = _legs(rudder_rad)
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
