"""What must have acted on the ship beside a model for a run to come out as measured: force and moment, smoothed.

About the model's free run, which carries every effect, the ship departs little, and by the linear part of eq. (16); her
departures, measured less free run, are smoothed with the disturbances that drive them
(`pipeline.estimate.filters.smoother`).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.filters.smoother import LinearSystem, smooth
from kempf.pipeline.estimate.likelihood import INITIAL_STD
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.chain import CHAIN
from kempf.pipeline.predict.free_run import FreeRun

_V, _R, _PSI, _F, _M, _C1, _C2, _B = *CHAIN, 5, 6, 7


def smoothed_states(filtered: RunFilter, point: Point, free: FreeRun) -> Float:
    """Return v, r, F and M at every instant given all measurements, shape (n, 4), SI; NaN where the free run diverges.

    Parameters
    ----------
    point : Point
        Its parameters and noise levels.
    free : FreeRun
        Of the same run and model.
    """
    run = filtered.run
    if not np.all(np.isfinite(free.predicted)):
        # no free run to depart from
        return np.full((run.measured.shape[0], 4), np.nan)
    departures = smooth(_departures(filtered, point, free.error)).mean
    force, moment = free.constants[_F], free.constants[_M]
    # the free run's lateral speed and yaw rate would be measured through current and bias
    drift = free.predicted[:, 0] - run.current_row @ free.constants[[_C1, _C2]]
    turn = free.predicted[:, 1] - free.constants[_B]
    return np.column_stack(
        [drift + departures[:, _V], turn + departures[:, _R], force + departures[:, _F], moment + departures[:, _M]]
    )


def _departures(filtered: RunFilter, point: Point, error: Float) -> LinearSystem:
    """Return the linear system of v, r, psi, F, M, c_1, c_2, b about a free run."""
    run, spec = filtered.run, filtered.spec
    n, V = error.shape[0], run.speed_m_s
    a11, a12, a21, a22, b1, b2 = point.hull
    levels = np.where(filtered.levels_used(), np.exp(point.levels), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    A = np.zeros((n, 8, 8))
    A[:, _V, _V], A[:, _V, _R], A[:, _V, _F] = a11 * V, a12 * V, 1.0
    A[:, _R, _V], A[:, _R, _R], A[:, _R, _F], A[:, _R, _M] = a21 * V, a22 * V, run.ship.arm_per_m, 1.0
    A[:, _PSI, _R] = 1.0
    A[:, _F, _F], A[:, _M, _M] = -spec.wind_correlation_rate_per_s, -spec.moment_correlation_rate_per_s
    A[:, _C1, _C1] = A[:, _C2, _C2] = -spec.current_correlation_rate_per_s
    rudder = np.zeros((n, 8))
    rudder[:, _V], rudder[:, _R] = b1 * V**2 * run.shake, b2 * V**2 * run.shake
    W = rudder[:, :, None] * rudder[:, None, :]
    present = filtered.present()
    for state, level in ((_F, levels[0]), (_M, levels[1]), (_C1, levels[2]), (_C2, levels[2])):
        W[:, state, state] += present[state] * level**2
    Phi, Q = _sampled(A, W, run.step_s)
    H = np.zeros((n, 3, 8))
    H[:, 0, _V], H[:, 0, _C1], H[:, 0, _C2] = 1.0, run.current_row[:, 0], run.current_row[:, 1]
    H[:, 1, _R], H[:, 1, _B], H[:, 2, _PSI] = 1.0, 1.0, 1.0
    R = np.tile(levels[3:] ** 2, (n, 1))
    P0 = np.diag((np.array(INITIAL_STD) * present) ** 2)
    return LinearSystem(Phi, np.zeros((n, 8)), Q, error, H, R, np.zeros(8), P0)


def _sampled(A: Float, W: Float, step_s: float) -> tuple[Float, Float]:
    """Return transitions and noise over a step (Van Loan 1978, IEEE Transactions on Automatic Control 23)."""
    n, size = A.shape[0], A.shape[1]
    block = np.zeros((n, 2 * size, 2 * size))
    block[:, :size, :size], block[:, :size, size:], block[:, size:, size:] = -A, W, A.transpose(0, 2, 1)
    exponential = expm(step_s * block)
    Phi = exponential[:, size:, size:].transpose(0, 2, 1)
    Q = Phi @ exponential[:, :size, size:]
    # in order, as the other systems have it: what is laid out otherwise would be compiled for once more
    return np.ascontiguousarray(Phi), 0.5 * (Q + Q.transpose(0, 2, 1))
