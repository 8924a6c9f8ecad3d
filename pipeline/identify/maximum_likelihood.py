"""Maximum likelihood of eq. (16) with wind force and current as states: the default estimator.

Fisher scoring with a Levenberg-Marquardt step on the compiled likelihood of `pipeline.identify.kernel`; the noise
levels are estimated with the hull, as logarithms, inside stated bounds. Standard errors are the Cramer-Rao bound at the
estimate. Reference: Astrom (1980), Automatica 16; Astrom and Kallstrom (1976), "Identification of ship steering
dynamics", Automatica 12.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.identify.doubts import doubts
from pipeline.identify.estimate import Estimate, Value, discrete_values, hull_values
from pipeline.identify.fit import one_step_fit
from pipeline.identify.gating import gate
from pipeline.identify.kernel import FASTEST_PER_S, N_STATE, N_THETA, likelihood, no_trace
from pipeline.identify.record import Record
from pipeline.identify.scoring import Mask, bfgs, damped_step, newton_decrement
from pipeline.identify.starts import starting_points, thinned
from pipeline.normalise.series import Float
from schemas.errors import DataRejected
from schemas.model_spec import HULL_PARAMETERS, NOISE_PARAMETERS, ModelSpec

#: with less log-likelihood than this to gain, steps tell more of the curvature than the expected information
_NEAR = 1.0
#: logarithm of a noise level whose square is 0 to a double
_NOTHING = -400.0
#: log-likelihoods this close are taken for one maximum; ones this far behind in the race cannot win it
_SAME_HILL = 0.1
_OUT_OF_REACH = 50.0
#: rate at which the ship answers times the rudder's period, above which its samples leave too much open
_RUDDER_TOO_SLOW = 0.3


@dataclass(frozen=True)
class MaximumLikelihoodSettings:
    """Settings of the search; every one is part of a parameter set's identity.

    Attributes
    ----------
    max_iterations : int
        Scoring steps per start.
    decrement : float
        Converged when half the squared Newton decrement, the log-likelihood still to be gained, falls below this; at
        1e-5 the estimate lies within 0.005 standard errors of the maximum.
    starts : int
        How many starting points are carried to the end; the best one is kept.
    entries, coarse_instants, coarse_iterations : int
        The most likely starting points, so many of them, race first on the record thinned to about this many instants,
        for so many steps.
    sigma_low, sigma_high : tuple of float
        Bounds of the noise levels, order of `NOISE_PARAMETERS`.
    initial_std : tuple of float
        Standard deviations of the state (v, r, F, psi, c_1, c_2) at the first instant, wide: the data decide.
    gate_width, gate_share, gate_rounds : float, float, int
        Measurements farther than ``gate_width`` robust standard deviations from their prediction are gross errors and
        are left out, unless they are more than ``gate_share`` of all; the fit and the gate take turns so many times.
    discrete_step_s : float
        Step of the discrete parameters (17) that are reported.
    """

    max_iterations: int = 80
    decrement: float = 1e-5
    starts: int = 2
    entries: int = 3
    coarse_instants: int = 600
    coarse_iterations: int = 25
    sigma_low: tuple[float, ...] = (1e-7, 1e-4, 1e-5, 1e-7, 1e-6)
    sigma_high: tuple[float, ...] = (1.0, 10.0, 10.0, 0.5, 1.0)
    initial_std: tuple[float, ...] = (2.0, 0.2, 0.1, 0.2, 2.0, 2.0)
    gate_width: float = 5.0
    gate_share: float = 0.1
    gate_rounds: int = 5
    discrete_step_s: float = 1.0


@dataclass(frozen=True, eq=False)
class _Search:
    theta: Float
    log_likelihood: float
    score: Float
    information: Float
    converged: bool
    reason: str
    iterations: tuple[dict[str, Any], ...]


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: MaximumLikelihoodSettings) -> Estimate:
    """Estimate hull parameters and noise levels from one segment.

    Parameters
    ----------
    record : Record
    spec : ModelSpec
        Disturbance model.
    arm_per_m : float
        l of eq. (16), 1/m.
    settings : MaximumLikelihoodSettings

    Returns
    -------
    Estimate
        ``converged`` is False, with the reason in ``report``, where the search did not end at a maximum.
    """
    active = np.ones(N_THETA, dtype=np.bool_)
    active[6:] = (spec.wind != "none", spec.current != "none", *record.used)
    coarse = _Problem(thinned(record, settings.coarse_instants), spec, arm_per_m, settings, active)
    entries = sorted(starting_points(record), key=lambda start: -coarse.value(start[1]))[: settings.entries]
    race = [(name, coarse.search(theta, settings.coarse_iterations)) for name, theta in entries]
    race.sort(key=lambda entry: -entry[1].log_likelihood)
    problem = _Problem(record, spec, arm_per_m, settings, active)
    searches = [(name, problem.search(s.theta, settings.max_iterations)) for name, s in _distinct(race, settings)]
    if not any(np.isfinite(search.log_likelihood) for _, search in searches):
        # the race ran into ships that the whole record excludes: from the starting points themselves, then
        searches = [(name, problem.search(theta, settings.max_iterations)) for name, theta in entries]
    name, best = max(searches, key=lambda entry: entry[1].log_likelihood)
    if not np.isfinite(best.log_likelihood):
        raise _no_ship(_summary(searches))
    taken_out: dict[str, int] = {}
    heavy: tuple[str, ...] = ()
    for number in range(settings.gate_rounds):
        innovation, variance, _ = problem.trace(best.theta)
        # wide gates first: a jump that the filter took in makes its sound neighbours look wrong
        width = settings.gate_width * 2.0 ** max(0, 2 - number)
        gated = gate(problem.record, innovation, variance, width, settings.gate_share)
        heavy = gated.heavy
        if not gated.taken_out:
            continue
        taken_out = {
            key: taken_out.get(key, 0) + gated.taken_out.get(key, 0) for key in {**taken_out, **gated.taken_out}
        }
        problem = _Problem(gated.record, spec, arm_per_m, settings, active)
        best = problem.search(best.theta, settings.max_iterations)
    return _report(problem, name, best, {"starts": _summary(searches), "race": _summary(race)}, taken_out, heavy)


def _no_ship(searches: list[dict[str, Any]]) -> DataRejected:
    return DataRejected(
        "no_ship_explains_it",
        f"None of {len(searches)} starting ships gives these data a finite likelihood: the motion is not that of "
        "a ship under this rudder.",
        "Look at the channels over the segment (heading, yaw rate, speed, rudder); shorten or repeat the manoeuvre.",
        {"searches": searches},
    )


def _distinct(race: list[tuple[str, _Search]], settings: MaximumLikelihoodSettings) -> list[tuple[str, _Search]]:
    """Return the best entries of the race that ended on different hills and are not out of reach of the best one."""
    best = race[0][1]
    chosen = [race[0]]
    for name, search in race[1:]:
        gap = best.log_likelihood - search.log_likelihood
        same = any(abs(other.log_likelihood - search.log_likelihood) < _SAME_HILL for _, other in chosen)
        if not same and gap < _OUT_OF_REACH and len(chosen) < settings.starts:
            chosen.append((name, search))
    return chosen


class _Problem:
    """The likelihood of one record, bound once so that the search only passes theta."""

    def __init__(
        self, record: Record, spec: ModelSpec, arm: float, settings: MaximumLikelihoodSettings, active: Mask
    ) -> None:
        self.record, self.settings, self.active = record, settings, active
        x0 = np.zeros(N_STATE)
        if spec.current == "earth":
            current_row = np.column_stack([-np.sin(record.heading_rad), np.cos(record.heading_rad)])
        else:
            current_row = np.tile([1.0, 0.0], (record.time_s.size, 1))
        std = np.array(settings.initial_std)
        std[2] *= spec.wind != "none"
        std[4:] *= spec.current != "none"
        P0 = np.diag(std**2)
        self._fixed = (
            *(record.time_s, record.speed_m_s, record.rudder_rad, record.measured, current_row),
            *(arm, spec.wind_correlation_rate_per_s, spec.current_correlation_rate_per_s, x0, P0),
        )
        self.low = np.concatenate([np.full(6, -np.inf), np.log(settings.sigma_low)])
        self.high = np.concatenate([np.full(6, np.inf), np.log(settings.sigma_high)])
        # a disturbance that the specification leaves out has no intensity at all
        absent = np.flatnonzero(~active[6:8]) + 6
        self.low[absent], self.high[absent] = _NOTHING, _NOTHING

    def value(self, theta: Float) -> float:
        """Log-likelihood alone."""
        return float(likelihood(theta, np.zeros(N_THETA, dtype=np.bool_), *self._fixed, *no_trace())[0])

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        """Log-likelihood, score and information."""
        value, score, information = likelihood(theta, self.active, *self._fixed, *no_trace())
        return float(value), score, information

    def trace(self, theta: Float) -> tuple[Float, Float, Float]:
        """Innovations (n, 3), their variances (n, 3) and filtered states (n, 6)."""
        n = self.record.time_s.size
        innovation, variance, states = np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full((n, N_STATE), np.nan)
        likelihood(theta, np.zeros(N_THETA, dtype=np.bool_), *self._fixed, innovation, variance, states)
        return innovation, variance, states

    def answers_per_s(self, theta: Float) -> float:
        """Rate at which the ship of these parameters answers at her largest speed, 1/s; the kernel's own measure."""
        a11, a12, a21, a22 = theta[:4]
        rate = abs(a11) + abs(a22) + np.sqrt(abs(a12 * a21))
        return float(rate * np.max(np.abs(self.record.speed_m_s)))

    def free(self, theta: Float, score: Float) -> Mask:
        """Parameters that may move: active and not pressed against a bound."""
        at_low, at_high = theta <= self.low, theta >= self.high
        pressed: Mask = (at_low & (score < 0)) | (at_high & (score > 0))
        return self.active & ~pressed

    def search(self, start: Float, max_iterations: int) -> _Search:
        """Climb from one start: damped Fisher scoring far away, BFGS from the Fisher information near the top.

        Where the model lacks something the expected information is not the curvature, and scoring alone creeps.
        """
        theta = np.clip(start, self.low, self.high)
        value, score, information = self.full(theta)
        if not np.isfinite(value):
            reason = "the start has no likelihood"
            return _Search(theta, -np.inf, score, information, converged=False, reason=reason, iterations=())
        curvature, damping, scale = information, 1e-3, np.abs(theta[:6])
        converged, reason = False, "the iterations allowed ran out"
        iterations = [_iteration(0, theta, value, np.nan, damping)]
        for count in range(1, max_iterations + 1):
            free = self.free(theta, score)
            gain = newton_decrement(score, curvature, free)
            if gain < self.settings.decrement:
                converged, reason = True, "the log-likelihood still to be gained is below the limit"
                break
            step, damping = self._rising_step(theta, value, score, curvature, free, damping, scale)
            if step is None:
                converged, reason = gain < 1e-3, "no step raises the log-likelihood any more"
                break
            before, theta = score, theta + step
            value, score, information = self.full(theta)
            curvature = information if gain > _NEAR else bfgs(curvature, step, before - score, free)
            iterations.append(_iteration(count, theta, value, gain, damping))
        return _Search(theta, value, score, information, converged, reason, tuple(iterations))

    @staticmethod
    def _bounded(step: Float, theta: Float, scale: Float) -> Float:
        """Shorten a step that would at once double a hull parameter or leave the scale of the start.

        Far from the maximum the quadratic model sends the ship into regions where she answers absurdly fast.
        """
        reach = np.maximum(np.abs(theta[:6]), scale)
        bounded = step * min(1.0, 1.0 / float(np.max(np.abs(step[:6]) / reach) + 1e-300))
        bounded[6:] = np.clip(step[6:], -1.0, 1.0)
        return bounded

    def _rising_step(
        self, theta: Float, value: float, score: Float, curvature: Float, free: Mask, damping: float, scale: Float
    ) -> tuple[Float | None, float]:
        """Return a step that raises the log-likelihood and the damping for the next one; None where none is found."""
        while damping < 1e9:
            step = self._bounded(damped_step(score, curvature, free, damping), theta, scale)
            candidate = np.clip(theta + step, self.low, self.high)
            if self.value(candidate) > value:
                return candidate - theta, damping / 10.0 if damping > 1e-9 else 0.0
            damping = max(10.0 * damping, 1e-6)
        return None, damping


def _largest(vector: Float, names: list[str]) -> dict[str, float]:
    """Return the three largest components of a direction by name."""
    return {names[i]: float(vector[i]) for i in np.argsort(-np.abs(vector), kind="stable")[:3]}


def _summary(searches: list[tuple[str, _Search]]) -> list[dict[str, Any]]:
    return [{"start": n, "log_likelihood": s.log_likelihood, "converged": s.converged} for n, s in searches]


def _iteration(count: int, theta: Float, value: float, gain: float, damping: float) -> dict[str, Any]:
    parameters = dict(zip(HULL_PARAMETERS, (float(t) for t in theta[:6]), strict=True))
    sigmas = dict(zip(NOISE_PARAMETERS, (float(np.exp(t)) for t in theta[6:]), strict=True))
    return {
        "iteration": count,
        "log_likelihood": value,
        "expected_gain": None if np.isnan(gain) else gain,
        "damping": damping,
        **parameters,
        **sigmas,
    }


def _uncertainty(information: Float, index: NDArray[np.intp]) -> tuple[Float, Float, list[dict[str, Any]]]:
    """Invert the information of the free parameters.

    Returns
    -------
    covariance : ndarray, shape (11, 11)
        NaN for parameters that are not free, and everywhere where the information is singular.
    eigenvalues : ndarray, shape (n_free,)
        Of the information scaled to a unit diagonal, ascending.
    weak : list of dict
        Directions that the data hardly determine.
    """
    names = [*HULL_PARAMETERS, *NOISE_PARAMETERS]
    block = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    correlation = block / np.outer(scale, scale)
    eigenvalues, directions = np.linalg.eigh(correlation)
    covariance = np.full((N_THETA, N_THETA), np.nan)
    if eigenvalues[0] > 1e-12:
        covariance[np.ix_(index, index)] = np.linalg.inv(correlation) / np.outer(scale, scale)
    weak = [
        {"eigenvalue": float(value), "direction": _largest(vector, [names[i] for i in index])}
        for value, vector in zip(eigenvalues, directions.T, strict=True)
        if value < 1e-4
    ]
    return covariance, eigenvalues, weak


def _report(
    problem: _Problem,
    name: str,
    best: _Search,
    starts: dict[str, Any],
    taken_out: dict[str, int],
    heavy: tuple[str, ...],
) -> Estimate:
    record, settings = problem.record, problem.settings
    names = [*HULL_PARAMETERS, *NOISE_PARAMETERS]
    free = problem.free(best.theta, best.score)
    index = np.flatnonzero(free)
    covariance, eigenvalues, weak = _uncertainty(best.information, index)
    bounds = [names[i] for i in np.flatnonzero(problem.active & ~free)]
    if problem.answers_per_s(best.theta) > 0.95 * FASTEST_PER_S:
        bounds.append(f"answers faster than {FASTEST_PER_S:g} per second")
    hull_covariance = covariance[:6, :6]
    warnings = list(record.warnings)
    warnings += [f"{count} gross errors of {key} left out" for key, count in taken_out.items()]
    warnings += [
        f"many prediction errors of {key} are far too large: not gross errors, the model fails" for key in heavy
    ]
    if not best.converged:
        warnings.append(f"not converged: {best.reason}")
    if bounds:
        warnings.append(f"at a bound, not estimated: {', '.join(bounds)}")
    if any(best.theta[i] <= problem.low[i] for i in (8, 9, 10) if problem.active[i]):
        warnings.append(
            "the measurements are smoother than this model can be: its wind and current states explain what the hull "
            "should; for a tank, or still water and no wind, identify with a model without them (docs/models/tank.yaml)"
        )
    if problem.answers_per_s(best.theta) * record.rudder_period_s > _RUDDER_TOO_SLOW:
        warnings.append(
            f"the rudder is read every {record.rudder_period_s:.2g} s, too seldom for a ship that answers so fast: "
            "what it did in between is not known, and the standard errors do not say so; log the rudder faster"
        )
    if weak:
        warnings.append("some directions of the parameters are hardly determined by these data, see the report")
    sigma = np.exp(best.theta[6:])
    noise = tuple(
        Value(key, float(sigma[i]), float(sigma[i] * np.sqrt(covariance[6 + i, 6 + i])), unit)
        for i, (key, unit) in enumerate(NOISE_PARAMETERS.items())
        if problem.active[6 + i]
    )
    innovation, variance, _ = problem.trace(best.theta)
    fit = one_step_fit(record, innovation, variance)
    return Estimate(
        estimator="ml",
        parameters=hull_values(best.theta[:6], hull_covariance),
        discrete=discrete_values(best.theta[:6], hull_covariance, record.mean_speed_m_s, settings.discrete_step_s),
        covariance=hull_covariance,
        noise=noise,
        converged=best.converged,
        report={
            "converged": best.converged,
            "reason": best.reason,
            "iterations": len(best.iterations) - 1,
            "speed_m_s": record.mean_speed_m_s,
            "step_s": settings.discrete_step_s,
            "log_likelihood": best.log_likelihood,
            "condition": float(eigenvalues[-1] / max(eigenvalues[0], 1e-300)),
            "active_bounds": bounds,
            "weak_directions": weak,
            "start": name,
            "gross_errors": taken_out,
            **starts,
        },
        iterations=best.iterations,
        fit=fit,
        warnings=(*warnings, *doubts(best.theta[:6], np.sqrt(np.diag(hull_covariance)), fit)),
    )
