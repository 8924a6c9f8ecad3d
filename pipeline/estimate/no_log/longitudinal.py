"""The longitudinal model: speed through the water with its approach to the engine's speed and its loss in turns.

    dV/dt = (V_0 - V) / T - k r^2 + w

V_0 is the speed at which resistance and thrust balance on a straight course, T the time in which the ship finds it, k
the loss by turning (drift and centrifugal force, both of which grow with r^2 in a zigzag: Norrbin (1971), "Theory and
observations on the use of a mathematical model for ship manoeuvring in deep and confined waters", SSPA publication 68),
w a white acceleration for what is not modelled. V, V_0 and k enter linearly and are states: only T and the noise levels
are left as parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float

#: rows and columns of the states: V, m/s; V_0, m/s; k, m; integral of V, m
SPEED, SETTLED, LOSS, PATH = 0, 1, 2, 3
N_LONGITUDINAL = 4


@dataclass(frozen=True)
class Surge:
    """What the states do not hold of the longitudinal model."""

    #: T, s.
    time_constant_s: float
    #: Root of the intensity of w: what it lets V wander in a second.
    wander_m_s_per_root_s: float


def discretise_surge(surge: Surge, step_s: Float, squared_rate: Float) -> tuple[Float, Float]:
    """Return the exact step of (V, V_0, k, integral of V) for a yaw rate held over the step.

    Parameters
    ----------
    step_s : ndarray, shape (n,)
        Steps, s.
    squared_rate : ndarray, shape (n,)
        r^2 over the step, rad^2/s^2.

    Returns
    -------
    Phi : ndarray, shape (n, 4, 4)
    Q : ndarray, shape (n, 4, 4)

    Examples
    --------
    >>> Phi, _ = discretise_surge(Surge(100.0, 0.0), np.array([1e4]), np.array([1e-4]))
    >>> Phi[0, SPEED].round(9).tolist()  # settled: V = V_0 - k r^2 T
    [0.0, 1.0, -0.01, 0.0]
    """
    T, h = surge.time_constant_s, np.asarray(step_s, dtype=np.float64)
    gone = -np.expm1(-h / T)
    # integral of the response to a unit of V_0: h - T (1 - e^{-h/T}), whose difference cancels for short steps
    x = h / T
    area = np.where(x < 1e-3, 0.5 * h * x * (1.0 - x / 3.0), h - T * gone)
    Phi = np.tile(np.eye(N_LONGITUDINAL), (h.size, 1, 1))
    Phi[:, SPEED, SPEED] = 1.0 - gone
    Phi[:, SPEED, SETTLED] = gone
    Phi[:, SPEED, LOSS] = -T * gone * squared_rate
    Phi[:, PATH, SPEED] = T * gone
    Phi[:, PATH, SETTLED] = area
    Phi[:, PATH, LOSS] = -T * area * squared_rate
    intensity = surge.wander_m_s_per_root_s**2
    twice = -np.expm1(-2.0 * x)
    series = h**3 / 3.0 * (1.0 - 0.75 * x)
    Q = np.zeros((h.size, N_LONGITUDINAL, N_LONGITUDINAL))
    Q[:, SPEED, SPEED] = intensity * 0.5 * T * twice
    Q[:, SPEED, PATH] = Q[:, PATH, SPEED] = intensity * 0.5 * (T * gone) ** 2
    exact = T**2 * (h - 2.0 * T * gone + 0.5 * T * twice)
    Q[:, PATH, PATH] = intensity * np.where(x < 1e-3, series, exact)
    return Phi, Q
