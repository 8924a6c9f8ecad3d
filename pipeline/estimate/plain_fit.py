"""The plain model, eq. (16) without effects, fitted to several runs: each by itself first, then all with one hull.

Whether they may share a hull is tested by the likelihood ratio: twice what separate hulls gain, chi-squared with six
degrees of freedom a run beyond the first where one hull is true (Wilks 1938, Annals of Mathematical Statistics 9).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import maximum_likelihood, sensitivity
from kempf.pipeline.estimate.agreement import LEVEL, Agreement
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.level_bounds import to_intensities
from kempf.pipeline.estimate.maximum_likelihood import STANDARD, MaximumLikelihoodSettings
from kempf.pipeline.estimate.pooled_fit import SWIFTEST, CommonLikelihood, PooledFit, climbed, ended, swiftness
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.search.block_arrow import Arrow
from kempf.pipeline.estimate.search.climb import Search
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.estimate.uncertainty import from_information
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.model_spec import N_HULL, ModelSpec

#: hulls of single runs that a common climb may begin from where their mean is no ship
_ENTRIES = 4
#: a measurement's level, by its logarithm, that is so far from its usual one is on another hill
_UNLIKE, _DISTURBANCES = np.log(3.0), 3
#: a disturbance's level so far below its usual one has sunk to nothing
_SUNK = np.log(10.0)
#: log-likelihood by which another hill must be higher: less is what two climbs of one hill differ by
_HIGHER = 1.0


@dataclass(frozen=True, eq=False)
class Alone:
    """One run fitted by itself."""

    #: Without its gross errors.
    run: GridRun
    #: Where it ended; theta as `kempf.pipeline.estimate.filters.linear_kernel` has it.
    search: Search[Float]
    #: How many were taken out, by measurement.
    gross_errors: dict[str, int]

    @property
    def hull(self) -> Float:
        """Its hull, shape (6,)."""
        return self.search.theta[:N_HULL]


@dataclass(frozen=True, eq=False)
class PlainFit:
    """The plain model of several runs."""

    fit: PooledFit
    #: Its runs one by one.
    alone: tuple[Alone, ...]
    #: Runs that cannot be identified by themselves, with the reason.
    left_out: dict[str, str]
    #: Likelihood ratio of separate hulls to one.
    agreement: Agreement

    @property
    def gross_errors(self) -> int:
        """How many measurements were taken out."""
        return sum(sum(single.gross_errors.values()) for single in self.alone)


def off_in_std(single: Alone, fit: PooledFit) -> Float:
    """Return how far a run's own hull lies from a common one, in its own standard errors, shape (6,)."""
    information = single.search.information
    index = np.flatnonzero(np.diag(information) > 0.0)
    std = np.sqrt(np.diag(from_information(information, index).covariance)[:N_HULL])
    off: Float = (single.hull - fit.hull) / std
    return off


def fit_plain(
    runs: Sequence[GridRun],
    spec: ModelSpec,
    workers: Executor,
    settings: MaximumLikelihoodSettings = STANDARD,
    listener: Listener = SILENT,
) -> PlainFit:
    """Fit eq. (16) to every run, gross errors taken out, then one hull to all of them.

    Parameters
    ----------
    spec : ModelSpec
        Disturbances.
    workers : Executor
        Runs share it; the sums do not depend on it.
    listener : Listener, optional
        Notified of every run that is fitted by itself, then of every iteration of the common fit.

    Raises
    ------
    DataRejected
        ``no_ship_explains_it``: none of the runs can be identified by itself.
    """
    outcomes = []
    for outcome in workers.map(lambda run: fitted_alone(run, spec, settings), runs):
        outcomes.append(outcome)
        listener.counted(len(outcomes), len(runs))
    alone = tuple(single for single in outcomes if isinstance(single, Alone))
    left_out = {run.name: why for run, why in zip(runs, outcomes, strict=True) if isinstance(why, str)}
    if not alone:
        raise DataRejected(
            "no_ship_explains_it",
            f"None of the {len(runs)} manoeuvres can be identified by itself: "
            + "; ".join(f"{name}: {why}" for name, why in list(left_out.items())[:3]),
            "Look at the channels (heading, yaw rate, speed, rudder) of these segments.",
            {"left_out": left_out},
        )
    filtered = [RunFilter(single.run, EffectModel(), spec) for single in alone]
    own_levels = np.array([single.search.theta[N_HULL:] + to_intensities(spec) for single in alone])
    levels = _first_levels(own_levels).ravel()
    mean = alone[0].hull if len(alone) == 1 else _weighted_mean(alone)

    def climbed_from(hull: Float) -> tuple[CommonLikelihood, Search[Arrow]]:
        layout = CommonLikelihood(filtered, workers)
        return layout, climbed(layout, np.concatenate([hull, levels]), listener=listener)

    layout, search = climbed_from(mean)
    if not np.isfinite(search.log_likelihood):
        # the mean is no ship: from the best of a few runs' own, then
        hulls = [single.hull for single in alone[:_ENTRIES]]
        best = max(hulls, key=lambda hull: layout.full(np.concatenate([hull, levels]))[0])
        layout, search = climbed_from(best)
    separate = _separate(alone, filtered, own_levels, search.theta[:N_HULL], workers)
    if not (search.converged and _agreement(alone, separate, search).p_value >= LEVEL):
        # runs that seem to be of two ships may have been climbed on a lower hill
        beside, other = climbed_from(mariner_like(runs[0].ship.length_m).array())
        # the higher one may end at the limit of what a hull may be, not converged: the lower is no better for that
        if other.log_likelihood > search.log_likelihood + _HIGHER:
            layout, search = beside, other
    return PlainFit(ended(layout, search), alone, left_out, _agreement(alone, separate, search))


def _separate(
    alone: Sequence[Alone], filtered: Sequence[RunFilter], levels: Float, common: Float, workers: Executor
) -> float:
    """Return the log-likelihood of all runs, each with a hull of its own, as the common fit counts it.

    By its filter: that of single runs differs by tenths. And within its limit: a run by itself may have a hull that
    answers faster than vessels do, and climbs anew then, from the common one.

    Parameters
    ----------
    levels : ndarray, shape (runs, 6)
        Logarithms of the single runs' noise levels.
    common : ndarray, shape (6,)
        The hull of all.
    """
    points = [Point(single.hull, np.zeros(0), level) for single, level in zip(alone, levels, strict=True)]
    values = [passed.log_likelihood for passed in workers.map(sensitivity.passed, filtered, points)]
    for number, (single, run) in enumerate(zip(alone, filtered, strict=True)):
        if swiftness(single.hull, run.run.ship.length_m) > SWIFTEST:
            begin = np.concatenate([common, levels[number]])
            values[number] = climbed(CommonLikelihood([run], workers), begin).log_likelihood
    return sum(values)


def _agreement(alone: Sequence[Alone], separate: float, search: Search[Arrow]) -> Agreement:
    """Return whether the runs share one hull, six degrees of freedom a run beyond the first."""
    return Agreement(max(2.0 * (separate - search.log_likelihood), 0.0), N_HULL * (len(alone) - 1))


def fitted_alone(run: GridRun, spec: ModelSpec, settings: MaximumLikelihoodSettings) -> Alone | str:
    """Fit a run by itself, or say why that cannot be."""
    record = RunFilter(run, EffectModel(), spec).linear().record
    try:
        objective, best, _, details, _ = maximum_likelihood.search(record, spec, run.ship.arm_per_m, settings)
    except KempfError as error:
        return str(error)
    return Alone(run.without(objective.record), best, details["gross_errors"])


def _first_levels(levels: Float) -> Float:
    """Return levels to begin from, shape (runs, 6): those of single runs, but for levels far from their usual ones.

    The instruments are the same in every run. Where a model lacks something a single run has several maxima, and one
    that takes, say, the yaw rate for exact and the heading for noisy is no measure of the instruments. A disturbance
    that sank to nothing in a single run is often one that the run's own hull has explained away.
    """
    usual = np.median(levels, axis=0)
    strange = np.abs(levels - usual) > _UNLIKE
    strange[:, :_DISTURBANCES] = (levels < usual - _SUNK)[:, :_DISTURBANCES]
    begin: Float = np.where(strange, usual, levels)
    return begin


def _weighted_mean(alone: Sequence[Alone]) -> Float:
    """Mean of the separate hulls, each with the information it has beside its own levels."""
    weights = []
    for single in alone:
        covariance = np.linalg.pinv(single.search.information, hermitian=True)[:N_HULL, :N_HULL]
        weights.append(np.linalg.pinv(covariance, hermitian=True))
    total: Float = np.sum(weights, axis=0)
    moment: Float = np.sum([w @ single.hull for w, single in zip(weights, alone, strict=True)], axis=0)
    scale = np.sqrt(np.diag(total))
    mean: Float = np.linalg.lstsq(total / np.outer(scale, scale), moment / scale, rcond=1e-12)[0] / scale
    return mean
