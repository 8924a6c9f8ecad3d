"""Exact steps of the lateral model (16), all steps of a record at once.

The chain is (v, r, psi, F, M): eq. (16) with the heading, the wind force F, and a yaw acceleration M beside its moment
l F. The speed is held over a step, the rudder moves linearly. The likelihood has its own compiled steps with their
derivatives; this is for what is done a few times with parameters that are known already.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.chain import CHAIN, N_CHAIN
from kempf.pipeline.model.ship import Hull

SWAY, YAW, HEADING, FORCE, MOMENT = CHAIN
#: Taylor terms; 1 / 19! is below the last bit of a double for |A| h up to 1
_ORDER = 18
_SETTLED = 1e-18
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class SlowForces:
    """The disturbances of the chain: standard deviations and correlation rates of its Gauss-Markov processes."""

    #: l of eq. (16), 1/m.
    arm_per_m: float
    #: force_m_s2, force_rate_per_s: sigma_F and mu_F.
    force_m_s2: float
    force_rate_per_s: float
    #: moment_rad_s2, moment_rate_per_s: The same of M.
    moment_rad_s2: float
    moment_rate_per_s: float


def lateral_steps(
    hull: Hull, forces: SlowForces, step_s: Float, speed_m_s: Float, rudder_rad: Float
) -> tuple[Float, Float, Float]:
    """Return the exact discrete chain for every step.

    Parameters
    ----------
    step_s, speed_m_s : ndarray, shape (n,)
        Length of each step, s, and speed through the water over it, m/s.
    rudder_rad : ndarray, shape (n, 2)
        Rudder at the beginning and at the end of each step.

    Returns
    -------
    Phi : ndarray, shape (n, 5, 5)
    g : ndarray, shape (n, 5)
        What the rudder adds.
    Q : ndarray, shape (n, 5, 5)
        Process noise.
    """
    A, B = _chain(hull, forces, speed_m_s)
    parts = max(1, int(np.ceil(float(np.max(_size_per_s(hull, forces, speed_m_s) * step_s, initial=0.0)))))
    part_s = step_s / parts
    h = part_s[:, None, None]
    step = _exponential_times(A * h, np.tile(np.eye(N_CHAIN), (step_s.size, 1, 1)))
    # the convolutions over a part by Gauss-Legendre quadrature over the time left until its end
    left = 0.5 * (1.0 + _NODES)
    responses = [_exponential_times(A * (share * h), B) for share in left]
    noise = sum(
        0.5 * weight * h * (x[:, :, 1:] @ x[:, :, 1:].transpose(0, 2, 1))
        for x, weight in zip(responses, _WEIGHTS, strict=True)
    )
    Phi = np.tile(np.eye(N_CHAIN), (step_s.size, 1, 1))
    g, Q = np.zeros((step_s.size, N_CHAIN)), np.zeros_like(Phi)
    slope = (rudder_rad[:, 1] - rudder_rad[:, 0]) / parts
    for part in range(parts):
        end = rudder_rad[:, 0] + (part + 1) * slope
        g = (step @ g[:, :, None])[:, :, 0]
        for share, weight, response in zip(left, _WEIGHTS, responses, strict=True):
            g += (0.5 * weight * part_s * (end - share * slope))[:, None] * response[:, :, 0]
        Q = step @ Q @ step.transpose(0, 2, 1) + noise
        Phi = step @ Phi
    return Phi, g, Q


def _size_per_s(hull: Hull, forces: SlowForces, speed_m_s: Float) -> Float:
    """Return a norm of the chain's matrix that no choice of units changes, 1/s."""
    own = abs(hull.a11) + abs(hull.a22) + float(np.sqrt(abs(hull.a12 * hull.a21)))
    size: Float = speed_m_s * own + max(forces.force_rate_per_s, forces.moment_rate_per_s)
    return size


def _chain(hull: Hull, forces: SlowForces, V: Float) -> tuple[Float, Float]:
    """Return the continuous chain, shape (n, 5, 5), and how rudder and the forces' white noise enter, (n, 5, 3)."""
    A, B = np.zeros((V.size, N_CHAIN, N_CHAIN)), np.zeros((V.size, N_CHAIN, 3))
    A[:, SWAY, SWAY], A[:, SWAY, YAW], A[:, SWAY, FORCE] = hull.a11 * V, hull.a12 * V, 1.0
    A[:, YAW, SWAY], A[:, YAW, YAW] = hull.a21 * V, hull.a22 * V
    A[:, YAW, FORCE], A[:, YAW, MOMENT] = forces.arm_per_m, 1.0
    A[:, FORCE, FORCE], A[:, MOMENT, MOMENT] = -forces.force_rate_per_s, -forces.moment_rate_per_s
    A[:, HEADING, YAW] = 1.0
    B[:, SWAY, 0], B[:, YAW, 0] = hull.b1 * V**2, hull.b2 * V**2
    B[:, FORCE, 1] = forces.force_m_s2 * np.sqrt(2.0 * forces.force_rate_per_s)
    B[:, MOMENT, 2] = forces.moment_rad_s2 * np.sqrt(2.0 * forces.moment_rate_per_s)
    return A, B


def _exponential_times(A: Float, X: Float) -> Float:
    """Return e^A X by its Taylor series, shape of X."""
    total, term = X.copy(), X
    for k in range(1, _ORDER + 1):
        term = (A @ term) / k
        total += term
        if float(np.max(np.abs(term), initial=0.0)) < _SETTLED:
            break
    return total
