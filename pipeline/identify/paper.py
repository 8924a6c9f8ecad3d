"""The paper's procedure, eqs. (11)-(15), for the ship of eq. (17), with every iteration recorded.

The first approximation by least squares; a filter that estimates states and disturbances with it; measurements and
dynamics corrected by the estimated disturbances; least squares again, and so on. It regresses on noisy measurements and
need not converge: that is reported, not hidden.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.identify.estimate import Estimate
from pipeline.identify.least_squares import Regression, estimate_from_discrete, regress, whole_pairs
from pipeline.identify.record import Record
from pipeline.identify.sampled import Sampled, sample
from pipeline.model.filter import Filtered, run_filter
from pipeline.model.ship import continuous_from_discrete
from pipeline.normalise.series import Float
from schemas.model_spec import HULL_PARAMETERS, ModelSpec


@dataclass(frozen=True)
class PaperSettings:
    """Settings of the procedure.

    Attributes
    ----------
    iterations : int
        The paper shows 25.
    step_s : float or None
        Step of eq. (17), s; None takes the GNSS period.
    force_std_m_s2, current_std_m_s : float
        sigma_F and sigma_V of eq. (16); the paper's simulated trial has a force of 5e-3 m/s^2 and a current of 0.3 m/s.
    tolerance : float
        Converged when no element of [A B] changes by more than this share of the largest in its row.
    """

    iterations: int = 25
    step_s: float | None = None
    force_std_m_s2: float = 5e-3
    current_std_m_s: float = 0.3
    tolerance: float = 1e-4


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: PaperSettings) -> Estimate:
    """Run the procedure on one segment.

    Parameters
    ----------
    record : Record
    spec : ModelSpec
        Correlation rates of the disturbances.
    arm_per_m : float
        l of eq. (16), 1/m.
    settings : PaperSettings

    Returns
    -------
    Estimate
        ``report["reason"]`` says converged, cycling, diverged or still moving; ``iterations`` holds [A B], the
        continuous parameters and the mean disturbances of every pass, the first approximation as number 0.
    """
    sampled = sample(record, settings.step_s)
    now, after = whole_pairs(sampled)
    u = sampled.rudder[:, None]
    found = regress(sampled.measured[now], u[now], sampled.measured[after])
    history = [found]
    log = [_entry(0, found, sampled, None)]
    reason, converged = "the iterations ran out while the parameters still moved", False
    for count in range(1, settings.iterations + 1):
        filtered = _disturbances(sampled, found, spec, arm_per_m, record.noise_start, settings)
        if filtered is None or not np.all(np.isfinite(filtered.updated)):
            reason = f"diverged in iteration {count}: the filter built from the last parameters does not exist"
            break
        force, current = filtered.updated[:, 2], filtered.updated[:, 3]
        enters = _force_enters(found, sampled, arm_per_m)
        corrected = sampled.measured - np.outer(current, [1.0, 0.0])  # (15)
        target = corrected[after] - np.outer(force[now], enters)
        found = regress(corrected[now], u[now], target)
        history.append(found)
        log.append(_entry(count, found, sampled, filtered))
        if np.max(np.abs(np.linalg.eigvals(found.A))) > 1e3 or not np.all(np.isfinite(found.A)):
            reason = f"diverged in iteration {count}"
            break
        change = _change(history[-1], history[-2])
        if change < settings.tolerance:
            reason, converged = f"converged: the last pass changed [A B] by {change:.1e}", True
            break
    else:
        reason = _verdict(history, reason)
    return estimate_from_discrete(
        "paper", sampled, found, record.warnings, converged=converged, reason=reason, iterations=tuple(log)
    )


def _force_enters(found: Regression, sampled: Sampled, arm: float) -> Float:
    """Return how a force held over a step enters (v, r), shape (2,), for small steps dt [1, l]."""
    A, dt = found.A, sampled.step_s
    direction = np.array([1.0, arm])
    # Trapezoid of e^{A_c s} [1, l] over the step, from the discrete matrix alone: no logarithm is needed.
    result: Float = 0.5 * dt * (direction + A @ direction)
    return result


def _disturbances(
    sampled: Sampled, found: Regression, spec: ModelSpec, arm: float, noise: Float, settings: PaperSettings
) -> Filtered | None:
    """Step 2: the filter (3)-(5) over states (v, r, F, V_T) with the last parameters."""
    dt = sampled.step_s
    decay_F = np.exp(-spec.wind_correlation_rate_per_s * dt)
    decay_V = np.exp(-spec.current_correlation_rate_per_s * dt)
    A = np.zeros((4, 4))
    A[:2, :2], A[:2, 2] = found.A, _force_enters(found, sampled, arm)
    A[2, 2], A[3, 3] = decay_F, decay_V
    B = np.vstack([found.B, np.zeros((2, 1))])
    G = np.zeros((4, 2))
    G[2, 0] = settings.force_std_m_s2 * np.sqrt(1.0 - decay_F**2)
    G[3, 1] = settings.current_std_m_s * np.sqrt(1.0 - decay_V**2)
    H = np.array([[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]])
    yaw_noise = noise[1] if np.isfinite(noise[1]) else noise[2] / dt
    R = np.diag([max(noise[0], 1e-6) ** 2, max(yaw_noise, 1e-8) ** 2])
    P0 = np.diag([1.0, 0.01, settings.force_std_m_s2**2, settings.current_std_m_s**2])
    try:
        return run_filter(A, B, G, H, R, sampled.measured, sampled.rudder[:, None], np.zeros(4), P0)
    except np.linalg.LinAlgError:
        return None


def _stacked(found: Regression) -> Float:
    return np.hstack([found.A, found.B])


def _change(one: Regression, other: Regression) -> float:
    new, old = _stacked(one), _stacked(other)
    return float(np.max(np.abs(new - old) / np.max(np.abs(new), axis=1, keepdims=True)))


def _verdict(history: list[Regression], reason: str) -> str:
    """Name a cycle: the last pass returns to an earlier one much more closely than to its predecessor."""
    last = _change(history[-1], history[-2])
    for period in range(2, min(7, len(history))):
        if _change(history[-1], history[-1 - period]) < 0.05 * last:
            return f"cycling with period {period}: the passes repeat without settling"
    return f"{reason}, by {last:.1e} in the last one"


def _entry(count: int, found: Regression, sampled: Sampled, filtered: Filtered | None) -> dict[str, object]:
    hull = continuous_from_discrete(found.A, found.B, sampled.speed_m_s, sampled.step_s)
    values = [None] * 6 if hull is None else [float(x) for x in hull.array()]
    return {
        "iteration": count,
        "A": [[float(x) for x in row] for row in found.A],
        "B": [float(x) for x in found.B[:, 0]],
        **dict(zip(HULL_PARAMETERS, values, strict=True)),
        "mean_force_m_s2": None if filtered is None else float(np.mean(filtered.updated[:, 2])),
        "mean_current_m_s": None if filtered is None else float(np.mean(filtered.updated[:, 3])),
    }
