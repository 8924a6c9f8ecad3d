"""Maximum likelihood of eq. (16) with wind force and current as states: the default estimator.

Starting points race on the thinned record, the best climb on the whole one, gross errors are taken out and the climb
goes on. The noise levels are estimated with the hull, as logarithms, inside stated bounds. Reference: Astrom (1980),
Automatica 16; Astrom and Kallstrom (1976), "Identification of ship steering dynamics", Automatica 12.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.linear_kernel import LOG_F, LOG_M, LOG_V
from kempf.pipeline.estimate.gating import gate
from kempf.pipeline.estimate.level_bounds import SIGMA_HIGH, SIGMA_LOW
from kempf.pipeline.estimate.likelihood import INITIAL_STD, Likelihood, Trace
from kempf.pipeline.estimate.likelihood_report import report
from kempf.pipeline.estimate.record.grid_run import averaged
from kempf.pipeline.estimate.record.record import Instants, Record
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.estimate.search.climb import Search, climb
from kempf.pipeline.estimate.search.starts import starting_points, thinned
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec

#: log-likelihoods this close are taken for one maximum; ones this far behind in the race cannot win it
_SAME_HILL = 0.1
_OUT_OF_REACH = 50.0
#: the race need not be run to the end: what is left over is less than what separates two hills
_RACE_DECREMENT = 1e-2
#: nor need its steps be exact: those of the thinned record are long, and cutting them up would cost more than the rest;
#: at this |A| h the process noise of a step is right to 1e-4
_RACE_LONGEST = 2.0


@dataclass(frozen=True)
class MaximumLikelihoodSettings:
    """Settings of the search; every one is part of a parameter set's identity."""

    #: Scoring steps per start.
    max_iterations: int = 80
    #: Converged when half the squared Newton decrement, the log-likelihood still to be gained, falls below this; at
    #: 1e-5 the estimate lies within 0.005 standard errors of the maximum.
    decrement: float = 1e-5
    #: How many starting points are carried to the end; the best one is kept.
    starts: int = 2
    #: entries, coarse_instants, coarse_iterations: The most likely starting points, so many of them, race first on the
    #: record thinned to about this many instants, for so many steps.
    entries: int = 2
    coarse_instants: int = 300
    coarse_iterations: int = 25
    #: sigma_low, sigma_high: Bounds of the noise levels, order of `NOISE_PARAMETERS`.
    sigma_low: tuple[float, ...] = SIGMA_LOW
    sigma_high: tuple[float, ...] = SIGMA_HIGH
    #: Standard deviations of the state (v, r, psi, F, M, c_1, c_2, b) at the first instant, wide: the data decide.
    initial_std: tuple[float, ...] = INITIAL_STD
    #: gate_width, gate_share, gate_rounds: Float, int. Measurements farther than ``gate_width`` robust standard
    #: deviations from their prediction are gross errors and are left out, unless they are more than ``gate_share`` of
    #: all; the fit and the gate take turns so many times.
    gate_width: float = 5.0
    gate_share: float = 0.1
    gate_rounds: int = 5
    #: Step of the discrete parameters (17) that are reported.
    discrete_step_s: float = 1.0

    def bind(self, record: Instants, spec: ModelSpec, arm_per_m: float) -> Likelihood:
        """Return the log-likelihood of a record under these settings."""
        return Likelihood(record, spec, arm_per_m, self.initial_std, self.sigma_low, self.sigma_high)

    def coarse(self, record: Instants, spec: ModelSpec, arm_per_m: float) -> Likelihood:
        """Return the log-likelihood of the thinned record on which the starting points race, cheap instead of exact."""
        few = thinned(record, self.coarse_instants)
        bounds = (self.initial_std, self.sigma_low, self.sigma_high)
        return Likelihood(few, spec, arm_per_m, *bounds, longest=_RACE_LONGEST)


STANDARD = MaximumLikelihoodSettings()


def settings_of(given: Mapping[str, Any]) -> MaximumLikelihoodSettings:
    """Return settings from JSON content, which has lists for tuples; what it lacks has its default."""
    content: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in given.items()}
    return MaximumLikelihoodSettings(**content)


def identify(
    record: Record,
    spec: ModelSpec,
    arm_per_m: float,
    settings: MaximumLikelihoodSettings,
    length_m: float | None = None,
) -> Estimate:
    """Estimate hull parameters and noise levels from one segment.

    Parameters
    ----------
    spec : ModelSpec
        Disturbance model.
    arm_per_m : float
        l of eq. (16), 1/m.
    length_m : float, optional
        Of the ship, for the step over which readings are averaged; see `kempf.pipeline.estimate.record.average`.

    Returns
    -------
    Estimate
        ``converged`` is False, with the reason in ``report``, where the search did not end at a maximum.

    Raises
    ------
    DataRejected
        ``no_ship_explains_it``: no start has a likelihood.
    """
    means = averaged(record, spec, arm_per_m, length_m)
    objective, best, trace, details, heavy = search(means, spec, arm_per_m, settings)
    return report(record, objective, best, trace, settings.discrete_step_s, details, heavy)


def search(
    record: Instants, spec: ModelSpec, arm_per_m: float, settings: MaximumLikelihoodSettings
) -> tuple[Likelihood, Search[Float], Trace, dict[str, Any], tuple[str, ...]]:
    """Find the maximum for one segment, gross errors taken out.

    Returns
    -------
    objective : Likelihood
        Without the gross errors.
    best : Search
    trace : Trace
        Of the filter there.
    details : dict
        ``start``, ``starts``, ``race`` and ``gross_errors``, for the report.
    heavy : tuple of str
        Measurements of which too many lie outside the gate for these to be gross errors.

    Raises
    ------
    DataRejected
        ``no_ship_explains_it``.
    """
    objective = settings.bind(record, spec, arm_per_m)
    name, best, races = _from_all_starts(objective, settings)
    objective, best, trace, taken_out, heavy = _without_gross_errors(objective, best, settings)
    return objective, best, trace, {"start": name, "gross_errors": taken_out, **races}, heavy


def _from_all_starts(
    objective: Likelihood, settings: MaximumLikelihoodSettings
) -> tuple[str, Search[Float], dict[str, list[dict[str, Any]]]]:
    """Let the starting points race on the thinned record and carry the best to the end on the whole one."""
    coarse = settings.coarse(objective.record, objective.spec, objective.arm_per_m)
    points = starting_points(objective.record, objective.spec)
    entries = sorted(points, key=lambda start: -coarse.value(start[1]))[: settings.entries]
    race = [(name, climb(coarse, theta, settings.coarse_iterations, _RACE_DECREMENT)) for name, theta in entries]
    race.sort(key=lambda entry: -entry[1].log_likelihood)

    def to_the_end(theta: Float) -> Search[Float]:
        return climb(objective, theta, settings.max_iterations, settings.decrement)

    started = dict(entries)
    finals = [(name, _raised(end.theta, started[name], coarse)) for name, end in _distinct(race, settings.starts)]
    searches = [(name, to_the_end(theta)) for name, theta in finals]
    if not any(np.isfinite(search.log_likelihood) for _, search in searches):
        # the race ran into ships that the whole record excludes: from the starting points themselves, then
        searches = [(name, to_the_end(theta)) for name, theta in entries]
    name, best = max(searches, key=lambda entry: entry[1].log_likelihood)
    if not np.isfinite(best.log_likelihood):
        raise DataRejected(
            "no_ship_explains_it",
            f"None of {len(searches)} starting ships gives these data a finite likelihood: the motion is not that of "
            "a ship under this rudder.",
            "Look at the channels over the segment (heading, yaw rate, speed, rudder); shorten or repeat it.",
            {"searches": _summary(searches)},
        )
    return name, best, {"starts": _summary(searches), "race": _summary(race)}


def _raised(theta: Float, start: Float, coarse: Likelihood) -> Float:
    """Return the end of a race with disturbances that it let sink to nothing raised to a tenth of where they began.

    The thinned record says little of them, and the way up from nothing is long.
    """
    raised = theta.copy()
    sunk = [i for i in (LOG_F, LOG_M, LOG_V) if coarse.active[i] and theta[i] <= coarse.low[i]]
    raised[sunk] = start[sunk] - np.log(10.0)
    return raised


def _distinct(race: list[tuple[str, Search[Float]]], starts: int) -> list[tuple[str, Search[Float]]]:
    """Return the best entries of the race that ended on different hills and are not out of reach of the best one."""
    best = race[0][1]
    chosen = [race[0]]
    for name, search in race[1:]:
        gap = best.log_likelihood - search.log_likelihood
        same = any(abs(other.log_likelihood - search.log_likelihood) < _SAME_HILL for _, other in chosen)
        if not same and gap < _OUT_OF_REACH and len(chosen) < starts:
            chosen.append((name, search))
    return chosen


def _without_gross_errors(
    objective: Likelihood, best: Search[Float], settings: MaximumLikelihoodSettings
) -> tuple[Likelihood, Search[Float], Trace, dict[str, int], tuple[str, ...]]:
    """Take gross errors out and climb on, until none is left or the rounds run out."""
    taken_out: dict[str, int] = {}
    heavy: tuple[str, ...] = ()
    trace = objective.trace(best.theta)
    for number in range(settings.gate_rounds):
        # wide gates first: a jump that the filter took in makes its sound neighbours look wrong
        wider = 2.0 ** max(0, 2 - number)
        width = settings.gate_width * wider
        gated = gate(objective.record, trace.innovation, trace.variance, width, settings.gate_share)
        heavy = gated.heavy
        if gated.taken_out:
            for key, count in gated.taken_out.items():
                taken_out[key] = taken_out.get(key, 0) + count
            objective = settings.bind(gated.record, objective.spec, objective.arm_per_m)
            best = climb(objective, best.theta, settings.max_iterations, settings.decrement)
            trace = objective.trace(best.theta)
        elif wider == 1.0:
            break
    return objective, best, trace, taken_out, heavy


def _summary(searches: list[tuple[str, Search[Float]]]) -> list[dict[str, Any]]:
    return [{"start": n, "log_likelihood": s.log_likelihood, "converged": s.converged} for n, s in searches]
