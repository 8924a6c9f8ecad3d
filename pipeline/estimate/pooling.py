"""Several segments of one vessel, one hull: maximum likelihood with the six parameters shared and all else her own.

Every segment keeps its disturbances, their levels, its noise levels, its initial state and its speed. Whether the
segments may share a hull is tested by the likelihood ratio: twice what separate hulls gain, chi-squared with six
degrees of freedom a segment beyond the first where one hull is true (Wilks 1938, Annals of Mathematical Statistics 9).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.likelihood import Likelihood
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.one_step_fit import one_step_fit
from kempf.pipeline.estimate.plausibility import doubts, not_white
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate, discrete_values, hull_values
from kempf.pipeline.estimate.search.block_arrow import Arrow, ArrowSteps
from kempf.pipeline.estimate.search.climb import Search, climb_by, free
from kempf.pipeline.estimate.search.scoring import Mask
from kempf.pipeline.estimate.uncertainty import from_information, sandwich
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec

_HULL = 6
#: with a smaller probability under one hull the segments are said not to share one
LEVEL = 0.01


@dataclass(frozen=True, eq=False)
class Member:
    """One segment of a pool: its name, what it measured, and l of eq. (16), 1/m."""

    name: str
    record: Record
    arm_per_m: float


class _Pool:
    """Sum of the members' log-likelihoods; theta is the hull, then the levels of one member after the other."""

    def __init__(self, members: Sequence[Likelihood], workers: Executor) -> None:
        self.members, self.workers = tuple(members), workers
        levels = [(m.active[_HULL:], m.low[_HULL:], m.high[_HULL:]) for m in members]
        first = members[0]
        self.active: Mask = np.concatenate([first.active[:_HULL], *(a for a, _, _ in levels)])
        self.low = np.concatenate([first.low[:_HULL], *(low for _, low, _ in levels)])
        self.high = np.concatenate([first.high[:_HULL], *(high for _, _, high in levels)])

    def own(self, theta: Float, number: int) -> Float:
        """Return theta as the member of this number has it."""
        return np.concatenate([theta[:_HULL], theta[self.place(number)]])

    def place(self, number: int) -> slice:
        """Where the levels of a member stand in theta."""
        n = self.members[number].active.size - _HULL
        return slice(_HULL + n * number, _HULL + n * (number + 1))

    def full(self, theta: Float) -> tuple[float, Float, Arrow]:
        """Log-likelihood, score and information of all members, summed in their order."""
        numbers = range(len(self.members))
        found = list(self.workers.map(lambda i: self.members[i].full(self.own(theta, i)), numbers))
        value, score = 0.0, np.zeros(theta.size)
        for number, (one, its_score, _) in enumerate(found):
            value += one
            score[:_HULL] += its_score[:_HULL]
            score[self.place(number)] = its_score[_HULL:]
        information = np.array([its_information for _, _, its_information in found])
        shared: Float = np.sum(information[:, :_HULL, :_HULL], axis=0)
        return value, score, Arrow(shared, information[:, :_HULL, _HULL:], information[:, _HULL:, _HULL:])


def identify(
    members: Sequence[Member], spec: ModelSpec, settings: MaximumLikelihoodSettings, workers: Executor
) -> Estimate:
    """Estimate one hull from several segments.

    Parameters
    ----------
    members : sequence of Member
        At least two.
    spec : ModelSpec
    settings : MaximumLikelihoodSettings
        For the separate searches and for the common one.
    workers : Executor
        Members share it; the sums do not depend on it.

    Returns
    -------
    Estimate
        ``report["pooling"]`` tells the test: statistic, degrees of freedom, p-value, ``may_be_pooled``, and how far
        every member's own estimate lies off. Where they may not be pooled the covariance is widened by the statistic
        over its degrees of freedom (Birge 1932, Physical Review 40), and a warning says so.

    Raises
    ------
    DataRejected
        ``too_few_to_pool``: fewer than two segments can be identified by themselves.
    """
    alone = list(workers.map(lambda member: _alone(member, spec, settings), members))
    kept = [(member, *one) for member, one in zip(members, alone, strict=True) if isinstance(one, tuple)]
    left_out = {m.name: one for m, one in zip(members, alone, strict=True) if isinstance(one, str)}
    if len(kept) < 2:
        raise DataRejected(
            "too_few_to_pool",
            f"{len(kept)} of {len(members)} segments can be identified by themselves; pooling needs two.",
            "Sail more zigzags, or see why the others fail: "
            + ("; ".join(f"{name}: {why}" for name, why in left_out.items()) or "nothing else was given"),
            {"left_out": left_out},
        )
    pool = _Pool([objective for _, objective, _, _ in kept], workers)
    searches = [search for _, _, search, _ in kept]
    start = np.concatenate([_weighted_mean(searches), *(search.theta[_HULL:] for search in searches)])
    best = climb_by(ArrowSteps(), pool, start, settings.max_iterations, settings.decrement)
    if not np.isfinite(best.log_likelihood):
        raise DataRejected(
            "nothing_in_common",
            f"The mean of {len(kept)} separate hulls is no ship that any of the segments allows.",
            "Identify the segments one by one and look at how far their parameters lie apart.",
            {"left_out": left_out},
        )
    return _report(pool, best, kept, left_out, settings)


def _alone(
    member: Member, spec: ModelSpec, settings: MaximumLikelihoodSettings
) -> tuple[Likelihood, Search[Float], dict[str, int]] | str:
    """Identify one member by itself, or say why it stays out of the pool."""
    try:
        objective, best, _, details, _ = maximum_likelihood.search(member.record, spec, member.arm_per_m, settings)
    except KempfError as error:
        return str(error)
    return (objective, best, details["gross_errors"]) if best.converged else f"not converged: {best.reason}"


def _weighted_mean(searches: Sequence[Search[Float]]) -> Float:
    """Mean of the separate hulls, each with the information it has beside its own levels."""
    weights = []
    for search in searches:
        covariance = np.linalg.pinv(search.information, hermitian=True)[:_HULL, :_HULL]
        weights.append(np.linalg.pinv(covariance, hermitian=True))
    total: Float = np.sum(weights, axis=0)
    moment: Float = np.sum([w @ s.theta[:_HULL] for w, s in zip(weights, searches, strict=True)], axis=0)
    scale = np.sqrt(np.diag(total))
    mean: Float = np.linalg.solve(total / np.outer(scale, scale), moment / scale) / scale
    return mean


def _report(
    pool: _Pool,
    best: Search[Arrow],
    kept: list[tuple[Member, Likelihood, Search[Float], dict[str, int]]],
    left_out: dict[str, str],
    settings: MaximumLikelihoodSettings,
) -> Estimate:
    # of the hull alone, the members' levels unknown: their own covariances are nobody's question
    complement, carried = best.information.masked(free(pool, best.theta, best.score)).eliminated()
    known = from_information(complement, np.arange(_HULL))
    covariance, kind = known.covariance, "information"
    traces = [m.trace(pool.own(best.theta, i), scores=True) for i, m in enumerate(pool.members)]
    fits = [
        one_step_fit(m.record.measured, t.innovation, t.variance) for m, t in zip(pool.members, traces, strict=True)
    ]
    if any(not_white(fit) for fit in fits):
        scores = np.concatenate([_of_the_hull(t.scores.sum(axis=1), c) for t, c in zip(traces, carried, strict=True)])
        ends = np.cumsum([0.0, *(m.record.time_s[-1] + 1.0 for m in pool.members)])
        time = np.concatenate([m.record.time_s + end for m, end in zip(pool.members, ends[:-1], strict=True)])
        robust = sandwich(covariance, scores, time, 12 * len(pool.members))
        if np.nanmax(np.diag(robust) / np.diag(covariance), initial=0.0) > 1.0:
            covariance, kind = robust, "sandwich"
    statistic = 2.0 * (sum(s.log_likelihood for _, _, s, _ in kept) - best.log_likelihood)
    freedom = _HULL * (len(kept) - 1)
    p_value = float(chi2.sf(statistic, freedom))
    allowed = p_value >= LEVEL
    widened = 1.0 if allowed else float(np.sqrt(statistic / freedom))
    covariance = covariance * widened**2
    hull, std = best.theta[:_HULL], np.sqrt(np.diag(covariance))
    speed = float(np.mean([m.record.mean_speed_m_s for m in pool.members]))
    warnings = [f"left out of the pool: {name} ({why})" for name, why in left_out.items()]
    if not best.converged:
        warnings.append(f"not converged: {best.reason}")
    if not allowed:
        warnings.append(
            f"the {len(kept)} segments do not share one hull (p = {p_value:.1g}): the ship, her load or what acts on "
            f"her changed, or the model lacks something; standard errors are widened {widened:.1f} times"
        )
    pooled_fit = {"horizon": "one step", "sample": "in sample", "segments": [f["channels"] for f in fits]}
    said = dict.fromkeys(sentence for fit in fits for sentence in doubts(hull, std, fit))
    return Estimate(
        estimator="ml-pooled",
        parameters=hull_values(hull, covariance),
        discrete=discrete_values(hull, covariance, speed, settings.discrete_step_s),
        covariance=covariance,
        noise=(),
        converged=best.converged,
        report={
            "converged": best.converged,
            "reason": best.reason,
            "iterations": len(best.passes) - 1,
            "speed_m_s": speed,
            "step_s": settings.discrete_step_s,
            "log_likelihood": best.log_likelihood,
            "condition": known.condition,
            "standard_errors": kind,
            "pooling": {
                "segments": len(kept),
                "left_out": left_out,
                "statistic": statistic,
                "degrees_of_freedom": freedom,
                "p_value": p_value,
                "may_be_pooled": allowed,
                "widened": widened,
                "members": [_member(m, s, hull, gross) for m, _, s, gross in kept],
            },
        },
        iterations=tuple(
            {
                "iteration": count,
                "log_likelihood": one.log_likelihood,
                **dict(zip(HULL_PARAMETERS, (float(x) for x in one.theta[:_HULL]), strict=True)),
            }
            for count, one in enumerate(best.passes)
        ),
        fit=pooled_fit,
        warnings=(*warnings, *said),
    )


def _of_the_hull(scores: Float, carried: Float) -> Float:
    """Return what a member's scores, shape (n, 12), say of the hull beyond her own levels, shape (n, 6)."""
    efficient: Float = scores[:, :_HULL] - scores[:, _HULL:] @ carried.T
    return efficient


def _member(member: Member, search: Search[Float], hull: Float, gross: dict[str, int]) -> dict[str, object]:
    """Tell how far a member's own hull lies from the common one, in its own standard errors."""
    index = np.flatnonzero(np.diag(search.information) > 0.0)
    std = np.sqrt(np.diag(from_information(search.information, index).covariance)[:_HULL])
    off = (search.theta[:_HULL] - hull) / std
    return {
        "segment": member.name,
        "gross_errors": gross,
        "off_in_std": dict(zip(HULL_PARAMETERS, (float(x) for x in off), strict=True)),
    }
