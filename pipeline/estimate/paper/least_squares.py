"""The first approximation, eqs. (11)-(14): disturbances taken as zero, the previous measurement as the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.plausibility import plausibility_warnings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.sampled import Sampled, sample
from kempf.pipeline.estimate.result import Estimate, Value, hull_values
from kempf.pipeline.model.ship import Hull, continuous_from_discrete


@dataclass(frozen=True)
class LeastSquaresSettings:
    """Settings of the first approximation."""

    #: Step of eq. (17), s; None takes the GNSS period.
    step_s: float | None = None


@dataclass(frozen=True, eq=False)
class Regression:
    """Solution of eq. (14)."""

    #: Shape (n_state, n_state).
    A: Float
    #: Shape (n_state, n_input).
    B: Float
    #: Shape (n_state, n_state + n_input). Standard errors of [A B] as least squares sees them, blind to the noise in
    #: the regressors.
    std: Float
    #: Shape (n_state (n_state + n_input), n_state (n_state + n_input)). Covariance of the rows of [A B] one after the
    #: other.
    covariance: Float
    #: Of the regressor matrix; below n_state + n_input the minimum-norm solution stands.
    rank: int


def regress(states: Float, inputs: Float, targets: Float) -> Regression:
    """Solve [A B] = YN Z0' (Z0 Z0')^-1, eq. (14), minimum norm where Z0 Z0' is singular.

    Parameters
    ----------
    states : ndarray, shape (n, n_state)
        State before each step.
    inputs : ndarray, shape (n, n_input)
        Input over each step.
    targets : ndarray, shape (n, n_state)
        State after each step.
    """
    regressors = np.column_stack([states, inputs])
    # Columns differ by orders of magnitude (m/s against rad/s): scaled, the rank decision is about directions.
    scale = np.maximum(np.linalg.norm(regressors, axis=0), 1e-300)
    left, singular, right = np.linalg.svd(regressors / scale, full_matrices=False)
    rank = int(np.count_nonzero(singular > 1e-10 * singular[0]))
    inverted = right[:rank].T / singular[:rank] / scale[:, None]
    solution = inverted @ (left[:, :rank].T @ targets)
    # What the data do not determine is taken out in the units of [A B] itself, whose norm eq. (14) makes least.
    undetermined = np.linalg.qr(right[rank:].T / scale[:, None] * np.min(scale))[0]
    solution -= undetermined @ (undetermined.T @ solution)
    residual = targets - regressors @ solution
    degrees = max(1, targets.shape[0] - regressors.shape[1])
    covariance = np.kron(residual.T @ residual / degrees, inverted @ inverted.T)
    n_state = states.shape[1]
    std = np.sqrt(np.diag(covariance)).reshape(n_state, -1)
    return Regression(solution[:n_state].T, solution[n_state:].T, std, covariance, rank)


def identify(record: Record, settings: LeastSquaresSettings) -> Estimate:
    """Estimate eq. (17) by one regression on the measurements.

    It is an errors-in-variables estimator without a remedy: measurement noise biases it towards zero and its standard
    errors do not show that. Kept as the paper's first approximation and as a rival.
    """
    sampled = sample(record, settings.step_s)
    now, after = whole_pairs(sampled)
    regression = regress(sampled.measured[now], sampled.rudder[now, None], sampled.measured[after])
    return estimate_from_discrete("least-squares", sampled, regression, record.warnings, converged=True)


def whole_pairs(sampled: Sampled) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices k and k + 1 of all steps with no gap, each shape (n_pairs,)."""
    whole = np.all(np.isfinite(sampled.measured), axis=1)
    now = np.flatnonzero(whole[:-1] & whole[1:])
    return now, now + 1


def estimate_from_discrete(
    name: str,
    sampled: Sampled,
    regression: Regression,
    warnings: tuple[str, ...],
    *,
    converged: bool,
    reason: str = "a regression has a closed form",
    iterations: tuple[dict[str, object], ...] = (),
) -> Estimate:
    """Turn matrices of eq. (17) into an `Estimate` with the parameters of eq. (16) at the mean speed."""
    caveats = list(warnings)
    hull = continuous_from_discrete(regression.A, regression.B, sampled.speed_m_s, sampled.step_s)
    if regression.rank < 3:
        caveats.append(f"the regressor matrix is singular (rank {regression.rank} of 3): minimum-norm solution")
    if hull is None:
        caveats.append("the discrete matrices belong to no continuous ship: an eigenvalue is not positive")
    caveats.append("standard errors leave out the bias that noise in the regressors causes")
    values = hull.array() if hull is not None else np.full(6, np.nan)
    covariance = _continuous_covariance(regression, hull, sampled) if hull is not None else np.full((6, 6), np.nan)
    if hull is not None:
        caveats += plausibility_warnings(values, np.sqrt(np.diag(covariance)), {})
    names = ("A11", "A12", "A21", "A22", "B1", "B2")
    units = ("1", "m/rad", "rad/m", "1", "m/s/rad", "1/s")
    flat = np.concatenate([regression.A.ravel(), regression.B.ravel()])
    std = np.concatenate([regression.std[:, :2].ravel(), regression.std[:, 2]])
    return Estimate(
        estimator=name,
        parameters=hull_values(values, covariance),
        discrete=tuple(Value(n, float(f), float(s), u) for n, f, s, u in zip(names, flat, std, units, strict=True)),
        covariance=covariance,
        noise=(),
        converged=converged and hull is not None,
        report={
            "converged": converged and hull is not None,
            "reason": reason,
            "rank": regression.rank,
            "step_s": sampled.step_s,
            "speed_m_s": sampled.speed_m_s,
            "iterations": max(0, len(iterations) - 1),
        },
        iterations=iterations,
        fit={},
        warnings=tuple(caveats),
    )


def _continuous_covariance(regression: Regression, hull: Hull, sampled: Sampled) -> Float:
    """Carry the discrete standard errors to continuous time, first order, central differences, shape (6, 6)."""
    flat = np.concatenate([regression.A.ravel(), regression.B.ravel()])
    order = [0, 1, 3, 4, 2, 5]  # from the rows of [A B] to A11, A12, A21, A22, B1, B2
    of_flat = regression.covariance[np.ix_(order, order)]
    jacobian = np.empty((6, 6))
    for i in range(6):
        step = 1e-6 * max(abs(flat[i]), 1e-6)
        sides = []
        for sign in (1.0, -1.0):
            moved = flat.copy()
            moved[i] += sign * step
            neighbour = continuous_from_discrete(
                moved[:4].reshape(2, 2), moved[4:].reshape(2, 1), sampled.speed_m_s, sampled.step_s
            )
            sides.append((neighbour or hull).array())
        jacobian[:, i] = (sides[0] - sides[1]) / (2.0 * step)
    covariance: Float = jacobian @ of_flat @ jacobian.T
    return covariance
