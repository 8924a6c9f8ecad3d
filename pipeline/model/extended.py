"""The extended Kalman filter of eq. (16) with effects: one pass over one run, compiled.

State x = (v, r, psi, F, M, m_1 .. m_k, c_1, c_2, b): the chain, the states that effects bring along, the current towards
north and east (or the paper's V_T), the bias of the rate gyro. Between measurements the mean moves by the classical
fourth-order Runge-Kutta rule with the terms of every effect in it, the covariance by the linearisation at the middle of
the step (Jazwinski 1970, "Stochastic Processes and Filtering Theory", ch. 8; the exact exponential's series to the
fourth order). A measurement off the grid by a moment is predicted there to first order in that moment.

It shares nothing with `pipeline.identify.kernel` but eq. (16), and without effects agrees with it: a test holds that.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pipeline.model.terms.program import DEPTH, evaluate
from pipeline.model.terms.symbols import SYMBOLS

#: rows of the input table from one instant to the next, and substeps; a substep reads three rows
ROWS, SUBSTEPS = 4, 2
#: places of symbols among the variables; states come first, in the filter's order
DELTA, SPEED, VDOT, RDOT = (SYMBOLS.index(name) for name in ("delta", "V", "vdot", "rdot"))
SHIP, CHANNEL, PARAMETER = SYMBOLS.index("a11"), SYMBOLS.index("U"), len(SYMBOLS)
#: columns of the input table: V, delta, and the symbols of channels and of the run
N_INPUT = 2 + PARAMETER - CHANNEL
#: states before those of effects, and after
N_BEFORE, N_AFTER, MOST_EXTRA = 5, 3, 4
V, R, PSI, F, M = 0, 1, 2, 3, 4
#: what a program is added to
ON_SPEED, ON_RUDDER, ON_SWAY, ON_YAW, ON_EXTRA, ON_LATERAL, ON_YAW_RATE, ON_HEADING = 0, 1, 2, 3, 4, 5, 6, 7
ON_NOISE, ON_INITIAL = 8, 9
_LOG_2PI = float(np.log(2.0 * np.pi))


@njit(cache=True, nogil=True, error_model="numpy")
def _add(kind, place, programs, code, constants, values, slopes, stack, width, total):  # type: ignore[no-untyped-def]
    """Add every program of a kind (and place, for extra states) to ``total``, shape (1 + width,)."""
    for p in range(programs.shape[0]):
        if programs[p, 0] == kind and programs[p, 1] == place:
            evaluate(code[programs[p, 2] : programs[p, 3]], constants, values, slopes, stack, width)
            for j in range(width + 1):
                total[j] += stack[0, j]


@njit(cache=True, nogil=True, error_model="numpy")
def _dynamics(  # type: ignore[no-untyped-def]
    x, row, ship, width, programs, code, constants, values, slopes, stack, total, f, J
):
    """Fill f = dx/dt of the chain and the effects' states, shape (width,), and its derivatives J, shape (width, width)."""
    a11, a12, a21, a22, b1, b2, arm, mu_F, mu_M, exponent, V0 = ship
    for i in range(width):
        values[i] = x[i]
        for j in range(width):
            J[i, j] = 0.0
            slopes[i, j] = 1.0 if i == j else 0.0
        f[i] = 0.0
    for i in range(N_INPUT - 2):
        values[CHANNEL + i] = row[2 + i]
    busy = programs.shape[0] > 0
    for kind in range(2):
        where = SPEED if kind == 0 else DELTA
        values[where] = row[kind]
        for j in range(width):
            slopes[where, j] = 0.0
        if busy:
            total[:] = 0.0
            _add(kind, 0, programs, code, constants, values, slopes, stack, width, total)
            values[where] += total[0]
            for j in range(width):
                slopes[where, j] = total[j + 1]
    U, delta = values[SPEED], values[DELTA]
    square = U * U if exponent == 2.0 else U * abs(U / V0) ** (exponent - 1.0) * V0
    v, r = x[V], x[R]
    f[V] = a11 * U * v + a12 * U * r + b1 * square * delta + x[F]
    f[R] = a21 * U * v + a22 * U * r + b2 * square * delta + arm * x[F] + x[M]
    f[PSI], f[F], f[M] = r, -mu_F * x[F], -mu_M * x[M]
    J[V, V], J[V, R], J[V, F] = a11 * U, a12 * U, 1.0
    J[R, V], J[R, R], J[R, F], J[R, M] = a21 * U, a22 * U, arm, 1.0
    J[PSI, R], J[F, F], J[M, M] = 1.0, -mu_F, -mu_M
    if busy:
        for j in range(width):
            d = slopes[DELTA, j]
            J[V, j] += b1 * square * d
            J[R, j] += b2 * square * d
        for kind in range(2):
            total[:] = 0.0
            _add(ON_SWAY + kind, 0, programs, code, constants, values, slopes, stack, width, total)
            f[kind] += total[0]
            for j in range(width):
                J[kind, j] += total[j + 1]
        for i in range(N_BEFORE, width):
            total[:] = 0.0
            _add(ON_EXTRA, i - N_BEFORE, programs, code, constants, values, slopes, stack, width, total)
            f[i] = total[0]
            for j in range(width):
                J[i, j] = total[j + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _series(A, w, h, nodes, width, a, b):  # type: ignore[no-untyped-def]
    """Fill ``nodes``, shape (3, width), with exp(A s) w at s = 0, h/2 and h."""
    for i in range(width):
        a[i] = w[i]
        for node in range(3):
            nodes[node, i] = w[i]
    half, whole = 1.0, 1.0
    for order in range(1, 5):
        half *= 0.5 * h / order
        whole *= h / order
        for i in range(width):
            total = 0.0
            for j in range(width):
                total += A[i, j] * a[j]
            b[i] = total
        for i in range(width):
            a[i] = b[i]
            nodes[1, i] += half * a[i]
            nodes[2, i] += whole * a[i]


@njit(cache=True, nogil=True, error_model="numpy")
def extended(  # type: ignore[no-untyped-def]
    hull,
    levels,
    parameters,
    step_s,
    inputs,
    rudder_noise,
    measured,
    offset_s,
    withheld,
    current_row,
    constants_of_ship,
    rates,
    x0,
    P0,
    table,
    kept,
):
    """Run the filter over one run.

    Parameters
    ----------
    hull : ndarray, shape (6,)
        a11, a12, a21, a22, b1, b2.
    levels : ndarray, shape (6,)
        Intensities of what drives F, m/s^2 per sqrt s, M, and the current, and standard deviations of the three
        measurements.
    parameters : ndarray, shape (p,)
        Of the effects, in the order of their programs' variables.
    step_s : float
        From one instant to the next.
    inputs : ndarray, shape (ROWS (n - 1) + 1, N_INPUT)
        V, m/s, delta, rad, then the symbols of channels and run, at a quarter of the step.
    rudder_noise : ndarray, shape (n,)
        Intensity of the rudder's error before each instant, rad s^0.5.
    measured : ndarray, shape (n, 3)
        y_v, y_r, y_psi, NaN where there is none.
    offset_s : ndarray, shape (n, 3)
        How much later than the instant each was measured.
    withheld : ndarray of bool, shape (n,)
        Instants whose measurements are predicted and not taken in.
    current_row : ndarray, shape (n, 2)
    constants_of_ship : ndarray, shape (6,)
        l, L, T, V0, n0 and the exponent of V in the rudder's force.
    rates : ndarray, shape (3,)
        Correlation rates of F, M and the current, 1/s.
    x0, P0 : ndarray, shape (8 + k,) and (8 + k, 8 + k)
        Mean and covariance of the state at the first instant; effects add to those of their own states.
    table : tuple
        ``programs`` int64 (q, 4): kind, place, first and last instruction; ``code`` and ``constants`` of all of them.
    kept : tuple of ndarray
        ``predicted`` and ``variance``, shape (n, 3), to be filled; ``states`` and ``spread``, shape (n, 8 + k), filtered,
        and ``after``, ``before``, ``moved`` for a smoother, shape (n, 8 + k, 8 + k), or 0 rows.

    Returns
    -------
    float
        Log-likelihood; -inf where the filter runs away.
    """
    programs, code, constants = table
    predicted, variance, states, spread, after, before, moved = kept
    n, steps = x0.size, measured.shape[0]
    width = n - N_AFTER
    x, P = x0.copy(), P0.copy()
    arm, length, draught, V0, n0, exponent = constants_of_ship
    ship = (hull[0], hull[1], hull[2], hull[3], hull[4], hull[5], arm, rates[0], rates[1], exponent, V0)
    values, slopes = np.zeros(PARAMETER + parameters.size), np.zeros((PARAMETER + parameters.size, width))
    values[SHIP : SHIP + 6] = hull
    values[SHIP + 6], values[SHIP + 7], values[SHIP + 8], values[SHIP + 9] = length, draught, V0, n0
    values[PARAMETER:] = parameters
    stack, total = np.zeros((DEPTH, width + 1)), np.zeros(width + 1)
    extra = np.zeros(MOST_EXTRA)
    if programs.shape[0] > 0:
        values[SPEED] = inputs[0, 0]
        for i in range(width - N_BEFORE):
            total[:] = 0.0
            _add(ON_INITIAL, i, programs, code, constants, values, slopes, stack, width, total)
            P[N_BEFORE + i, N_BEFORE + i] += total[0] ** 2
            total[:] = 0.0
            _add(ON_NOISE, i, programs, code, constants, values, slopes, stack, width, total)
            extra[i] = total[0] ** 2
    k1, k2, k3, k4, xs = np.zeros(width), np.zeros(width), np.zeros(width), np.zeros(width), np.zeros(width)
    A, J, Phi, term, work = (
        *(np.zeros((width, width)), np.zeros((width, width)), np.zeros((width, width)), np.zeros((width, width))),
        np.zeros((width, width)),
    )
    nodes, w, va, vb = np.zeros((3, width)), np.zeros(width), np.zeros(width), np.zeros(width)
    W, gain, h, stood = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(n)
    simpson = (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0)
    q_F, q_M, q_c = levels[0] ** 2, levels[1] ** 2, levels[2] ** 2
    has_M = P0[M, M] > 0.0
    log_likelihood = 0.0
    H = step_s / SUBSTEPS
    current_decay = np.exp(-rates[2] * H)
    keep = before.shape[0] > 0
    for k in range(steps):
        if keep:
            moved[k] = 0.0
            for i in range(n):
                moved[k, i, i] = 1.0
        if k > 0:
            for sub in range(SUBSTEPS):
                i0 = ROWS * (k - 1) + 2 * sub
                start, middle, end = inputs[i0], inputs[i0 + 1], inputs[i0 + 2]
                _dynamics(x, start, ship, width, programs, code, constants, values, slopes, stack, total, k1, J)
                for i in range(width):
                    xs[i] = x[i] + 0.5 * H * k1[i]
                _dynamics(xs, middle, ship, width, programs, code, constants, values, slopes, stack, total, k2, J)
                for i in range(width):
                    xs[i] = x[i] + 0.5 * H * k2[i]
                _dynamics(xs, middle, ship, width, programs, code, constants, values, slopes, stack, total, k3, A)
                U = values[SPEED]
                for i in range(width):
                    xs[i] = x[i] + H * k3[i]
                _dynamics(xs, end, ship, width, programs, code, constants, values, slopes, stack, total, k4, J)
                for i in range(width):
                    x[i] += H / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                # exp(A H) to the fourth order
                for i in range(width):
                    for j in range(width):
                        term[i, j] = 1.0 if i == j else 0.0
                        Phi[i, j] = term[i, j]
                for order in range(1, 5):
                    s = H / order
                    for i in range(width):
                        for j in range(width):
                            value = 0.0
                            for m in range(width):
                                value += A[i, m] * term[m, j]
                            work[i, j] = s * value
                    for i in range(width):
                        for j in range(width):
                            term[i, j] = work[i, j]
                            Phi[i, j] += term[i, j]
                for i in range(n):
                    for j in range(n):
                        if i < width:
                            value = 0.0
                            for m in range(width):
                                value += Phi[i, m] * P[m, j]
                            W[i, j] = value
                        else:
                            W[i, j] = P[i, j] * (current_decay if i < n - 1 else 1.0)
                for i in range(n):
                    for j in range(i + 1):
                        if j < width:
                            value = 0.0
                            for m in range(width):
                                value += W[i, m] * Phi[j, m]
                        else:
                            value = W[i, j] * (current_decay if j < n - 1 else 1.0)
                        P[i, j] = value
                        P[j, i] = value
                x[n - 3] *= current_decay
                x[n - 2] *= current_decay
                for i in (n - 3, n - 2):
                    if P0[i, i] > 0.0:
                        P[i, i] += q_c * H
                if keep:
                    # Phi of all substeps together
                    for j in range(n):
                        for i in range(width):
                            value = 0.0
                            for m in range(width):
                                value += Phi[i, m] * moved[k, m, j]
                            va[i] = value
                        for i in range(width):
                            moved[k, i, j] = va[i]
                        moved[k, n - 3, j] *= current_decay
                        moved[k, n - 2, j] *= current_decay
                # process noise: of F, M, the effects' own states, and the rudder's error
                for source in range(3 + width - N_BEFORE):
                    for i in range(width):
                        w[i] = 0.0
                    if source == 0:
                        q = q_F
                        w[F] = 1.0
                    elif source == 1:
                        q = q_M if has_M else 0.0
                        w[M] = 1.0
                    elif source == 2:
                        q = rudder_noise[k] ** 2
                        square = U * U
                        w[V], w[R] = hull[4] * square, hull[5] * square
                    else:
                        q = extra[source - 3]
                        w[N_BEFORE + source - 3] = 1.0
                    if q <= 0.0:
                        continue
                    _series(A, w, H, nodes, width, va, vb)
                    for node in range(3):
                        weight = q * H * simpson[node]
                        for i in range(width):
                            for j in range(width):
                                P[i, j] += weight * nodes[node, i] * nodes[node, j]
        if keep:
            before[k] = P
        if states.shape[0] > 0 and keep:
            spread[k] = x
        # linearised once, where the prediction stands; one measurement after the other moves on from there
        row = inputs[ROWS * k]
        _dynamics(x, row, ship, width, programs, code, constants, values, slopes, stack, total, k1, J)
        for i in range(n):
            stood[i] = x[i]
        if programs.shape[0] > 0:
            values[VDOT], values[RDOT] = k1[V], k1[R]
            for j in range(width):
                slopes[VDOT, j], slopes[RDOT, j] = J[V, j], J[R, j]
        for channel in range(3):
            late = offset_s[k, channel]
            for i in range(n):
                h[i] = 0.0
            state = (V, R, PSI)[channel]
            h[state] = 1.0
            value = stood[state] + late * k1[state]
            for j in range(width):
                h[j] += late * J[state, j]
            if channel == 0:
                h[n - 3], h[n - 2] = current_row[k, 0], current_row[k, 1]
                value += h[n - 3] * stood[n - 3] + h[n - 2] * stood[n - 2]
            elif channel == 1:
                h[n - 1] = 1.0
                value += stood[n - 1]
            if programs.shape[0] > 0:
                total[:] = 0.0
                _add(ON_LATERAL + channel, 0, programs, code, constants, values, slopes, stack, width, total)
                value += total[0]
                for j in range(width):
                    h[j] += total[j + 1]
            for i in range(n):
                value += h[i] * (x[i] - stood[i])
            S = levels[3 + channel] ** 2
            for i in range(n):
                value_i = 0.0
                for j in range(n):
                    value_i += P[i, j] * h[j]
                gain[i] = value_i
                S += h[i] * value_i
            predicted[k, channel], variance[k, channel] = value, S
            if not np.isfinite(value):
                return -np.inf
            if np.isnan(measured[k, channel]):
                continue
            if not (S > 0.0):
                return -np.inf
            if withheld[k]:
                continue
            e = measured[k, channel] - value
            log_likelihood -= 0.5 * (_LOG_2PI + np.log(S) + e * e / S)
            for i in range(n):
                x[i] += gain[i] * e / S
            for i in range(n):
                for j in range(i + 1):
                    value_i = P[i, j] - gain[i] * gain[j] / S
                    P[i, j] = value_i
                    P[j, i] = value_i
        if states.shape[0] > 0:
            states[k] = x
            if not keep:
                for i in range(n):
                    spread[k, i] = P[i, i]
        if keep:
            after[k] = P
    return log_likelihood
