"""The filter of eqs. (3)-(5) in its one-step-predictor form, for any linear time-invariant model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float


@dataclass(frozen=True, eq=False)
class Filtered:
    """What the filter gives."""

    #: Shape (n, n_state). x^[k], the state before the measurement at k.
    predicted: Float
    #: Shape (n, n_state). The state after it.
    updated: Float
    #: Shape (n, n_measurement). eps[k] = Y[k] - H x^[k]; NaN where nothing was measured.
    innovation: Float


def run_filter(
    A: Float, B: Float, G: Float, H: Float, R: Float, Y: Float, u: Float, initial_mean: Float, initial_covariance: Float
) -> Filtered:
    """Run eqs. (3)-(5) over a record.

    ::

        x^[k+1] = A x^[k] + B u[k] + K[k] (Y[k] - H x^[k])
        K[k]    = A P[k] H' (H P[k] H' + R)^-1
        P[k+1]  = A P[k] A' + G G' - A P[k] H' (H P[k] H' + R)^-1 H P[k] A'

    A row of Y that holds a NaN is bridged by prediction.

    Parameters
    ----------
    A : ndarray, shape (n_state, n_state)
    B : ndarray, shape (n_state, n_input)
    G : ndarray, shape (n_state, n_noise)
    H : ndarray, shape (n_measurement, n_state)
    R : ndarray, shape (n_measurement, n_measurement)
    Y : ndarray, shape (n, n_measurement)
    u : ndarray, shape (n, n_input)
    initial_mean : ndarray, shape (n_state,)
    initial_covariance : ndarray, shape (n_state, n_state)
    """
    n, n_state = Y.shape[0], A.shape[0]
    predicted, updated = np.empty((n, n_state)), np.empty((n, n_state))
    innovation = np.full(Y.shape, np.nan)
    x, P, Q = initial_mean.astype(np.float64), initial_covariance.astype(np.float64), G @ G.T
    measured = np.all(np.isfinite(Y), axis=1)
    for k in range(n):
        predicted[k] = x
        if measured[k]:
            PHt = P @ H.T
            gain = np.linalg.solve(H @ PHt + R, PHt.T).T
            innovation[k] = Y[k] - H @ x
            x = x + gain @ innovation[k]
            P = P - gain @ PHt.T
        updated[k] = x
        x = A @ x + B @ u[k]
        P = A @ P @ A.T + Q
        P = 0.5 * (P + P.T)
    return Filtered(predicted, updated, innovation)
