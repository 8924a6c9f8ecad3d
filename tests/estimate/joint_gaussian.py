"""The likelihood by brute force: the joint normal density of all measurements of a record at once.

Nothing of `pipeline` is used: matrix exponentials by `scipy.linalg.expm`, process noise and input by Van Loan's block
matrices, the density by one Cholesky factor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, expm

Float = NDArray[np.float64]
#: largest |A| h that the filter crosses in one step; the joint density takes none
LONGEST_STEP = 0.5
#: here states are (v, r, F, M, psi, c_1, c_2, b, e); where each of the kernel's, (v, r, psi, F, M, e, c_1, c_2, b), is
ORDER = [0, 1, 4, 2, 3, 8, 5, 6, 7]


@dataclass(frozen=True, eq=False)
class Case:
    """The arguments of the likelihood, by name."""

    theta: Float
    time_s: Float
    speed: Float
    rudder: Float
    rudder_noise: Float
    error_gain: Float
    measured: Float
    current_row: Float
    arm: float
    wind_rate: float
    moment_rate: float
    current_rate: float
    error_rate: float
    x0: Float
    P0: Float

    def arguments(self) -> tuple[Any, ...]:
        """In the order of the kernel, after theta and derivatives."""
        inputs = (self.time_s, self.speed, self.rudder, self.rudder_noise, self.error_gain, self.measured)
        taken = np.zeros(self.time_s.size, dtype=np.bool_)
        return (
            *inputs,
            taken,
            self.current_row,
            self.arm,
            self.wind_rate,
            self.moment_rate,
            self.current_rate,
            self.error_rate,
            LONGEST_STEP,
            self.x0[ORDER],
            self.P0[np.ix_(ORDER, ORDER)],
        )


def step(case: Case, theta: Float, k: int) -> tuple[Float, Float, Float]:
    """Transition (9, 9), input (9,) and process noise (9, 9) from instant k - 1 to k."""
    a11, a12, a21, a22, b1, b2 = theta[:6]
    dt = case.time_s[k] - case.time_s[k - 1]
    V = 0.5 * (case.speed[k] + case.speed[k - 1])
    A = np.zeros((8, 8))
    A[0, :3] = a11 * V, a12 * V, 1.0
    A[1, :4] = a21 * V, a22 * V, case.arm, 1.0
    A[2, 2], A[3, 3], A[4, 1] = -case.wind_rate, -case.moment_rate, 1.0
    A[5, 5] = A[6, 6] = -case.current_rate
    B = np.zeros(8)
    B[:2] = b1 * V**2, b2 * V**2
    rates = np.array([case.wind_rate, case.moment_rate, case.current_rate])
    q_F, q_M, q_V = 2.0 * rates * np.exp(2.0 * theta[6:9])
    intensity = np.diag([0.0, 0.0, q_F, q_M, 0.0, q_V, q_V, 0.0])
    if dt == 0.0:
        return np.eye(9), np.zeros(9), np.zeros((9, 9))
    block = np.zeros((16, 16))
    block[:8, :8], block[:8, 8:], block[8:, 8:] = -A, intensity, A.T
    exponential = expm(block * dt)
    Phi = exponential[8:, 8:].T
    Q = Phi @ exponential[:8, 8:]

    # the rudder turns evenly from one instant to the next
    level, slope = held_input(A, B, dt)
    g = level * case.rudder[k - 1] + slope * (case.rudder[k] - case.rudder[k - 1]) / dt
    # the errors of rudder and speed are constant over each of the steps that the kernel takes
    size = V * (abs(a11) + abs(a22) + np.sqrt(abs(a12 * a21))) + max(case.wind_rate, case.moment_rate)
    steps = max(1, int(np.ceil(size * dt / 0.5)))
    short = dt / steps
    held, _ = held_input(A, B, short)
    through = expm(A * short)
    decay = np.exp(-case.error_rate * short)
    once, shaken = np.zeros((9, 9)), np.zeros((9, 9))
    once[:8, :8], once[8, 8] = through, decay
    once[:8, 8] = 0.5 * (case.error_gain[k] + case.error_gain[k - 1]) * held
    shaken[:8, :8] = case.rudder_noise[k] ** 2 / short * np.outer(held, held)
    shaken[8, 8] = case.P0[8, 8] * (1.0 - decay**2)
    noise = np.zeros((9, 9))
    for _ in range(steps):
        noise = once @ noise @ once.T + shaken
    noise[:8, :8] += 0.5 * (Q + Q.T)
    whole = np.linalg.matrix_power(once, steps)
    whole[:8, :8] = Phi
    return whole, np.append(g, 0.0), noise


def held_input(A: Float, B: Float, dt: float) -> tuple[Float, Float]:
    """What an input of one, and one that grows by one a second from nothing, do to the state over an interval."""
    n = B.size
    block = np.zeros((n + 2, n + 2))
    block[:n, :n], block[:n, n], block[n, n + 1] = A, B, 1.0
    exponential = expm(block * dt)
    return exponential[:n, n], exponential[:n, n + 1]


def moments(case: Case, theta: Float) -> tuple[Float, Float, Float, Float]:
    """Mean and covariance of all measured values in order of time, then of (last state, all measured values).

    Returns
    -------
    mean : ndarray, shape (m,)
    covariance : ndarray, shape (m, m)
    last_mean : ndarray, shape (9,)
    cross : ndarray, shape (9, m)
        Covariance of the last state with the measured values.
    """
    n = case.time_s.size
    means, covariance = np.zeros((n, 9)), np.zeros((n, n, 9, 9))
    means[0], covariance[0, 0] = case.x0, case.P0
    for k in range(1, n):
        Phi, g, Q = step(case, theta, k)
        means[k] = Phi @ means[k - 1] + g
        for j in range(k):
            covariance[k, j] = Phi @ covariance[k - 1, j]
            covariance[j, k] = covariance[k, j].T
        covariance[k, k] = Phi @ covariance[k - 1, k - 1] @ Phi.T + Q
    which = [(k, c) for k in range(n) for c in range(3) if np.isfinite(case.measured[k, c])]
    H = np.zeros((len(which), n * 9))
    for row, (k, c) in enumerate(which):
        H[row, 9 * k + (0, 1, 4)[c]] = 1.0
        if c == 0:
            H[row, 9 * k + 5 : 9 * k + 7] = case.current_row[k]
        if c == 1:
            H[row, 9 * k + 7] = 1.0
    noise = np.exp(2.0 * theta[9:])[[c for _, c in which]]
    stacked = covariance.transpose(0, 2, 1, 3).reshape(9 * n, 9 * n)
    return H @ means.ravel(), H @ stacked @ H.T + np.diag(noise), means[-1], stacked[-9:] @ H.T


def values(case: Case) -> Float:
    """All measured values in the order of `moments`."""
    result: Float = case.measured[np.isfinite(case.measured)]
    return result


def log_density(case: Case, theta: Float) -> float:
    """Log of the joint normal density of all measured values."""
    mean, covariance, _, _ = moments(case, theta)
    error = values(case) - mean
    factor = cho_factor(covariance, lower=True)
    logdet = 2.0 * np.sum(np.log(np.diag(factor[0])))
    return float(-0.5 * (error @ cho_solve(factor, error) + logdet + error.size * np.log(2 * np.pi)))


def fisher(case: Case, theta: Float) -> Float:
    """Exact expected information of all 12 parameters, by central differences of the moments, shape (12, 12)."""
    _, covariance, _, _ = moments(case, theta)
    factor = cho_factor(covariance, lower=True)
    dm, dC = [], []
    for j in range(theta.size):
        h = 1e-5 * max(abs(theta[j]), 1e-7)
        up, down = theta.copy(), theta.copy()
        up[j] += h
        down[j] -= h
        m_up, C_up, _, _ = moments(case, up)
        m_down, C_down, _, _ = moments(case, down)
        dm.append((m_up - m_down) / (2 * h))
        dC.append(cho_solve(factor, (C_up - C_down) / (2 * h)))
    weighted = [cho_solve(factor, m) for m in dm]
    return np.array(
        [
            [a @ wb + 0.5 * np.sum(Ca * Cb.T) for wb, Cb in zip(weighted, dC, strict=True)]
            for a, Ca in zip(dm, dC, strict=True)
        ]
    )


def make_case(
    *,
    n: int = 24,
    seed: int = 0,
    current: str = "earth",
    prime: tuple[float, ...] = (-0.8, -0.36, -3.6, -2.4, -0.17, 1.5),
    length_m: float = 100.0,
    speed_m_s: float = 7.0,
    mean_interval_s: float = 2.0,
    arm: float = 0.01,
    same_instant: bool = True,
    rudder_noise: float = 0.02,
    error_gain: float = 0.1,
) -> Case:
    """Draw a record from the model: irregular instants, two shared, values missing at random, varying speed and rudder.

    ``prime`` are the six parameters made dimensionless with length and speed.
    """
    random = np.random.default_rng(seed)
    L = length_m
    hull = np.array(prime) / np.array([L, 1.0, L**2, L, L, L**2])
    theta = np.concatenate([hull, np.log([2e-3, 2e-5, 0.15, 0.05, 5e-4, 1e-3])])
    gaps = random.exponential(mean_interval_s, n - 1) + 0.01
    if same_instant:
        gaps[n // 3] = 0.0
    time = np.concatenate([[0.0], np.cumsum(gaps)])
    heading = 0.4 + 0.35 * np.sin(0.05 * time)
    row = np.column_stack([-np.sin(heading), np.cos(heading)]) if current == "earth" else np.tile([1.0, 0.0], (n, 1))
    measured = np.zeros((n, 3))
    measured[random.random((n, 3)) < 0.35] = np.nan
    measured[n // 2] = np.nan
    spread = random.standard_normal((9, 9))
    scale = np.array([0.5, 0.02, 0.01, 1e-4, 0.1, 0.3, 0.3, 2e-3, 0.1])
    P0 = np.outer(scale, scale) * (0.2 * spread @ spread.T + np.eye(9))
    case = Case(
        theta,
        time,
        speed_m_s * (1.0 + 0.1 * np.sin(0.11 * time)),
        0.35 * np.sign(np.sin(0.13 * time)) + 0.02 * random.standard_normal(n),
        rudder_noise * (1.0 + 0.5 * np.sin(time)),
        error_gain * np.cos(0.2 * time),
        measured,
        row,
        arm,
        1 / 300.0,
        1 / 90.0,
        1 / 1800.0,
        1 / 15.0,
        scale * random.standard_normal(9),
        P0,
    )
    mean, covariance, _, _ = moments(case, theta)
    measured[np.isfinite(measured)] = mean + np.linalg.cholesky(covariance) @ random.standard_normal(mean.size)
    return replace(case, measured=measured)
