"""Whether a law holds another ship than the one it was made for: closed-loop poles, margins, share of ships held.

The loop is linear: eq. (16) with the heading, the estimator, the law; the rudder follows its order at once and within
its limits. Reference: Astrom and Murray, "Feedback Systems" (2nd ed. 2021), ch. 10 and 13 for the margins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.course_keeping import N_SHIP, N_STATE, Law

_FREQUENCIES = 2000


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A law on a ship.

    Attributes
    ----------
    poles : ndarray of complex128, shape (8,)
        Of the loop over a step, the largest modulus first.
    stable : bool
        All of them inside the unit circle.
    slowest_s : float
        Time constant of the slowest pole, s; infinite where the loop is not stable.
    least_damping : float
        Smallest damping ratio of the poles.
    modulus_margin : float
        Least distance of the loop's frequency response from -1; its inverse is the largest sensitivity. 0 where the
        loop is not stable. A textbook loop has 0.5 or more.
    """

    poles: NDArray[np.complex128]
    stable: bool
    slowest_s: float
    least_damping: float
    modulus_margin: float


def loop_matrices(law: Law, ships: Float, speed_m_s: float) -> Float:
    """Return the matrix of the loop over one step for each of some ships.

    Parameters
    ----------
    law : Law
    ships : ndarray, shape (n, 6)
        Parameters of the ships that it steers.
    speed_m_s : float

    Returns
    -------
    ndarray, shape (n, 8, 8)
        On ship (v, r, psi) and estimate before the measurement (5).
    """
    A, B = _sampled(ships, speed_m_s, law.step_s)
    Am, Bm, H, L, k = law.plant.A, law.plant.B, law.plant.measured, law.observer, law.feedback[None, :]
    corrected = np.eye(N_STATE) - L @ H
    n = N_SHIP + N_STATE
    M = np.zeros((ships.shape[0], n, n))
    # the instruments show v, r, psi themselves, no disturbance acts
    M[:, :N_SHIP, :N_SHIP] = A - B @ (k @ L)
    M[:, :N_SHIP, N_SHIP:] = -B @ (k @ corrected)
    M[:, N_SHIP:, :N_SHIP] = (Am - Bm @ k) @ L
    M[:, N_SHIP:, N_SHIP:] = (Am - Bm @ k) @ corrected
    return M


def _sampled(ships: Float, V: float, step_s: float) -> tuple[Float, Float]:
    """Sample eq. (16) with the heading for each ship, shapes (n, 3, 3) and (n, 3, 1)."""
    block = np.zeros((ships.shape[0], N_SHIP + 1, N_SHIP + 1))
    block[:, :2, :2] = V * ships[:, :4].reshape(-1, 2, 2)
    block[:, :2, 3] = V**2 * ships[:, 4:]
    block[:, 2, 1] = 1.0
    both = expm(block * step_s)
    return both[:, :N_SHIP, :N_SHIP], both[:, :N_SHIP, N_SHIP:]


def closed_loop(law: Law, hull: Hull, speed_m_s: float) -> ClosedLoop:
    """Return poles and margins of a law on a ship.

    Parameters
    ----------
    law : Law
    hull : Hull
        The ship that it steers, which need not be the one it was made for.
    speed_m_s : float
    """
    poles = np.linalg.eigvals(loop_matrices(law, hull.array()[None, :], speed_m_s)[0]).astype(np.complex128)
    poles = poles[np.argsort(-np.abs(poles), kind="stable")]
    stable = bool(np.abs(poles[0]) < 1.0)
    rates = np.log(np.maximum(np.abs(poles), 1e-300)) + 1j * np.angle(poles)
    damping = -np.real(rates) / np.maximum(np.abs(rates), 1e-300)
    slowest = -law.step_s / float(np.real(rates[0])) if stable else float("inf")
    margin = _modulus_margin(law, hull, speed_m_s) if stable else 0.0
    return ClosedLoop(poles, stable, slowest, float(np.min(damping)), margin)


def _modulus_margin(law: Law, hull: Hull, speed_m_s: float) -> float:
    """Break the loop where the rudder meets the ship; the estimator is told what the law ordered."""
    (ship_A,), (ship_B,) = _sampled(hull.array()[None, :], speed_m_s, law.step_s)
    Am, Bm, H, L, k = law.plant.A, law.plant.B, law.plant.measured, law.observer, law.feedback[None, :]
    corrected = np.eye(N_STATE) - L @ H
    # states: ship, estimate; input: the ship's rudder; output: minus the law's order
    n = N_SHIP + N_STATE
    A = np.zeros((n, n))
    A[:N_SHIP, :N_SHIP] = ship_A
    A[N_SHIP:, :N_SHIP] = (Am - Bm @ k) @ L
    A[N_SHIP:, N_SHIP:] = (Am - Bm @ k) @ corrected
    B = np.vstack([ship_B, np.zeros_like(Bm)])
    C = np.hstack([k @ L, k @ corrected])
    z = np.exp(1j * np.geomspace(1e-4, np.pi, _FREQUENCIES))
    response = C @ np.linalg.solve(z[:, None, None] * np.eye(n) - A, np.broadcast_to(B, (z.size, n, 1)))
    return float(np.min(np.abs(1.0 + response[:, 0, 0])))


def share_held(law: Law, hull: Hull, covariance: Float, speed_m_s: float, *, draws: int = 400, seed: int = 0) -> float:
    """Return the share of the ships that the data allow which the law keeps stable; NaN without a covariance.

    Parameters
    ----------
    law : Law
    hull : Hull
        Estimate.
    covariance : ndarray, shape (6, 6)
        Of the estimate; ships are drawn from the normal distribution.
    speed_m_s : float
    draws : int, optional
        How many.
    seed : int, optional
        Of the draws.
    """
    if not np.all(np.isfinite(covariance)):
        return float("nan")
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    normal = np.random.default_rng(seed).standard_normal((draws, 6))
    ships = hull.array() + normal @ (vectors * np.sqrt(np.maximum(values, 0.0))).T * scale
    largest = np.max(np.abs(np.linalg.eigvals(loop_matrices(law, ships, speed_m_s))), axis=1)
    return float(np.mean(largest < 1.0))
