"""The compiled likelihood of eq. (16) over one segment, with its score and Fisher information.

State x = (v, r, psi, F, M, e, c_1, c_2, b), in the order of the extended filter; measurements y_v = v + h_1 c_1 + h_2
c_2 (eq. (18)), y_r = r + b, y_psi = psi, each at its own instants. With h = (1, 0) the first current state is the
paper's V_T; with h = (-sin K, cos K) the two are the current towards north and east, and eq. (19) holds without its
small angle. e is the error of the speed, which acts like one of the rudder
(`kempf.pipeline.estimate.record.speed_error`); b is the bias of the rate gyro, which the heading separates from a
turn. A state without variance is left out of the arithmetic.
Sensitivities are carried forward with the filter (Astrom 1980, "Maximum likelihood and prediction error methods",
Automatica 16), scalar measurement by scalar measurement; they lie innermost in memory.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import STEP, njit
from kempf.pipeline.model.chain import N_CHAIN, PSI, M, R, V
from kempf.pipeline.model.discretise import discretise, rates, room_for_a_step

#: theta = (a11, a12, a21, a22, b1, b2, log sigma_F, sigma_M, sigma_V, sigma_v, sigma_r, sigma_psi); the second half
#: are logarithms, in the order of `kempf.schemas.model_spec.NOISE_PARAMETERS`
N_THETA = 12
N_STATE = 9
ERROR, C1, C2, BIAS = 5, 6, 7, 8
LOG_F, LOG_M, LOG_V = 6, 7, 8
#: the first of the measurements' noise levels
LOG_MEASUREMENT = 9
#: no vessel answers her rudder faster than this; beyond it only the cost grows
FASTEST_PER_S = 10.0
_LOG_2PI = float(np.log(2.0 * np.pi))


@njit(**STEP)
def _advance(  # type: ignore[no-untyped-def]
    x, P, dx, dP, F, g, Q, dF, dE, dg, dQ, derivatives, chain, error, W, dW, dWt, moved, dmoved
):
    """Let x <- F x + g, P <- F P F' + Q, and their derivatives.

    Derivatives of a matrix lie in rows (i, (c, j)), so that F acts on them row by row, on all columns and parameters
    at once. ``chain`` is how many states belong to the chain; only its rows of F depend on the parameters. ``error`` is
    where the speed's error stands, n where there is none, and ``dE`` how its column of F depends on them.
    """
    # asked of the array: a loop of a length that the compiler knew, it would write out number by number
    n, m = x.size, dx.shape[1]
    width = n * m
    for i in range(n):
        moved[i] = g[i]
        for c in range(n):
            W[i, c] = 0.0
        for k in range(n):
            f = F[i, k]
            if f != 0.0:
                moved[i] += f * x[k]
                for c in range(n):
                    W[i, c] += f * P[k, c]
    if derivatives:
        for i in range(n):
            for j in range(m):
                dmoved[i, j] = dg[i, j]
            for q in range(width):
                dW[i, q] = 0.0
            for k in range(n):
                f = F[i, k]
                if f != 0.0:
                    for j in range(m):
                        dmoved[i, j] += f * dx[k, j]
                    half = 0.5 * f
                    for q in range(width):
                        dW[i, q] += half * dP[k, q]
            if i < chain:
                for k in range(chain):
                    for j in range(4):
                        d = dF[i, k, j]
                        if d != 0.0:
                            dmoved[i, j] += d * x[k]
                            for c in range(n):
                                dW[i, c * m + j] += d * P[k, c]
                if error < n:
                    for j in range(6):
                        d = dE[i, j]
                        dmoved[i, j] += d * x[error]
                        for c in range(n):
                            dW[i, c * m + j] += d * P[error, c]
            for c in range(n):
                for j in range(m):
                    dWt[c, i * m + j] = dW[i, c * m + j]
        # with A = F dP / 2 + dF P the derivative is A F' + F A'
        for c in range(n):
            for q in range(width):
                dW[c, q] = 0.0
            for k in range(n):
                f = F[c, k]
                if f != 0.0:
                    for q in range(width):
                        dW[c, q] += f * dWt[k, q]
        for i in range(n):
            for c in range(i + 1):
                for j in range(m):
                    value = dW[i, c * m + j] + dW[c, i * m + j] + dQ[i, c * m + j]
                    dP[i, c * m + j] = value
                    dP[c, i * m + j] = value
            for j in range(m):
                dx[i, j] = dmoved[i, j]
    for i in range(n):
        x[i] = moved[i]
        for c in range(i + 1):
            total = Q[i, c]
            for k in range(n):
                total += W[i, k] * F[c, k]
            P[i, c] = total
            P[c, i] = total


@njit(**STEP)
def _update(  # type: ignore[no-untyped-def]
    y, h, row, noise, level, x, P, dx, dP, withheld, derivatives, score, information, gain, dPh, de, dS, gains, tile
):
    """Take in one scalar y = h x + noise; return innovation and variance, set its score, add to the information.

    A withheld one is only predicted.
    """
    n, m = x.size, dx.shape[1]
    width = n * m
    e, S = y, noise
    for i in range(n):
        total = 0.0
        for c in range(n):
            total += P[i, c] * h[row, c]
        gain[i] = total
        e -= h[row, i] * x[i]
        S += h[row, i] * total
    if not (S > 0.0) or not np.isfinite(e):
        return e, -1.0
    if withheld:
        return e, S
    for i in range(n):
        gain[i] /= S
    if derivatives:
        for q in range(width):
            dPh[q] = 0.0
        for j in range(m):
            de[j], dS[j] = 0.0, 0.0
        for c in range(n):
            f = h[row, c]
            if f != 0.0:
                # dP h, by symmetry a sum of rows
                for q in range(width):
                    dPh[q] += f * dP[c, q]
                for j in range(m):
                    de[j] -= f * dx[c, j]
        dS[level] = 2.0 * noise
        for c in range(n):
            f = h[row, c]
            if f != 0.0:
                for j in range(m):
                    dS[j] += f * dPh[c * m + j]
        whole, half, surplus = 1.0 / S, 0.5 / (S * S), 0.5 * (e * e / S - 1.0) / S
        for j in range(m):
            score[j] = -e * whole * de[j] + surplus * dS[j]
        for i in range(m):
            a, b = de[i] * whole, dS[i] * half
            for j in range(m):
                information[i, j] += a * de[j] + b * dS[j]
        # the gain is P h / S: its derivative times e, and itself times the derivative of e
        for i in range(n):
            g = gain[i]
            for j in range(m):
                d = dPh[i * m + j]
                dx[i, j] += (d - g * dS[j]) * whole * e + g * de[j]
                # P - P h h' P / S loses g_c z_i + g_i z_c with z = dP h - g dS / 2
                dPh[i * m + j] = d - 0.5 * g * dS[j]
                gains[i * m + j] = g
        for i in range(n):
            g = gain[i]
            for c in range(n):
                for j in range(m):
                    tile[c * m + j] = dPh[i * m + j]
            for q in range(width):
                dP[i, q] -= gains[q] * tile[q] + g * dPh[q]
    for i in range(n):
        x[i] += gain[i] * e
        for c in range(i + 1):
            value = P[i, c] - gain[i] * gain[c] * S
            P[i, c] = value
            P[c, i] = value
    return e, S


@njit(**{**STEP, "fastmath": False})
def _gather(  # type: ignore[no-untyped-def]
    states, chain, error, q_delta, gain, Phi, g, held, Q, dPhi, dg, dheld, dQ, F, gs, Qs, dF, dE, dgs, dQs, derivatives
):
    """Take the present states out of the chain's step; what lies outside the chain stays as it is.

    The rudder's error, of variance ``q_delta`` over the step, joins the process noise here; the speed's, state
    ``error``, acts like ``gain`` of rudder.
    """
    n = states.size
    for a in range(chain):
        i = states[a]
        gs[a] = g[i]
        if error < n:
            F[a, error] = gain * held[i]
            if derivatives:
                for j in range(6):
                    dE[a, j] = gain * dheld[i, j]
        for b in range(chain):
            F[a, b] = Phi[i, states[b]]
        for b in range(a + 1):
            c = states[b]
            Qs[a, b] = Q[i, c, 0] + Q[i, c, 1] + q_delta * held[i] * held[c]
        if derivatives:
            for j in range(6):
                dgs[a, j] = dg[i, j]
            for b in range(chain):
                for j in range(4):
                    dF[a, b, j] = dPhi[i, states[b], j]
            for b in range(a + 1):
                c, q = states[b], b * N_THETA
                for j in range(4):
                    dQs[a, q + j] = dQ[i, c, j]
                for j in range(4, 6):
                    dQs[a, q + j] = 0.0
                for j in range(6):
                    dQs[a, q + j] += q_delta * (dheld[i, j] * held[c] + held[i] * dheld[c, j])
                dQs[a, q + LOG_F] = 2.0 * Q[i, c, 0]
                dQs[a, q + LOG_M] = 2.0 * Q[i, c, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def likelihood(  # type: ignore[no-untyped-def]
    theta,
    derivatives,
    time_s,
    speed,
    rudder,
    rudder_noise,
    error_gain,
    measured,
    withheld,
    current_row,
    arm,
    mu_F,
    mu_M,
    mu_V,
    mu_e,
    longest,
    x0,
    P0,
    trace,
):
    """Log-likelihood of one segment, its score and its expected Fisher information.

    Parameters
    ----------
    theta : ndarray, shape (12,)
        See `N_THETA`.
    derivatives : bool
        Whether score and information are wanted; else they are 0.
    time_s : ndarray, shape (n,)
        Instants, s, not decreasing.
    speed, rudder : ndarray, shape (n,)
        Speed through the water, m/s, and rudder angle, rad, at the instants.
    rudder_noise : ndarray, shape (n,)
        Intensity of the rudder's error before each instant, rad s^0.5; over a step the error is taken for constant.
    error_gain : ndarray, shape (n,)
        Rudder that a unit of the speed's error stands for, rad s/m.
    measured : ndarray, shape (n, 3)
        y_v, y_r, y_psi at the instants, NaN where not measured then.
    withheld : ndarray of bool, shape (n,)
        Instants whose measurements are predicted, their innovations and variances kept, and not taken in.
    current_row : ndarray, shape (n, 2)
        h_1 and h_2 at the instants; used where y_v is measured.
    arm, mu_F, mu_M, mu_V, mu_e : float
        l, 1/m, and the correlation rates of the disturbances and of the speed's error, 1/s.
    longest : float
        Largest |A| h of one step; what lies farther apart is crossed in several.
    x0 : ndarray, shape (9,); P0 : ndarray, shape (9, 9)
        Mean and covariance of the state at the first instant. States that have no variance are left out.
    trace : tuple of ndarray
        Innovations (n, 3), their variances (n, 3), filtered states (n, 9), their variances (n, 9), and the scores of
        the single measurements (n, 3, 12), to be filled; any of them may have 0 rows.

    Returns
    -------
    log_likelihood : float
    score : ndarray, shape (12,)
    information : ndarray, shape (12, 12)
    """
    innovation, variance, filtered, spread, scores = trace
    score, information, one = np.zeros(N_THETA), np.zeros((N_THETA, N_THETA)), np.zeros(N_THETA)
    log_likelihood = 0.0
    states = np.flatnonzero(np.diag(P0) > 0.0)
    n, chain = states.size, np.count_nonzero(states < N_CHAIN)
    x, P = x0[states], np.zeros((n, n))
    for i in range(n):
        P[i] = P0[states[i]][states]
    dx, dP = np.zeros((n, N_THETA)), np.zeros((n, n * N_THETA))
    A, b, Phi, g = np.zeros((2, 2)), np.zeros(2), np.zeros((N_CHAIN, N_CHAIN)), np.zeros(N_CHAIN)
    dPhi, dg = np.zeros((N_CHAIN, N_CHAIN, 4)), np.zeros((N_CHAIN, 6))
    held, dheld = np.zeros(N_CHAIN), np.zeros((N_CHAIN, 6))
    Q, dQ = np.zeros((N_CHAIN, N_CHAIN, 2)), np.zeros((N_CHAIN, N_CHAIN, 4))
    F, gs, Qs = np.zeros((n, n)), np.zeros(n), np.zeros((n, n))
    dF, dgs, dQs = np.zeros((chain, chain, 4)), np.zeros((n, N_THETA)), np.zeros((n, n * N_THETA))
    dE = np.zeros((chain, 6))
    T, dT, answer, danswer = room_for_a_step()
    W, dW, dWt, moved, dmoved = np.zeros((n, n)), np.zeros_like(dP), np.zeros_like(dP), np.zeros(n), np.zeros_like(dx)
    gain, de, dS = np.zeros(n), np.zeros(N_THETA), np.zeros(N_THETA)
    dPh, gains, tile = np.zeros(n * N_THETA), np.zeros(n * N_THETA), np.zeros(n * N_THETA)
    h, first_current, error = np.zeros((3, n)), n, n
    for i in range(n):
        state = states[i]
        h[0, i] = 1.0 if state == V else 0.0
        h[1, i] = 1.0 if state in (R, BIAS) else 0.0
        h[2, i] = 1.0 if state == PSI else 0.0
        if state >= N_CHAIN:
            F[i, i] = 1.0
        if state == C1:
            first_current = i
        if state == ERROR:
            error = i
    currents = np.count_nonzero((states == C1) | (states == C2))
    q_F, q_M = 2.0 * mu_F * np.exp(2.0 * theta[LOG_F]), 2.0 * mu_M * np.exp(2.0 * theta[LOG_M])
    if P0[M, M] <= 0.0:
        q_M = 0.0
    square_V = np.exp(2.0 * theta[LOG_V])
    noises = np.exp(2.0 * theta[LOG_MEASUREMENT:])
    for k in range(time_s.size):
        if k > 0 and time_s[k] > time_s[k - 1]:
            span, U = time_s[k] - time_s[k - 1], 0.5 * (speed[k] + speed[k - 1])
            size = rates(theta, U, arm, mu_F, mu_M, A, b)
            if not (size <= FASTEST_PER_S):
                return -np.inf, score, information
            n_sub = max(1, int(np.ceil(size * span / longest)))
            s = span / n_sub
            decay = np.exp(-mu_V * s)
            noise_V = square_V * (1.0 - decay * decay)
            for i in range(first_current, first_current + currents):
                F[i, i], Qs[i, i] = decay, noise_V
                dQs[i, i * N_THETA + LOG_V] = 2.0 * noise_V
            if error < n:
                decay = np.exp(-mu_e * s)
                F[error, error], Qs[error, error] = decay, P0[ERROR, ERROR] * (1.0 - decay * decay)
            slope = (rudder[k] - rudder[k - 1]) / n_sub
            for sub in range(n_sub):
                u0 = rudder[k - 1] + slope * sub
                discretise(
                    *(A, b, arm, mu_F, mu_M, s, u0, u0 + slope, U, q_F, q_M, derivatives),
                    *(Phi, g, held, Q, dPhi, dg, dheld, dQ, T, dT, answer, danswer),
                )
                _gather(
                    *(states, chain, error, rudder_noise[k] * rudder_noise[k] / s),
                    *(0.5 * (error_gain[k] + error_gain[k - 1]), Phi, g, held, Q, dPhi, dg, dheld, dQ),
                    *(F, gs, Qs, dF, dE, dgs, dQs, derivatives),
                )
                _advance(
                    *(x, P, dx, dP, F, gs, Qs, dF, dE, dgs, dQs, derivatives, chain, error),
                    *(W, dW, dWt, moved, dmoved),
                )
        for i in range(currents):
            h[0, first_current + i] = current_row[k, i]
        for channel in range(3):
            if np.isnan(measured[k, channel]):
                continue
            level = LOG_MEASUREMENT + channel
            noise = noises[channel]
            e, S = _update(
                measured[k, channel],
                *(h, channel, noise, level, x, P, dx, dP, withheld[k], derivatives, one, information),
                *(gain, dPh, de, dS, gains, tile),
            )
            if S < 0.0:
                return -np.inf, score, information
            if not withheld[k]:
                log_likelihood -= 0.5 * (_LOG_2PI + np.log(S) + e * e / S)
                if derivatives:
                    for j in range(N_THETA):
                        score[j] += one[j]
            if innovation.shape[0] > 0:
                innovation[k, channel] = e
                variance[k, channel] = S
            if scores.shape[0] > 0 and not withheld[k]:
                scores[k, channel] = one
        if filtered.shape[0] > 0:
            filtered[k], spread[k] = 0.0, 0.0
            for i in range(n):
                filtered[k, states[i]] = x[i]
                spread[k, states[i]] = P[i, i]
    for j in range(N_THETA):
        for m in range(j):
            information[j, m] = information[m, j]
    return log_likelihood, score, information


def no_trace() -> tuple[Float, Float, Float, Float, Float]:
    """Return the empty arrays with which `likelihood` keeps nothing by the way."""
    return (
        *(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, N_STATE)), np.empty((0, N_STATE))),
        np.empty((0, 3, N_THETA)),
    )
