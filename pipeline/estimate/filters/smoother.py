"""Kalman filter and fixed-interval smoother for any linear time-varying Gaussian model, compiled.

Measurements are taken in one scalar after the other. The smoother is the one of Bryson and Frazier in the form of
de Jong (1989), "Smoothing and interpolation with the state-space model", J. Am. Stat. Assoc. 84: it inverts nothing, so
states without process noise and states that are known exactly are allowed. The filter of eqs. (3)-(5) for a
time-invariant model stands in `kempf.pipeline.estimate.filters.kalman_filter`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x[k] = Phi[k] x[k-1] + g[k] + w[k], var w[k] = Q[k]; y[k, i] = H[k, i] x[k] + e, var e = R[k, i]."""

    #: Shape (n, n_state, n_state). From instant k - 1 to k; the first is not used.
    Phi: Float
    #: Shape (n, n_state).
    g: Float
    #: Shape (n, n_state, n_state).
    Q: Float
    #: Shape (n, n_measurement). NaN where nothing was measured.
    Y: Float
    #: Shape (n, n_measurement, n_state).
    H: Float
    #: Shape (n, n_measurement). Variances.
    R: Float
    #: Shape (n_state,). Mean at the first instant, before its measurements.
    x0: Float
    #: Shape (n_state, n_state).
    P0: Float


@dataclass(frozen=True, eq=False)
class Smoothed:
    """States given all measurements."""

    log_likelihood: float
    #: Shape (n, n_state).
    mean: Float
    #: Shape (n, n_state, n_state).
    covariance: Float
    #: innovation, variance: Shape (n, n_measurement). One-step prediction errors and their variances; NaN where not
    #: measured.
    innovation: Float
    variance: Float


@dataclass(frozen=True, eq=False)
class Last:
    """The state at the last instant given all measurements, and how likely these were."""

    log_likelihood: float
    #: Shape (n_state,).
    mean: Float
    #: Shape (n_state, n_state).
    covariance: Float


def last_state(system: LinearSystem) -> Last:
    """Filter a record and keep what is known at its end."""
    s = system
    value, mean, covariance, _, _, _ = _filter(s.Phi, s.g, s.Q, s.Y, s.H, s.R, s.x0, s.P0, 1)
    return Last(float(value), mean[0], covariance[0])


def smooth(system: LinearSystem) -> Smoothed:
    """Filter a record, then go back over it."""
    s, n = system, system.Y.shape[0]
    value, mean, covariance, gain, innovation, variance = _filter(s.Phi, s.g, s.Q, s.Y, s.H, s.R, s.x0, s.P0, n)
    _backward(system.Phi, system.H, mean, covariance, gain, innovation, variance)
    return Smoothed(float(value), mean, covariance, innovation, variance)


@njit(cache=True, nogil=True, error_model="numpy")
def _predict(Phi, g, Q, x, P, W, moved):  # type: ignore[no-untyped-def]
    """Let x <- Phi x + g and P <- Phi P Phi' + Q."""
    n_state = x.size
    W[:, :] = 0.0
    for a in range(n_state):
        total = g[a]
        for m in range(n_state):
            p = Phi[a, m]
            if p == 0.0:
                continue
            total += p * x[m]
            for b in range(n_state):
                W[a, b] += p * P[m, b]
        moved[a] = total
    x[:] = moved
    P[:, :] = Q
    for a in range(n_state):
        for m in range(n_state):
            p = Phi[a, m]
            if p == 0.0:
                continue
            for b in range(n_state):
                P[b, a] += W[b, m] * p
    for a in range(n_state):
        for b in range(a):
            P[b, a] = P[a, b] = 0.5 * (P[a, b] + P[b, a])


@njit(cache=True, nogil=True, error_model="numpy")
def _filter(Phi, g, Q, Y, H, R, x0, P0, rows):  # type: ignore[no-untyped-def]
    """Filter; keep the states after the measurements of the last ``rows`` instants."""
    n, n_measurement = Y.shape
    n_state = x0.size
    means, covariances = np.empty((rows, n_state)), np.empty((rows, n_state, n_state))
    gain = np.zeros((rows, n_measurement, n_state))
    innovation, variance = np.full((n, n_measurement), np.nan), np.full((n, n_measurement), np.nan)
    x, P, W, Ph = x0.copy(), P0.copy(), np.empty((n_state, n_state)), np.empty(n_state)
    value = 0.0
    for k in range(n):
        row = k - (n - rows)
        if k > 0:
            _predict(Phi[k], g[k], Q[k], x, P, W, Ph)
        for i in range(n_measurement):
            if np.isnan(Y[k, i]):
                continue
            h = H[k, i]
            e, S = Y[k, i], R[k, i]
            for a in range(n_state):
                total = 0.0
                for b in range(n_state):
                    total += P[a, b] * h[b]
                Ph[a] = total
                e -= h[a] * x[a]
                S += h[a] * total
            for a in range(n_state):
                x[a] += Ph[a] * e / S
                for b in range(a + 1):
                    P[a, b] -= Ph[a] * Ph[b] / S
                    P[b, a] = P[a, b]
            value -= 0.5 * (np.log(2.0 * np.pi * S) + e * e / S)
            innovation[k, i], variance[k, i] = e, S
            if row >= 0:
                gain[row, i] = Ph / S
        if row >= 0:
            means[row], covariances[row] = x, P
    return value, means, covariances, gain, innovation, variance


@njit(cache=True, nogil=True, error_model="numpy")
def _backward(Phi, H, means, covariances, gain, innovation, variance):  # type: ignore[no-untyped-def]
    """Turn filtered into smoothed states in place; n and N are what the later measurements say of the state."""
    rows, n_state = means.shape
    n, N = np.zeros(n_state), np.zeros((n_state, n_state))
    for k in range(rows - 1, -1, -1):
        P = covariances[k].copy()
        means[k] += P @ n
        covariances[k] = P - P @ N @ P
        for i in range(H.shape[1] - 1, -1, -1):
            S = variance[k, i]
            if np.isnan(S):
                continue
            h, K = H[k, i].copy(), gain[k, i].copy()
            # L = I - K h':  n <- h e / S + L' n,  N <- h h' / S + L' N L
            NK = N @ K
            n += h * (innovation[k, i] / S - K @ n)
            N += np.outer(h, h) * (1.0 / S + K @ NK) - np.outer(h, NK) - np.outer(NK, h)
        F = Phi[k].copy()
        n = F.T @ n
        N = F.T @ N @ F
