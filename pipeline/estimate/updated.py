"""A common fit brought forward by further runs, at their own cost and not at that of all runs before (decision 0061).

Of the runs before the parabola is taken that they left (`kempf.pipeline.estimate.posterior`); the new ones are
filtered, each with noise levels of its own. Where the new top lies far from that of the parabola, or is not
found, the parabola says nothing of it, and all runs are to be fitted anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

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

    #: Of the new runs beside what the others say; its covariance is that of all.
    fit: PooledFit
    #: The new runs by themselves.
    alone: tuple[Alone, ...]
    #: New runs that cannot be identified by themselves, with the reason.
    left_out: dict[str, str]
    #: Errors of all, not widened by what the runs disagree about, nor by what is not known of the new runs' instants.
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
    stated: Callable[[PooledFit], PooledFit] = lambda fit: fit,
) -> Updated | None:
    """Bring a common fit forward by further runs.

    Parameters
    ----------
    before : Posterior
        What the fit left, see `Posterior.usable`.
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
    stated : callable, optional
        Returns a fit as it is stated, with unsure instants free: so it is compared with what the runs before say.

    Returns
    -------
    Updated or None
        None where all runs are to be fitted anew.
    """
    outcomes = list(workers.map(lambda run: fitted_alone(run, spec, settings), runs))
    alone = tuple(single for single in outcomes if isinstance(single, Alone))
    left_out = {run.name: why for run, why in zip(runs, outcomes, strict=True) if isinstance(why, str)}
    if not alone:
        return None
    layout = CommonLikelihood([RunFilter(single.run, model, spec) for single in alone], workers, before.parabola)
    levels = np.concatenate([single.search.theta[N_HULL:] + to_intensities(spec) for single in alone])
    begin = np.concatenate([before.point / layout.scale, levels])
    fit = ended(layout, climb_in_variances(layout, begin, MAX_ITERATIONS, DECREMENT))
    if not fit.converged or not np.all(np.isfinite(fit.covariance)):
        return None
    there = stated(fit)
    loss = before.parabola.loss(np.concatenate([there.hull, there.values]))
    own, free = agreement_of(fit), N_HULL + int(np.count_nonzero(fit.model.of_ship))
    added = Agreement(own.statistic + 2.0 * loss, own.degrees_of_freedom + free)
    # in what the runs before disagree by, standard errors are that much wider
    scatter = before.agreement.widened**2
    if loss > _FAR * scatter or Agreement(added.statistic / scatter, added.degrees_of_freedom).p_value < _ODD:
        return None
    share = fit.covariance @ before.parabola.information
    known = _known(before, fit, share)
    agreement = Agreement(
        before.agreement.statistic + added.statistic,
        before.agreement.degrees_of_freedom + added.degrees_of_freedom,
    )
    return Updated(fit, alone, left_out, known, agreement, before.log_likelihood - loss + fit.log_likelihood)


def _known(before: Posterior, fit: PooledFit, share: Float) -> PooledUncertainty:
    """Return the errors of all runs: those that the others had, as far as they still count, and those of the new."""
    added = uncertainty_beside(fit, before.parabola)
    kind = "sandwich" if "sandwich" in (before.kind, added.kind) else "information"
    return PooledUncertainty(share @ before.stated @ share.T + added.covariance, kind, added.one_step)
