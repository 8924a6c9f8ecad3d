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

from pipeline.simulate.compiled import compiled
from pipeline.simulate.random_streams import stream

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
    """What happened and what was measured.

    Attributes
    ----------
    time_s : ndarray, shape (n,)
    state : ndarray, shape (n, 4)
        Columns `DEPTH_STATE`: m/s, rad/s, rad, m.
    planes : ndarray, shape (n,)
        Mean plane angle of the step that follows, rad.
    measured : ndarray, shape (n, 4)
        The state with gyro bias and noise.
    A : ndarray, shape (4, 4)
        Of d(state)/dt = A state + B planes, 1/s.
    B : ndarray, shape (4, 1)
    """

    time_s: Float
    state: Float
    planes: Float
    measured: Float
    A: Float
    B: Float


def sail_depth(settings: DepthChannel) -> DepthRecord:
    """Sail the vertical zigzag.

    Parameters
    ----------
    settings : DepthChannel

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
    state, planes = np.zeros((n, 4)), np.zeros(n)
    limits = np.array([s.planes_rad, s.pitch_rad, s.plane_rate_rad_s])
    _sail(A, B, load, limits, s.step_s / s.substeps, s.substeps, state, planes)
    noise = stream(s.seed, "depth channel").standard_normal((n, 4)) * np.array(s.noise)
    measured = state + noise
    measured[:, 1] += s.gyro_bias_rad_s
    return DepthRecord(np.arange(n, dtype=np.float64) * s.step_s, state, planes, measured, A, B[:, None])


@compiled
def _sail(
    A: Float, B: Float, load: Float, limits: Float, step_s: float, substeps: int, state: Float, planes: Float
) -> None:
    """Fill ``state`` and ``planes`` by fourth-order Runge-Kutta; the order goes over at the end of a small step."""
    size, pitch, rate = limits
    x, angle, side = np.zeros(4), 0.0, 1.0
    for k in range(planes.size):
        state[k] = x
        total = 0.0
        for _ in range(substeps):
            # positive planes push the nose down
            if side * x[2] <= -pitch:
                side = -side
            moved = min(max(side * size - angle, -rate * step_s), rate * step_s)
            middle, end = angle + 0.5 * moved, angle + moved
            k1 = A @ x + B * angle + load
            k2 = A @ (x + 0.5 * step_s * k1) + B * middle + load
            k3 = A @ (x + 0.5 * step_s * k2) + B * middle + load
            k4 = A @ (x + step_s * k3) + B * end + load
            x = x + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            angle = end
            total += middle
        planes[k] = total / substeps
