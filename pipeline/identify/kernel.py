"""The compiled likelihood of eq. (16) over one segment, with its score and Fisher information.

State x = (v, r, F, psi, c_1, c_2); measurements y_v = v + h_1 c_1 + h_2 c_2 (eq. (18)), y_r = r, y_psi = psi, each at
its own instants. With h = (1, 0) the first current state is the paper's V_T; with h = (-sin K, cos K) the two are the
current towards north and east, and eq. (19) holds without its small angle.
Between two instants the model is discretised exactly for a constant speed and a rudder that moves linearly; the
matrix exponential and its derivatives come from one Taylor series, summed to the last bit of a double on steps short
enough for it. Sensitivities are carried forward with the filter (Astrom 1980, "Maximum likelihood and prediction
error methods", Automatica 16), scalar measurement by scalar measurement.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pipeline.normalise.series import Float

#: theta = (a11, a12, a21, a22, b1, b2, log sigma_F, log sigma_V, log sigma_v, log sigma_r, log sigma_psi)
N_THETA = 11
N_STATE = 6
_ORDER = 14  # Taylor terms: 0.5^15/15! is below the last bit of a double
_LONGEST = 0.5  # largest |A| h of one step
#: no vessel answers her rudder faster than this; beyond it only the cost grows
FASTEST_PER_S = 10.0
_LOG_2PI = float(np.log(2.0 * np.pi))


@njit(cache=True, nogil=True, error_model="numpy")
def _apply(A, X, Y, n):  # type: ignore[no-untyped-def]
    """Y = A X for the sparse A of the chain (v, r, F, psi), n columns."""
    for c in range(n):
        v, r, f = X[0, c], X[1, c], X[2, c]
        Y[0, c] = A[0, 0] * v + A[0, 1] * r + f
        Y[1, c] = A[1, 0] * v + A[1, 1] * r + A[1, 2] * f
        Y[2, c] = A[2, 2] * f
        Y[3, c] = r


@njit(cache=True, nogil=True, error_model="numpy")
def _discretise(A, b, h, u0, u1, V, active, Phi, g, Q, dPhi, dg, dQ, work):  # type: ignore[no-untyped-def]
    """Exact step of the chain: Phi, the input g, unit-intensity Q, and their derivatives for active parameters."""
    T, L, tmp, dT, dL = work[0], work[1], work[2], work[3:7], work[7:11]
    T[:, :] = 0.0
    L[:, :] = 0.0
    for i in range(4):
        T[i, i] = 1.0
    L[2, 2] = h
    Phi[:, :] = T
    Q[:, :] = L
    dPhi[:, :, :] = 0.0
    dQ[:, :, :] = 0.0
    dg[:, :] = 0.0
    dT[:, :, :] = 0.0
    dL[:, :, :] = 0.0
    slope = u1 - u0
    w = h * (u0 + 0.5 * slope)
    for i in range(4):
        g[i] = w * (T[i, 0] * b[0] + T[i, 1] * b[1])
        dg[4, i] = w * T[i, 0] * V * V
        dg[5, i] = w * T[i, 1] * V * V
    for k in range(1, _ORDER + 1):
        s, sq = h / k, h / (k + 1)
        # derivatives first: they need the previous T and L
        for j in range(4):
            if not active[j]:
                continue
            row, col = j // 2, j % 2
            _apply(A, dT[j], tmp, 4)
            for c in range(4):
                tmp[row, c] += V * T[col, c]
                for i in range(4):
                    dT[j, i, c] = tmp[i, c] * s
                    dPhi[j, i, c] += dT[j, i, c]
            _apply(A, dL[j], tmp, 4)
            for c in range(4):
                tmp[row, c] += V * L[col, c]
            for i in range(4):
                for c in range(i + 1):
                    value = (tmp[i, c] + tmp[c, i]) * sq
                    dL[j, i, c] = value
                    dL[j, c, i] = value
                    dQ[j, i, c] += value
                    if i != c:
                        dQ[j, c, i] += value
        _apply(A, T, tmp, 4)
        for i in range(4):
            for c in range(4):
                T[i, c] = tmp[i, c] * s
                Phi[i, c] += T[i, c]
        _apply(A, L, tmp, 4)
        for i in range(4):
            for c in range(i + 1):
                value = (tmp[i, c] + tmp[c, i]) * sq
                L[i, c] = value
                L[c, i] = value
                Q[i, c] += value
                if i != c:
                    Q[c, i] += value
        w = h * (u0 / (k + 1) + slope / ((k + 1) * (k + 2)))
        for i in range(4):
            g[i] += w * (T[i, 0] * b[0] + T[i, 1] * b[1])
            dg[4, i] += w * T[i, 0] * V * V
            dg[5, i] += w * T[i, 1] * V * V
            for j in range(4):
                if active[j]:
                    dg[j, i] += w * (dT[j, i, 0] * b[0] + dT[j, i, 1] * b[1])
        largest = 0.0
        for i in range(4):
            for c in range(4):
                largest = max(largest, abs(T[i, c]))
        if largest < 1e-18:
            break


@njit(cache=True, nogil=True, error_model="numpy")
def _predict_tangent(F, P, x, dF, dx, dP, work):  # type: ignore[no-untyped-def]
    """Dx <- dF x + F dx, dP <- F dP F' + dF P F' + (dF P F')', all (6, 6)."""
    A, B = work[0], work[1]
    for i in range(N_STATE):
        total = 0.0
        for k in range(N_STATE):
            total += dF[i, k] * x[k] + F[i, k] * dx[k]
        A[i, 0] = total
    for i in range(N_STATE):
        dx[i] = A[i, 0]
    # A = F dP / 2 + dF P, then dP = A F' + F A'
    for i in range(N_STATE):
        for c in range(N_STATE):
            total = 0.0
            for k in range(N_STATE):
                total += 0.5 * F[i, k] * dP[k, c] + dF[i, k] * P[k, c]
            A[i, c] = total
    for i in range(N_STATE):
        for c in range(N_STATE):
            total = 0.0
            for k in range(N_STATE):
                total += A[i, k] * F[c, k]
            B[i, c] = total
    for i in range(N_STATE):
        for c in range(N_STATE):
            dP[i, c] = B[i, c] + B[c, i]


@njit(cache=True, nogil=True, error_model="numpy")
def _rates(theta, V, arm, mu_F, A, b):  # type: ignore[no-untyped-def]
    """Fill A and b of the chain at a speed; return the size of A in 1/s."""
    A[0, 0], A[0, 1], A[0, 2] = theta[0] * V, theta[1] * V, 1.0
    A[1, 0], A[1, 1], A[1, 2] = theta[2] * V, theta[3] * V, arm
    A[2, 2], A[3, 1] = -mu_F, 1.0
    b[0], b[1] = theta[4] * V * V, theta[5] * V * V
    # a balanced norm: the off-diagonal entries count by their product, which no choice of units changes
    return abs(A[0, 0]) + abs(A[1, 1]) + np.sqrt(abs(A[0, 1] * A[1, 0])) + mu_F


@njit(cache=True, nogil=True, error_model="numpy")
def _advance(x, P, dx, dP, F, dF, active, any_active, step, force, current, work):  # type: ignore[no-untyped-def]
    """Let x <- F x + g, P <- F P F' + Q, and their derivatives; step = (g, Q, dPhi, dg, dQ) of the chain."""
    g, Q, dPhi, dg, dQ = step
    if any_active:
        for j in range(N_THETA):
            if not active[j]:
                continue
            for i in range(4):
                for c in range(4):
                    dF[i, c] = dPhi[j, i, c] if j < 4 else 0.0
            _predict_tangent(F, P, x, dF, dx[j], dP[j], work)
            if j < 6:
                for i in range(4):
                    dx[j, i] += dg[j, i]
            for i in range(4):
                for c in range(4):
                    if j < 4:
                        dP[j, i, c] += force * dQ[j, i, c]
                    elif j == 6:
                        dP[j, i, c] += 2.0 * force * Q[i, c]
            if j == 7:
                dP[j, 4, 4] += 2.0 * current
                dP[j, 5, 5] += 2.0 * current
    W, moved = work[0], work[1, 0]
    for i in range(N_STATE):
        moved[i] = g[i] if i < 4 else 0.0
        for c in range(N_STATE):
            moved[i] += F[i, c] * x[c]
            W[i, c] = 0.0
            for m in range(N_STATE):
                W[i, c] += F[i, m] * P[m, c]
    for i in range(N_STATE):
        x[i] = moved[i]
        for c in range(i + 1):
            total = force * Q[i, c] if i < 4 and c < 4 else 0.0
            for m in range(N_STATE):
                total += W[i, m] * F[c, m]
            P[i, c] = total
            P[c, i] = total
    P[4, 4] += current
    P[5, 5] += current


@njit(cache=True, nogil=True, error_model="numpy")
def _update(y, h, noise, level, x, P, dx, dP, active, score, information, work):  # type: ignore[no-untyped-def]
    """Take in one scalar y = h x + noise; return innovation and variance, add to score and information."""
    Ph, dPh, de, dS = work
    e, S = y, noise
    for i in range(N_STATE):
        e -= h[i] * x[i]
        Ph[i] = 0.0
        for c in range(N_STATE):
            Ph[i] += P[i, c] * h[c]
    for i in range(N_STATE):
        S += h[i] * Ph[i]
    if not (S > 0.0) or not np.isfinite(e):
        return e, -1.0
    for j in range(N_THETA):
        if not active[j]:
            continue
        de[j] = 0.0
        dS[j] = 2.0 * noise if j == level else 0.0
        for i in range(N_STATE):
            de[j] -= h[i] * dx[j, i]
            dPh[j, i] = 0.0
            for c in range(N_STATE):
                dPh[j, i] += dP[j, i, c] * h[c]
            dS[j] += h[i] * dPh[j, i]
        score[j] += -e * de[j] / S + 0.5 * (e * e / S - 1.0) * dS[j] / S
        for m in range(j + 1):
            if active[m]:
                information[j, m] += de[j] * de[m] / S + 0.5 * dS[j] * dS[m] / (S * S)
        for i in range(N_STATE):
            # the gain is Ph / S: its derivative times e, and itself times the derivative of e
            dx[j, i] += (dPh[j, i] - Ph[i] * dS[j] / S) / S * e + Ph[i] * de[j] / S
            for c in range(N_STATE):
                dP[j, i, c] -= (dPh[j, i] * Ph[c] + Ph[i] * dPh[j, c] - Ph[i] * Ph[c] * dS[j] / S) / S
    for i in range(N_STATE):
        x[i] += Ph[i] * e / S
        for c in range(i + 1):
            value = P[i, c] - Ph[i] * Ph[c] / S
            P[i, c] = value
            P[c, i] = value
    return e, S


@njit(cache=True, nogil=True, error_model="numpy")
def likelihood(  # type: ignore[no-untyped-def]
    theta, active, time_s, speed, rudder, measured, current_row, arm, mu_F, mu_V, x0, P0, innovation, variance, states
):
    """Log-likelihood of one segment, its score and its expected Fisher information.

    Parameters
    ----------
    theta : ndarray, shape (11,)
        See `N_THETA`.
    active : ndarray of bool, shape (11,)
        Parameters whose derivatives are wanted; the others' entries of score and information stay 0.
    time_s : ndarray, shape (n,)
        Instants, s, not decreasing.
    speed, rudder : ndarray, shape (n,)
        Speed through the water, m/s, and rudder angle, rad, at the instants.
    measured : ndarray, shape (n, 3)
        y_v, y_r, y_psi at the instants, NaN where not measured then.
    current_row : ndarray, shape (n, 2)
        h_1 and h_2 at the instants; used where y_v is measured.
    arm, mu_F, mu_V : float
        l, 1/m, and the correlation rates of eq. (16), 1/s.
    x0 : ndarray, shape (6,); P0 : ndarray, shape (6, 6)
        Mean and covariance of the state at the first instant.
    innovation, variance : ndarray, shape (n, 3)
        Filled with the one-step innovations and their variances (NaN where not measured); may have 0 rows.
    states : ndarray, shape (n, 6)
        Filled with the filtered states; may have 0 rows.

    Returns
    -------
    log_likelihood : float
    score : ndarray, shape (11,)
    information : ndarray, shape (11, 11)
    """
    score, information = np.zeros(N_THETA), np.zeros((N_THETA, N_THETA))
    log_likelihood = 0.0
    x, P = x0.copy(), P0.copy()
    dx, dP = np.zeros((N_THETA, N_STATE)), np.zeros((N_THETA, N_STATE, N_STATE))
    A, b, F, dF = np.zeros((4, 4)), np.zeros(2), np.zeros((N_STATE, N_STATE)), np.zeros((N_STATE, N_STATE))
    Phi, g, Q = np.zeros((4, 4)), np.zeros(4), np.zeros((4, 4))
    dPhi, dg, dQ = np.zeros((4, 4, 4)), np.zeros((6, 4)), np.zeros((4, 4, 4))
    work4, work6 = np.zeros((11, 4, 4)), np.zeros((2, N_STATE, N_STATE))
    update_work = (np.zeros(N_STATE), np.zeros((N_THETA, N_STATE)), np.zeros(N_THETA), np.zeros(N_THETA))
    h = np.zeros((3, N_STATE))
    h[0, 0], h[1, 1], h[2, 3] = 1.0, 1.0, 1.0
    any_active = bool(np.any(active))
    force, spread = 2.0 * mu_F * np.exp(2.0 * theta[6]), np.exp(2.0 * theta[7])
    for k in range(time_s.size):
        if k > 0 and time_s[k] > time_s[k - 1]:
            span, V = time_s[k] - time_s[k - 1], 0.5 * (speed[k] + speed[k - 1])
            size = _rates(theta, V, arm, mu_F, A, b)
            if not (size <= FASTEST_PER_S):
                return -np.inf, score, information
            n_sub = max(1, int(np.ceil(size * span / _LONGEST)))
            decay = np.exp(-mu_V * span / n_sub)
            F[4, 4], F[5, 5] = decay, decay
            slope = (rudder[k] - rudder[k - 1]) / n_sub
            for sub in range(n_sub):
                u0, u1 = rudder[k - 1] + slope * sub, rudder[k - 1] + slope * (sub + 1)
                _discretise(A, b, span / n_sub, u0, u1, V, active, Phi, g, Q, dPhi, dg, dQ, work4)
                F[:4, :4] = Phi
                step = (g, Q, dPhi, dg, dQ)
                current = spread * (1.0 - decay * decay)
                _advance(x, P, dx, dP, F, dF, active, any_active, step, force, current, work6)
        h[0, 4], h[0, 5] = current_row[k, 0], current_row[k, 1]
        for channel in range(3):
            if np.isnan(measured[k, channel]):
                continue
            level = 8 + channel
            noise = np.exp(2.0 * theta[level])
            e, S = _update(
                measured[k, channel], h[channel], noise, level, x, P, dx, dP, active, score, information, update_work
            )
            if S < 0.0:
                return -np.inf, score, information
            log_likelihood -= 0.5 * (_LOG_2PI + np.log(S) + e * e / S)
            if innovation.shape[0] > 0:
                innovation[k, channel] = e
                variance[k, channel] = S
        if states.shape[0] > 0:
            states[k] = x
    for j in range(N_THETA):
        for m in range(j):
            information[m, j] = information[j, m]
    return log_likelihood, score, information


def no_trace() -> tuple[Float, Float, Float]:
    """Return the empty arrays that tell `likelihood` to keep no innovations and no states."""
    return np.empty((0, 3)), np.empty((0, 3)), np.empty((0, N_STATE))
