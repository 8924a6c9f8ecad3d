"""Whether a law holds another ship than the one it was made for: closed-loop poles, margins, share of ships held.

The loop is linear: eq. (16) with the heading and what effects bring, the estimator, the law; the rudder follows its
order at once and within its limits. Reference: Astrom and Murray, "Feedback Systems" (2nd ed. 2021), ch. 10 and 13 for
the margins.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.model.zero_order_hold import zero_order_hold
from kempf.pipeline.steering.course_keeping import Law
from kempf.pipeline.steering.motion import ShipEffects
from kempf.pipeline.steering.state_space import continuous
from kempf.schemas.model_spec import ModelSpec

_FREQUENCIES = 2000
#: what moves the ship alone: no disturbance is in the loop
_STILL = ModelSpec(wind="none", current="none")


@dataclass(frozen=True, eq=False)
class SteeredShips:
    """Ships sampled at a law's step."""

    #: Shape (n, n_ship, n_ship).
    A: Float
    #: Shape (n, n_ship, 1).
    B: Float
    #: Shape (n, 3, n_ship). What the instruments show.
    C: Float


def _steered_ships(law: Law, ships: Float, speed_m_s: float, effects: ShipEffects | None = None) -> SteeredShips:
    """Sample ships at the step of a law."""
    models = []
    for theta in ships:
        own = replace(effects, values=theta[6:]) if effects is not None else None
        models.append(continuous(Hull(*theta[:6].tolist()), _STILL, speed_m_s, effects=own))
    held = zero_order_hold(np.array([model.A for model in models]), np.array([model.B for model in models]), law.step_s)
    return SteeredShips(*held, np.array([model.measured for model in models]))


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A law on a ship."""

    #: Shape (n_ship + n_state,). Of the loop over a step, the largest modulus first.
    poles: NDArray[np.complex128]
    #: All of them inside the unit circle.
    stable: bool
    #: Time constant of the slowest pole, s; infinite where the loop is not stable.
    slowest_s: float
    #: Smallest damping ratio of the poles.
    least_damping: float
    #: Least distance of the loop's frequency response from -1; its inverse is the largest sensitivity. 0 where the loop
    #: is not stable. A textbook loop has 0.5 or more.
    modulus_margin: float


def _loop_matrices(law: Law, ships: SteeredShips) -> Float:
    """Return the matrix of the loop over one step for each of some ships."""
    Am, Bm, L, k = law.plant.A, law.plant.B, law.observer, law.feedback[None, :]
    corrected = np.eye(Am.shape[0]) - L @ law.plant.measured
    A, B, C = ships.A, ships.B, ships.C
    n = A.shape[1]
    M = np.zeros((A.shape[0], n + Am.shape[0], n + Am.shape[0]))
    # the instruments show what the ship does, no disturbance acts
    M[:, :n, :n] = A - B @ (k @ L @ C)
    M[:, :n, n:] = -B @ (k @ corrected)
    M[:, n:, :n] = (Am - Bm @ k) @ L @ C
    M[:, n:, n:] = (Am - Bm @ k) @ corrected
    return M


def closed_loop(law: Law, hull: Hull, speed_m_s: float, effects: ShipEffects | None = None) -> ClosedLoop:
    """Return poles and margins of a law on a ship.

    Parameters
    ----------
    hull : Hull
        The ship that it steers, which need not be the one it was made for.
    effects : ShipEffects, optional
        Of the ship that it steers.
    """
    theta = np.concatenate([hull.array(), effects.values if effects is not None else np.zeros(0)])
    ship = _steered_ships(law, theta[None, :], speed_m_s, effects)
    poles = np.linalg.eigvals(_loop_matrices(law, ship)[0]).astype(np.complex128)
    poles = poles[np.argsort(-np.abs(poles), kind="stable")]
    stable = bool(np.abs(poles[0]) < 1.0)
    rates = np.log(np.maximum(np.abs(poles), 1e-300)) + 1j * np.angle(poles)
    damping = -np.real(rates) / np.maximum(np.abs(rates), 1e-300)
    slowest = -law.step_s / float(np.real(rates[0])) if stable else float("inf")
    margin = _modulus_margin(law, ship) if stable else 0.0
    return ClosedLoop(poles, stable, slowest, float(np.min(damping)), margin)


def _modulus_margin(law: Law, ship: SteeredShips) -> float:
    """Break the loop where the rudder meets the ship; the estimator knows what the law ordered."""
    (ship_A,), (ship_B,), (ship_C,) = ship.A, ship.B, ship.C
    Am, Bm, L, k = law.plant.A, law.plant.B, law.observer, law.feedback[None, :]
    corrected = np.eye(Am.shape[0]) - L @ law.plant.measured
    # states: ship, estimate; input: the ship's rudder; output: minus the law's order
    n_ship, n = ship_A.shape[0], ship_A.shape[0] + Am.shape[0]
    A = np.zeros((n, n))
    A[:n_ship, :n_ship] = ship_A
    A[n_ship:, :n_ship] = (Am - Bm @ k) @ L @ ship_C
    A[n_ship:, n_ship:] = (Am - Bm @ k) @ corrected
    B = np.vstack([ship_B, np.zeros_like(Bm)])
    C = np.hstack([k @ L @ ship_C, k @ corrected])
    z = np.exp(1j * np.geomspace(1e-4, np.pi, _FREQUENCIES))
    response = C @ np.linalg.solve(z[:, None, None] * np.eye(n) - A, np.broadcast_to(B, (z.size, n, 1)))
    return float(np.min(np.abs(1.0 + response[:, 0, 0])))


def share_held(
    law: Law,
    hull: Hull,
    covariance: Float,
    speed_m_s: float,
    *,
    effects: ShipEffects | None = None,
    draws: int = 400,
) -> float:
    """Return the share of the ships that the data allow which the law keeps stable; NaN without a covariance.

    Parameters
    ----------
    hull : Hull
        Estimate.
    covariance : ndarray, shape (6 + p, 6 + p)
        Of the estimate with the effects; ships are drawn from the normal distribution, within the effects' bounds.
    effects : ShipEffects, optional
        Of the estimate.
    draws : int, optional
        How many; always the same ones.
    """
    if not np.all(np.isfinite(covariance)):
        return float("nan")
    centre = np.concatenate([hull.array(), effects.values if effects is not None else np.zeros(0)])
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    normal = np.random.default_rng(0).standard_normal((draws, centre.size))
    ships = centre + normal @ (vectors * np.sqrt(np.maximum(values, 0.0))).T * scale
    if effects is not None:
        # a lag of nothing has no state: what is there stays there, and what is not stays away
        low = np.where(effects.model.low == 0.0, 0.01 * effects.values, effects.model.low)
        drawn = np.clip(ships[:, 6:], low, effects.model.high)
        ships[:, 6:] = np.where(effects.values == 0.0, 0.0, drawn)
    steered_ships = _steered_ships(law, ships, speed_m_s, effects)
    largest = np.max(np.abs(np.linalg.eigvals(_loop_matrices(law, steered_ships))), axis=1)
    return float(np.mean(largest < 1.0))
