"""A common fit brought forward by further runs, at their own cost and not at that of all runs before (decision 0061).

Of the runs before the parabola is taken that they left (`kempf.pipeline.estimate.posterior`); the new ones are
filtered, each with noise levels of its own. Where the new top lies far from that of the parabola, or is not
found, the parabola says nothing of it, and all runs are to be fitted anew.

All of it is done with the instants of measurement as they are logged, as a fit of all runs is; what the runs before say
with theirs free is then put in the place of what they say of them as logged, by one step of Gauss and Newton.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.agreement import Agreement, agreement_of
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.level_bounds import to_intensities
from kempf.pipeline.estimate.maximum_likelihood import STANDARD, MaximumLikelihoodSettings
from kempf.pipeline.estimate.plain_fit import Alone, fitted_alone
from kempf.pipeline.estimate.pooled_fit import DECREMENT, MAX_ITERATIONS, CommonLikelihood, PooledFit, ended
from kempf.pipeline.estimate.pooled_uncertainty import PooledUncertainty, uncertainty_beside
from kempf.pipeline.estimate.posterior import Posterior
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.pipeline.estimate.search.variances import climb_in_variances
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.model_spec import N_HULL, ModelSpec

#: log-likelihood that the runs before may lose by the new top: farther from their own their parabola is no measure
_FAR = 4.5
#: with a smaller probability under what the runs before say, and disagree about, a new run is of another ship
_ODD = 1e-3


@dataclass(frozen=True, eq=False)
class Updated:
    """A common fit brought forward."""

    #: Of the new runs beside what the others say, instants of all as logged; its covariance is that of all.
    logged: PooledFit
    #: The same with the covariance beside what the others say with their instants free.
    fit: PooledFit
    #: Shape (6 + p,). From its point to the top beside that.
    step: Float
    #: The new runs by themselves.
    alone: tuple[Alone, ...]
    #: New runs that cannot be identified by themselves, with the reason.
    left_out: dict[str, str]
    #: Errors of the latter, not widened by what the runs disagree about, nor by what is not known of the new runs'
    #: instants.
    known: PooledUncertainty
    #: How well all runs agree on the ship.
    agreement: Agreement
    #: Of all runs.
    log_likelihood: float


def updated(
    before: Posterior,
    model: EffectModel,
    runs: Sequence[GridRun],
    spec: ModelSpec,
    workers: Executor,
    settings: MaximumLikelihoodSettings = STANDARD,
) -> Updated | None:
    """Bring a common fit forward by further runs.

    Parameters
    ----------
    before : Posterior
        What the fit left.
    model : EffectModel
        Of its parameters, lasting noise among them.
    runs : sequence of GridRun
        New ones, at least one, in order of time.
    spec : ModelSpec
        Disturbances.
    workers : Executor
        Runs share it; the sums do not depend on it.
    settings : MaximumLikelihoodSettings, optional
        Of the search of single runs.

    Returns
    -------
    Updated or None
        None where all runs are to be fitted anew, also because the others left nothing to build on, see
        `Posterior.usable`.
    """
    if not before.usable:
        return None
    outcomes = list(workers.map(lambda run: fitted_alone(run, spec, settings), runs))
    alone = tuple(single for single in outcomes if isinstance(single, Alone))
    left_out = {run.name: why for run, why in zip(runs, outcomes, strict=True) if isinstance(why, str)}
    if not alone:
        return None
    others = before.as_logged
    layout = CommonLikelihood([RunFilter(single.run, model, spec) for single in alone], workers, others)
    levels = np.concatenate([single.search.theta[N_HULL:] + to_intensities(spec) for single in alone])
    begin = np.concatenate([others.top / layout.scale, levels])
    fit = ended(layout, climb_in_variances(layout, begin, MAX_ITERATIONS, DECREMENT))
    if not fit.converged or not np.all(np.isfinite(fit.covariance)):
        return None
    loss = others.loss(fit.parameters)
    own, free = agreement_of(fit), N_HULL + int(np.count_nonzero(fit.model.of_ship))
    added = Agreement(own.statistic + 2.0 * loss, own.degrees_of_freedom + free)
    # in what the runs before disagree by, standard errors are that much wider
    scatter = before.agreement.widened**2
    if loss > _FAR * scatter or Agreement(added.statistic / scatter, added.degrees_of_freedom).p_value < _ODD:
        return None
    freed, step = _freed(before, fit)
    agreement = Agreement(
        before.agreement.statistic + added.statistic,
        before.agreement.degrees_of_freedom + added.degrees_of_freedom,
    )
    log_likelihood = before.log_likelihood - loss + fit.log_likelihood
    return Updated(fit, freed, step, alone, left_out, _known(before, freed), agreement, log_likelihood)


def _freed(before: Posterior, fit: PooledFit) -> tuple[PooledFit, Float]:
    """Put what the runs before say with their instants free in the place of what they say of them as logged.

    Returns
    -------
    (PooledFit, ndarray of shape (6 + p,))
        With the covariance beside that, and the step from its point to the top, which is not taken: new runs are
        linearised at that point, and their instants are found together with the step. At the top the new runs' own
        slope is that of the others as logged, reversed.
    """
    logged, freed = before.as_logged, before.freed
    covariance = inverse(inverse(fit.covariance) - logged.information + freed.information)
    step: Float = covariance @ (freed.score(fit.parameters) - logged.score(fit.parameters))
    return replace(fit, covariance=covariance), step


def _known(before: Posterior, fit: PooledFit) -> PooledUncertainty:
    """Return the errors of all runs: those that the others had, as far as they still count, and those of the new."""
    added = uncertainty_beside(fit, before.freed)
    kind = "sandwich" if "sandwich" in (before.kind, added.kind) else "information"
    share = fit.covariance @ before.freed.information
    return PooledUncertainty(share @ before.stated @ share.T + added.covariance, kind, added.one_step)
