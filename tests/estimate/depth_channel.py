"""The depth channel of an underwater vehicle at constant speed, in continuous time: a second vehicle to identify.

Heave w, pitch rate q, pitch theta and depth z, linear about level flight (the form of T. I. Fossen, Handbook of Marine
Craft Hydrodynamics and Motion Control, 2011, section 8.2, per unit of inertia), steered by the stern planes through a
vertical zigzag: planes over until the pitch reaches its limit, then to the other side. z points down, theta is positive
nose up, positive planes push the nose down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.random_streams import stream

Float = NDArray[np.float64]

#: Columns of the state.
DEPTH_STATE = ("w", "q", "theta", "z")


@dataclass(frozen=True)
class DepthChannel:
    """A vehicle, her manoeuvre, what acts on her and how she is measured; torpedo-shaped, plausible, no real one.

    Parameters
    ----------
    speed_m_s : float
        U.
    zw, zq, zd : float
        dw/dt = zw U w + zq U q + zd U^2 planes + force; 1/m, 1, 1/m.
    mw, mq, mt, md : float
        dq/dt = mw U w + mq U q + mt theta + md U^2 planes + moment; 1/m^2, 1/m, 1/s^2, 1/m^2.
    force_m_s2, moment_rad_s2 : float
        Of a weight that is not trimmed out: constant.
    gyro_bias_rad_s : float
        Constant error of the measured pitch rate.
    planes_rad, pitch_rad : float
        Plane angle, and the pitch at which they go over.
    plane_rate_rad_s : float
        Their rate.
    noise : tuple of float
        Standard deviations of the measurements: m/s, rad/s, rad, m.
    step_s : float
        Between two samples.
    duration_s : float
    substeps : int
        Integrator steps between two samples.
    seed : int
    """

    speed_m_s: float = 1.5
    zw: float = -0.65
    zq: float = 0.35
    zd: float = -0.30
    mw: float = 0.90
    mq: float = -1.20
    mt: float = -0.60
    md: float = -1.60
    force_m_s2: float = 0.01
    moment_rad_s2: float = 0.01
    gyro_bias_rad_s: float = 0.005
    planes_rad: float = 0.15
    pitch_rad: float = 0.15
    plane_rate_rad_s: float = 0.3
    noise: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    step_s: float = 0.05
    duration_s: float = 120.0
    substeps: int = 10
    seed: int = 0


@dataclass(frozen=True, eq=False)
class DepthRecord:
    """What happened and what was measured."""

    #: Shape (n,).
    time_s: Float
    #: Shape (n, 4). Columns `DEPTH_STATE`: m/s, rad/s, rad, m.
    state: Float
    #: Shape (n,). Mean plane angle of the step that follows, rad.
    planes: Float
    #: Shape (n, 4). The state with gyro bias and noise.
    measured: Float
    #: Shape (4, 4). Of d(state)/dt = A state + B planes, 1/s.
    A: Float
    #: Shape (4, 1).
    B: Float


def sail_depth(settings: DepthChannel) -> DepthRecord:
    """Sail the vertical zigzag.

    Examples
    --------
    >>> sailed = sail_depth(DepthChannel(duration_s=20.0))
    >>> sailed.measured.shape
    (400, 4)
    """
    s, U = settings, settings.speed_m_s
    A = np.array(
        [
            [s.zw * U, s.zq * U, 0.0, 0.0],
            [s.mw * U, s.mq * U, s.mt, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [1.0, 0.0, -U, 0.0],
        ]
    )
    B = np.array([s.zd * U**2, s.md * U**2, 0.0, 0.0])
    load = np.array([s.force_m_s2, s.moment_rad_s2, 0.0, 0.0])
    n = round(s.duration_s / s.step_s)
    limits = (s.planes_rad, s.pitch_rad, s.plane_rate_rad_s)
    state, planes = _sail(A, B, load, limits, (s.step_s / s.substeps, s.substeps), n)
    noise = stream(s.seed, "depth channel").standard_normal((n, 4)) * np.array(s.noise)
    measured = state + noise
    measured[:, 1] += s.gyro_bias_rad_s
    return DepthRecord(np.arange(n, dtype=np.float64) * s.step_s, state, planes, measured, A, B[:, None])


def _sail(
    A: Float, B: Float, load: Float, limits: tuple[float, float, float], grid: tuple[float, int], rows: int
) -> tuple[Float, Float]:
    """Return states and planes at the samples; the planes' order goes over at the end of a small step.

    A fourth-order Runge-Kutta step of a linear system, its four slopes multiplied out: with M = h A, x becomes
    (I + M + M^2/2 + M^3/6 + M^4/24) x plus weighted inputs at the step's beginning, middle and end.
    """
    size, pitch, rate = limits
    h, substeps = grid
    E, M = np.eye(4), h * A
    M2, M3 = M @ M, M @ M @ M
    ahead = E + M + M2 / 2.0 + M3 / 6.0 + M @ M3 / 24.0
    begin, middle, end = (h / 6.0 * w for w in (E + M + M2 / 2.0 + M3 / 4.0, 4.0 * E + 2.0 * M + M2 / 2.0, E))
    B0, B1, B2, constant = begin @ B, middle @ B, end @ B, (begin + middle + end) @ load
    state, planes = np.zeros((rows, 4)), np.zeros(rows)
    x, angle, side = np.zeros(4), 0.0, 1.0
    for k in range(rows):
        state[k] = x
        total = 0.0
        for _ in range(substeps):
            # positive planes push the nose down
            if side * x[2] <= -pitch:
                side = -side
            moved = min(max(side * size - angle, -rate * h), rate * h)
            x = ahead @ x + (B0 * angle + B1 * (angle + 0.5 * moved) + B2 * (angle + moved) + constant)
            total += angle + 0.5 * moved
            angle += moved
        planes[k] = total / substeps
    return state, planes
