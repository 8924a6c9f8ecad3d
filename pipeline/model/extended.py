"""The extended Kalman filter of eq. (16) with effects: one pass over one run, compiled.

State x = (v, r, psi, F, M, m_1 .. m_k, c_1, c_2, b): the chain, the states that effects bring along, the current to the
north and east (or the paper's V_T), the bias of the rate gyro. Between measurements the mean moves by the classical
fourth-order Runge-Kutta rule with the terms of every effect in it, the covariance by the linearisation at the middle of
the step (Jazwinski 1970, "Stochastic Processes and Filtering Theory", ch. 8; the exact exponential's series to the
fourth order). A measurement off the grid by a moment is predicted there to first order in that moment.

It shares nothing with `pipeline.identify.kernel` but eq. (16), and without effects agrees with it: a test holds that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.compiled import njit
from pipeline.model.moments import add_noise, carry_covariance, exponential, take_in
from pipeline.model.terms.program import DEPTH, evaluate
from pipeline.model.terms.symbols import SYMBOLS

#: how what runs at every instant is compiled: put into its caller, and without counting references to arrays, which
#: takes longer than the arithmetic; such a function may fill arrays but not make them
STEP: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "forceinline": True, "_nrt": False}
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


@njit(**STEP)
def _add(kind, place, programs, code, constants, values, slopes, stack, width, total):  # type: ignore[no-untyped-def]
    """Add every program of a kind (and place, for extra states) to ``total``, shape (1 + width,)."""
    for p in range(programs.shape[0]):
        if programs[p, 0] == kind and programs[p, 1] == place:
            evaluate(code[programs[p, 2] : programs[p, 3]], constants, values, slopes, stack, width)
            for j in range(width + 1):
                total[j] += stack[0, j]


@njit(**STEP)
def _dynamics(  # type: ignore[no-untyped-def]
    x, row, ship, width, carried, programs, code, constants, values, slopes, stack, total, f, J
):
    """Fill f = dx/dt of chain and effects' states, shape (width,), and its derivatives J, shape (width, width).

    ``carried`` is ``width``, or 0 where J is not wanted.
    """
    a11, a12, a21, a22, b1, b2, arm, mu_F, mu_M, exponent, V0 = ship
    for i in range(width):
        values[i] = x[i]
    for i in range(N_INPUT - 2):
        values[CHANNEL + i] = row[2 + i]
    busy = programs.shape[0] > 0
    values[SPEED], values[DELTA] = row[0], row[1]
    for j in range(carried):
        slopes[SPEED, j] = slopes[DELTA, j] = 0.0
    if busy:
        for kind in range(2):
            where = SPEED if kind == 0 else DELTA
            total[:] = 0.0
            _add(kind, 0, programs, code, constants, values, slopes, stack, carried, total)
            values[where] += total[0]
            for j in range(carried):
                slopes[where, j] = total[j + 1]
    U, delta = values[SPEED], values[DELTA]
    square = U * U if exponent == 2.0 else U * abs(U / V0) ** (exponent - 1.0) * V0
    v, r = x[V], x[R]
    f[V] = a11 * U * v + a12 * U * r + b1 * square * delta + x[F]
    f[R] = a21 * U * v + a22 * U * r + b2 * square * delta + arm * x[F] + x[M]
    f[PSI], f[F], f[M] = r, -mu_F * x[F], -mu_M * x[M]
    if carried > 0:
        for i in range(width):
            for j in range(width):
                J[i, j] = 0.0
        J[V, V], J[V, R], J[V, F] = a11 * U, a12 * U, 1.0
        J[R, V], J[R, R], J[R, F], J[R, M] = a21 * U, a22 * U, arm, 1.0
        J[PSI, R], J[F, F], J[M, M] = 1.0, -mu_F, -mu_M
        for j in range(width):
            J[V, j] += b1 * square * slopes[DELTA, j]
            J[R, j] += b2 * square * slopes[DELTA, j]
    if busy:
        for kind in range(2 + width - N_BEFORE):
            target = kind if kind < 2 else N_BEFORE + kind - 2
            on, place = (ON_SWAY + kind, 0) if kind < 2 else (ON_EXTRA, kind - 2)
            total[:] = 0.0
            _add(on, place, programs, code, constants, values, slopes, stack, carried, total)
            f[target] = total[0] + (f[target] if kind < 2 else 0.0)
            for j in range(carried):
                J[target, j] += total[j + 1]


@njit(**STEP)
def _begin(P, programs, code, constants, values, slopes, stack, total, extra):  # type: ignore[no-untyped-def]
    """Add the initial variance of the effects' own states to P, and fill the intensities of what drives them."""
    width = P.shape[0] - N_AFTER
    for i in range(width - N_BEFORE):
        total[:] = 0.0
        _add(ON_INITIAL, i, programs, code, constants, values, slopes, stack, width, total)
        P[N_BEFORE + i, N_BEFORE + i] += total[0] ** 2
        total[:] = 0.0
        _add(ON_NOISE, i, programs, code, constants, values, slopes, stack, width, total)
        extra[i] = total[0] ** 2


@njit(cache=True, nogil=True, error_model="numpy")
def _live_states(P0, width):  # type: ignore[no-untyped-def]
    """Return the states of the chain and of effects that there are, and those after them."""
    before, after = np.empty(width, dtype=np.int64), np.empty(N_AFTER, dtype=np.int64)
    m = k = 0
    for i in range(P0.shape[0]):
        if i < width and (i <= PSI or i >= N_BEFORE or P0[i, i] > 0.0):
            before[m] = i
            m += 1
        elif i >= width and P0[i, i] > 0.0:
            after[k] = i
            k += 1
    return before[:m], after[:k]


@njit(**STEP)
def _substep(  # type: ignore[no-untyped-def]
    x, P, start, middle, end, h, drive, decay, ship, live, after, table, values, slopes, stack, total, room
):
    """Move mean and covariance over one substep.

    ``drive`` holds the intensities squared of F, of M, of the rudder's error, of the current, then of effects' states.
    """
    programs, code, constants = table
    k1, k2, k3, k4, xs, A, J, Phi, term, work, nodes, w, va, vb, W = room
    width = k1.size
    _dynamics(x, start, ship, width, 0, programs, code, constants, values, slopes, stack, total, k1, J)
    for i in range(width):
        xs[i] = x[i] + 0.5 * h * k1[i]
    _dynamics(xs, middle, ship, width, 0, programs, code, constants, values, slopes, stack, total, k2, J)
    for i in range(width):
        xs[i] = x[i] + 0.5 * h * k2[i]
    _dynamics(xs, middle, ship, width, width, programs, code, constants, values, slopes, stack, total, k3, A)
    U = values[SPEED]
    for i in range(width):
        xs[i] = x[i] + h * k3[i]
    _dynamics(xs, end, ship, width, 0, programs, code, constants, values, slopes, stack, total, k4, J)
    for i in range(width):
        x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    for i in after:
        x[i] *= decay[i]
    exponential(A, h, live, Phi, term, work)
    carry_covariance(P, Phi, decay, live, after, W)
    for i in after:
        if i < x.size - 1:
            P[i, i] += drive[3] * h
    for source in range(3 + width - N_BEFORE):
        q = drive[source] if source < 3 else drive[source + 1]
        if q <= 0.0:
            continue
        for i in range(width):
            w[i] = 0.0
        if source == 2:
            w[V], w[R] = ship[4] * U * U, ship[5] * U * U
        else:
            w[(F, M)[source] if source < 2 else N_BEFORE + source - 3] = 1.0
        add_noise(P, A, w, q, h, live, nodes, va, vb)


@njit(**STEP)
def _measurements(  # type: ignore[no-untyped-def]
    k,
    x,
    P,
    row,
    measured,
    offset_s,
    withheld,
    current_row,
    levels,
    ship,
    table,
    values,
    slopes,
    stack,
    total,
    room,
    predicted,
    variance,
    log_likelihood,
):
    """Predict the measurements of instant ``k``, take them in, and return the log-likelihood with theirs in it."""
    programs, code, constants = table
    k1, J, gain, h, stood = room
    n, width = x.size, k1.size
    # linearised once, where the prediction stands; one measurement after the other moves on from there
    _dynamics(x, row, ship, width, width, programs, code, constants, values, slopes, stack, total, k1, J)
    for i in range(n):
        stood[i] = x[i]
    values[VDOT], values[RDOT] = k1[V], k1[R]
    for j in range(width):
        slopes[VDOT, j], slopes[RDOT, j] = J[V, j], J[R, j]
    for channel in range(3):
        late, state = offset_s[channel], (V, R, PSI)[channel]
        value = stood[state] + late * k1[state]
        for j in range(n):
            h[j] = late * J[state, j] if j < width else 0.0
        h[state] += 1.0
        if channel == 0:
            h[n - 3], h[n - 2] = current_row[0], current_row[1]
            value += h[n - 3] * stood[n - 3] + h[n - 2] * stood[n - 2]
        elif channel == 1:
            h[n - 1] = 1.0
            value += stood[n - 1]
        total[:] = 0.0
        _add(ON_LATERAL + channel, 0, programs, code, constants, values, slopes, stack, width, total)
        value += total[0]
        for j in range(width):
            h[j] += total[j + 1]
        S = levels[3 + channel] ** 2
        for i in range(n):
            gain[i] = 0.0
            for j in range(n):
                gain[i] += P[i, j] * h[j]
            value += h[i] * (x[i] - stood[i])
            S += h[i] * gain[i]
        predicted[k, channel], variance[k, channel] = value, S
        if not np.isfinite(value):
            return -np.inf
        if np.isnan(measured[channel]):
            continue
        if not (S > 0.0):
            return -np.inf
        if not withheld:
            e = measured[channel] - value
            log_likelihood -= 0.5 * (_LOG_2PI + np.log(S) + e * e / S)
            take_in(x, P, h, e, S, gain)
    return log_likelihood


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
        ``predicted`` and ``variance``, shape (n, 3), to be filled; ``states`` and ``spread``, shape (n, 8 + k), the
        filtered states and their variances, or 0 rows.

    Returns
    -------
    float
        Log-likelihood; -inf where the filter runs away.
    """
    programs, code, constants = table
    predicted, variance, states, spread = kept
    n, width = x0.size, x0.size - N_AFTER
    x, P = x0.copy(), P0.copy()
    arm, length, draught, V0, n0, exponent = constants_of_ship
    ship = (hull[0], hull[1], hull[2], hull[3], hull[4], hull[5], arm, rates[0], rates[1], exponent, V0)
    values, slopes = np.zeros(PARAMETER + parameters.size), np.zeros((PARAMETER + parameters.size, width))
    values[SHIP : SHIP + 6] = hull
    values[SHIP + 6], values[SHIP + 7], values[SHIP + 8], values[SHIP + 9] = length, draught, V0, n0
    values[PARAMETER:], values[SPEED] = parameters, inputs[0, 0]
    for i in range(width):
        slopes[i, i] = 1.0
    stack, total, extra = np.zeros((DEPTH, width + 1)), np.zeros(width + 1), np.zeros(width - N_BEFORE)
    live, after = _live_states(P0, width)
    _begin(P, programs, code, constants, values, slopes, stack, total, extra)
    k1, J = np.zeros(width), np.zeros((width, width))
    room = (
        *(k1, np.zeros(width), np.zeros(width), np.zeros(width), np.zeros(width), np.zeros((width, width)), J),
        *(np.zeros((width, width)), np.zeros((width, width)), np.zeros((width, width)), np.zeros((3, width))),
        *(np.zeros(width), np.zeros(width), np.zeros(width), np.zeros((n, n))),
    )
    gain, h, stood, decay, drive = np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n), np.zeros(4 + width - N_BEFORE)
    decay[n - 3 : n - 1] = np.exp(-rates[2] * step_s / SUBSTEPS)
    drive[0], drive[3], drive[4:] = levels[0] ** 2, levels[2] ** 2, extra
    drive[1] = levels[1] ** 2 if P0[M, M] > 0.0 else 0.0
    log_likelihood = 0.0
    for k in range(measured.shape[0]):
        if k > 0:
            drive[2] = rudder_noise[k] ** 2
            for sub in range(SUBSTEPS):
                i = ROWS * (k - 1) + 2 * sub
                _substep(
                    *(x, P, inputs[i], inputs[i + 1], inputs[i + 2], step_s / SUBSTEPS, drive, decay, ship),
                    *(live, after, table, values, slopes, stack, total, room),
                )
        log_likelihood = _measurements(
            *(k, x, P, inputs[ROWS * k], measured[k], offset_s[k], withheld[k], current_row[k], levels, ship),
            *(table, values, slopes, stack, total, (k1, J, gain, h, stood), predicted, variance, log_likelihood),
        )
        if log_likelihood == -np.inf:
            return -np.inf
        if states.shape[0] > 0:
            states[k] = x
            for i in range(n):
                spread[k, i] = P[i, i]
    return log_likelihood
