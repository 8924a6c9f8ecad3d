"""Standard errors of a common fit: from the information, or from what the prediction errors really did.

See `kempf.pipeline.estimate.uncertainty`, which has the sandwich and its references; here the scores are those of what
the runs share, beyond the noise levels that each run has for itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.one_step_fit import one_step_fit
from kempf.pipeline.estimate.plausibility import not_white
from kempf.pipeline.estimate.pooled_fit import Linearised, Parabola, PooledFit
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.pipeline.estimate.uncertainty import sandwich

#: stretches of time a run that the scores are summed over
_STRETCHES = 12


@dataclass(frozen=True, eq=False)
class PooledUncertainty:
    """What is known of the errors of a common fit."""

    #: Shape (6 + p, 6 + p). Of hull and effects; NaN where a bound is active.
    covariance: Float
    #: ``information`` or ``sandwich``.
    kind: str
    #: Of every run, see `kempf.pipeline.estimate.one_step_fit.one_step_fit`.
    one_step: tuple[dict[str, Any], ...]


def uncertainty_of(fit: PooledFit) -> PooledUncertainty:
    """Return the standard errors of a common fit, the larger ones where prediction errors are not white."""
    steps = _one_step(fit)
    if any(not_white(step) for step in steps):
        robust = _sandwich(fit)
        with np.errstate(invalid="ignore"):
            wider = np.nanmax(np.diag(robust) / np.diag(fit.covariance), initial=0.0)
        if wider > 1.0:
            return PooledUncertainty(robust, "sandwich", steps)
    return PooledUncertainty(fit.covariance, "information", steps)


def uncertainty_beside(fit: PooledFit, before: Parabola) -> PooledUncertainty:
    """Return what the runs of a fit add to its errors where it rests on a parabola of other runs, too.

    Parameters
    ----------
    before : Parabola
        Of the log-likelihood of the others.

    Returns
    -------
    PooledUncertainty
        Covariance of what the errors of these runs alone do to the fit's parameters.
    """
    steps = _one_step(fit)
    own = fit.covariance @ (inverse(fit.covariance) - before.information) @ fit.covariance
    if any(not_white(step) for step in steps):
        robust = _sandwich(fit)
        if np.max(np.diag(robust) / np.maximum(np.diag(own), 1e-300), initial=0.0) > 1.0:
            return PooledUncertainty(robust, "sandwich", steps)
    return PooledUncertainty(own, "information", steps)


def _one_step(fit: PooledFit) -> tuple[dict[str, Any], ...]:
    passes = [line.passed for line in fit.linearised]
    return tuple(
        one_step_fit(filtered.run.measured, passed.innovation, passed.variance)
        for filtered, passed in zip(fit.runs, passes, strict=True)
    )


def _sandwich(fit: PooledFit) -> Float:
    shared = fit.covariance.shape[0]
    scores, time, end = [], [], 0.0
    for filtered, line in zip(fit.runs, fit.linearised, strict=True):
        rows, _ = np.nonzero(np.isfinite(line.passed.innovation))
        scores.append(_scores(line, shared))
        time.append(filtered.run.time_s[rows] + end)
        end += float(filtered.run.time_s[-1]) + 1.0
    return sandwich(fit.covariance, np.concatenate(scores), np.concatenate(time), _STRETCHES * len(fit.runs))


def _scores(line: Linearised, shared: int) -> Float:
    """Return the score of every measurement of a run by what is shared, beyond its own levels, shape (m, shared)."""
    m = line.u.size // 2
    each = line.J[:m] * line.u[:m, None] + line.J[m:] * line.u[m:, None]
    common = [k for k, i in enumerate(line.index) if i < shared]
    own = [k for k, i in enumerate(line.index) if i >= shared]
    scores = np.zeros((m, shared))
    carried = line.J[:, common].T @ line.J[:, own] @ inverse(line.J[:, own].T @ line.J[:, own])
    scores[:, [line.index[k] for k in common]] = each[:, common] - each[:, own] @ carried.T
    return scores
