"""From the end of a search to an estimate: standard errors, bounds, weak directions, and what speaks against it."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.linear_kernel import (
    BIAS,
    C1,
    C2,
    FASTEST_PER_S,
    LOG_F,
    LOG_M,
    LOG_MEASUREMENT,
    LOG_V,
)
from kempf.pipeline.estimate.likelihood import Likelihood, Trace
from kempf.pipeline.estimate.one_step_fit import one_step_fit
from kempf.pipeline.estimate.plausibility import not_white, plausibility_warnings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate, Value, discrete_values, hull_values
from kempf.pipeline.estimate.search.climb import Pass, Search, free
from kempf.pipeline.estimate.uncertainty import from_information, sandwich
from kempf.pipeline.model.chain import F, M
from kempf.pipeline.model.disturbances import change_within
from kempf.schemas.model_spec import HULL_PARAMETERS, N_HULL, NOISE_PARAMETERS, ModelSpec

#: rate at which the ship answers times the rudder's period, above which its samples leave too much open
_RUDDER_TOO_SLOW = 0.3
#: a bias of the rate gyro is reported when it is so many standard errors from nothing
_BIASED = 4.0
#: with less than so many of her slowest time constants in a record, errors of the slow motion are not those of a bound
_FEW_TIMES = 5.0
#: relative standard error from which on a weak direction is reported
_VAGUE = 0.1
#: time within which the changes of the disturbances are reported
_CHANGE_S = 600.0
_NAMES = (*HULL_PARAMETERS, *NOISE_PARAMETERS)


def report(
    record: Record,
    objective: Likelihood,
    best: Search[Float],
    trace: Trace,
    discrete_step_s: float,
    details: dict[str, Any],
    heavy: tuple[str, ...],
) -> Estimate:
    """Turn the end of a search into an estimate.

    Parameters
    ----------
    record : Record
        What the segment was cut to.
    objective : Likelihood
        What was climbed at last, gross errors taken out.
    trace : Trace
        Of the filter at its end.
    discrete_step_s : float
        Step of eq. (17).
    details : dict
        Joins the report; holds ``gross_errors``, counts by measurement.
    heavy : tuple of str
        Measurements with too many large prediction errors for these to be gross errors.

    Returns
    -------
    Estimate
        Standard errors are the Cramer-Rao bound where the prediction errors are white, else those of the sandwich.
    """
    theta = best.theta
    movable = free(objective, theta, best.score)
    index = np.flatnonzero(movable)
    uncertainty = from_information(best.information, index)
    fit = one_step_fit(objective.record.measured, trace.innovation, trace.variance)
    covariance, kind, widened = uncertainty.covariance, "information", 1.0
    if not_white(fit):
        scores = objective.trace(theta, scores=True).scores.sum(axis=1)
        robust = sandwich(uncertainty.covariance, scores, objective.record.time_s)
        ratio = np.sqrt(np.diag(robust)[:6] / np.diag(uncertainty.covariance)[:6])
        if np.nanmax(ratio, initial=0.0) > 1.0:
            covariance, kind, widened = robust, "sandwich", float(np.nanmax(ratio))
    bounds = [_NAMES[i] for i in np.flatnonzero(objective.active & ~movable)]
    if objective.answers_per_s(theta) > 0.95 * FASTEST_PER_S:
        bounds.append(f"answers faster than {FASTEST_PER_S:g} per second")
    hull_covariance = covariance[:6, :6]
    sigma = np.exp(theta[6:])
    noise = tuple(
        Value(key, float(sigma[i]), _std_of_level(objective, best, covariance, 6 + i), unit)
        for i, (key, unit) in enumerate(NOISE_PARAMETERS.items())
        if objective.active[6 + i]
    )
    ends = _at_the_end(objective, trace)
    warnings = _warnings(record, objective, best, details["gross_errors"], heavy, bounds, ends)
    names = [_NAMES[i] for i in index]
    # as shares of the hull parameters; those of the logarithms are shares already
    scale = np.concatenate([np.abs(theta[:N_HULL]), np.ones(theta.size - N_HULL)])
    off = dict(zip(names, (np.sqrt(np.diag(covariance)) / scale)[index], strict=True))
    warnings += _vague(uncertainty.weak, names, off)
    speed = record.mean_speed_m_s
    return Estimate(
        estimator="ml",
        parameters=hull_values(theta[:6], hull_covariance),
        discrete=discrete_values(theta[:6], hull_covariance, speed, discrete_step_s),
        covariance=hull_covariance,
        noise=noise,
        converged=best.converged,
        report={
            "converged": best.converged,
            "reason": best.reason,
            "iterations": len(best.passes) - 1,
            "speed_m_s": speed,
            "step_s": discrete_step_s,
            "log_likelihood": best.log_likelihood,
            "condition": uncertainty.condition,
            "active_bounds": bounds,
            "weak_directions": [
                {"eigenvalue": value, "direction": _largest(vector, names)} for value, vector in uncertainty.weak
            ],
            "standard_errors": kind,
            "widened": widened,
            "at_the_end": ends,
            "changes": _changes(noise, objective.spec),
            **details,
        },
        iterations=tuple(_iteration(count, step) for count, step in enumerate(best.passes)),
        fit=fit,
        warnings=(*warnings, *plausibility_warnings(theta[:6], np.sqrt(np.diag(hull_covariance)), fit)),
    )


def _warnings(
    record: Record,
    objective: Likelihood,
    best: Search[Float],
    taken_out: dict[str, int],
    heavy: tuple[str, ...],
    bounds: list[str],
    ends: dict[str, dict[str, Any]],
) -> list[str]:
    theta = best.theta
    warnings = list(record.warnings)
    warnings += [f"{count} gross errors of {key} left out" for key, count in taken_out.items()]
    warnings += [
        f"many prediction errors of {key} are far too large: not gross errors, the model fails" for key in heavy
    ]
    if not best.converged:
        warnings.append(f"not converged: {best.reason}")
    # a disturbance that does not change within the record is no fault of it
    unchanging = {_NAMES[i] for i in (LOG_F, LOG_M, LOG_V) if theta[i] <= objective.low[i]}
    if pressed := [name for name in bounds if name not in unchanging]:
        warnings.append(f"at a bound, not estimated: {', '.join(pressed)}")
    levels = range(LOG_MEASUREMENT, theta.size)
    if any(theta[i] <= objective.low[i] for i in levels if objective.active[i]):
        warnings.append(
            "the measurements are smoother than this model can be: its wind and current states explain what the hull "
            "should; for a tank, or still water and no wind, identify with a model without them (docs/models/tank.yaml)"
        )
    if objective.answers_per_s(theta) * record.rudder_period_s > _RUDDER_TOO_SLOW:
        warnings.append(
            f"the rudder is read every {record.rudder_period_s:.2g} s, too seldom for a ship that answers so fast: "
            "what it did in between is not known, and the standard errors do not say so; log the rudder faster"
        )
    slowest, lasts = slowest_s(theta[:N_HULL], record.mean_speed_m_s), float(record.time_s[-1])
    if lasts < _FEW_TIMES * slowest:
        warnings.append(
            f"the record lasts {lasts:.0f} s, {lasts / slowest:.1f} times the {slowest:.0f} s in which her slowest "
            f"motion dies or grows; from less than {_FEW_TIMES:g} times standard errors are rough: sail longer, or "
            "pool several"
        )
    bias = ends.get("rate_bias")
    if bias is not None and abs(bias["value"]) > _BIASED * bias["std"]:
        shown = np.rad2deg([bias["value"], bias["std"]])
        warnings.append(
            f"the rate gyro reads {shown[0]:+.3f} ± {shown[1]:.3f} deg/s (1 s.e.) beside the heading's rate of change; "
            "allowed for in the estimate"
        )
    return warnings


def _std_of_level(objective: Likelihood, best: Search[Float], covariance: Float, i: int) -> float:
    """Return the standard error of a noise level; of a disturbance at its lower bound, how large it could still be.

    Near nothing the log-likelihood goes with sigma^2, whose variance is 4 sigma^4 over the information on log sigma; a
    level whose square is as large as the standard deviation of that is what the data would not have noticed.
    """
    sigma, J = float(np.exp(best.theta[i])), float(best.information[i, i])
    if i in (LOG_F, LOG_M, LOG_V) and best.theta[i] <= objective.low[i] and J > 0.0:
        return float(np.sqrt(2.0 * sigma**2 / np.sqrt(J)))
    return float(sigma * np.sqrt(covariance[i, i]))


def _vague(weak: tuple[tuple[float, Float], ...], names: list[str], off: dict[str, float]) -> list[str]:
    """Tell the weak directions in which some relative standard error ``off`` is large: others are known well enough."""
    directions = [(value, list(_largest(vector, names))) for value, vector in weak]
    return [
        f"these data hardly determine a direction of the parameters ({', '.join(largest)}; eigenvalue {value:.1g} of "
        "1): sail a zigzag of other angles, or pool several"
        for value, largest in directions
        if not max(off[name] for name in largest) <= _VAGUE
    ]


def slowest_s(hull: Float, speed_m_s: float) -> float:
    """Return the slowest time constant of a ship, s, at a speed; of an unstable one that in which she leaves.

    Parameters
    ----------
    hull : ndarray, shape (6,)
    """
    rates = speed_m_s * np.linalg.eigvals(hull[:4].reshape(2, 2)).real
    return float(1.0 / max(np.min(np.abs(rates)), 1e-12))


def _changes(noise: tuple[Value, ...], spec: ModelSpec) -> dict[str, dict[str, Any]]:
    """Return by how much the disturbances change within `_CHANGE_S`: of those that forget slowly all a record shows."""
    rates = {
        "sigma_F": spec.wind_correlation_rate_per_s,
        "sigma_M": spec.moment_correlation_rate_per_s,
        "sigma_V": spec.current_correlation_rate_per_s,
    }
    per_level = {name: change_within(1.0, _CHANGE_S, rate) for name, rate in rates.items()}
    return {
        level.name: {
            "value": per_level[level.name] * level.value,
            "std": None if np.isnan(level.std) else per_level[level.name] * level.std,
            "unit": level.unit,
            "within_s": _CHANGE_S,
        }
        for level in noise
        if level.name in rates
    }


def _at_the_end(objective: Likelihood, trace: Trace) -> dict[str, dict[str, Any]]:
    """Return disturbances and bias as the filter has them at the last instant, the constant ones from all data."""
    earth = objective.spec.current == "earth"
    named = {
        "wind_force": (F, "m/s^2"),
        "yaw_acceleration": (M, "rad/s^2"),
        "current_north" if earth else "current_lateral": (C1, "m/s"),
        "current_east": (C2, "m/s"),
        "rate_bias": (BIAS, "rad/s"),
    }
    return {
        name: {"value": float(trace.states[-1, i]), "std": float(np.sqrt(trace.spread[-1, i])), "unit": unit}
        for name, (i, unit) in named.items()
        if trace.spread[-1, i] > 0.0
    }


def _largest(vector: Float, names: list[str]) -> dict[str, float]:
    """Return the three largest components of a direction by name."""
    return {names[i]: float(vector[i]) for i in np.argsort(-np.abs(vector), kind="stable")[:3]}


def _iteration(count: int, step: Pass) -> dict[str, Any]:
    parameters = dict(zip(HULL_PARAMETERS, (float(t) for t in step.theta[:6]), strict=True))
    sigmas = dict(zip(NOISE_PARAMETERS, (float(np.exp(t)) for t in step.theta[6:]), strict=True))
    gain = None if np.isnan(step.expected_gain) else step.expected_gain
    entry = {"iteration": count, "log_likelihood": step.log_likelihood, "expected_gain": gain, "damping": step.damping}
    return {**entry, **parameters, **sigmas}
