"""The extended Kalman filter of eq. (16) with effects: one pass over one run, compiled.

State x = (v, r, psi, F, M, e, m_1 .. m_k, c_1, c_2, b): the chain, the error of the speed
(`kempf.pipeline.estimate.record.speed_error`), the states that effects bring along, the current to the north and east
(or the paper's V_T), the bias of the rate gyro. Between measurements the mean
moves by the classical fourth-order Runge-Kutta rule with the terms of every effect in it, in two substeps, and the
covariance in one by the linearisation at the middle of the step (Jazwinski 1970, "Stochastic Processes and Filtering
Theory", ch. 8). A measurement off the grid by a moment is predicted there to first order in that moment.

Several sets of parameters go through one run side by side, in lanes (`kempf.pipeline.model.batch`): a derivative is the
difference of two passes, and a fit asks for a dozen at a time.

It shares nothing with `pipeline.estimate.filters.linear_kernel` but eq. (16), and without effects agrees with it: a
test holds that.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, STEP, njit
from kempf.pipeline.estimate.filters.ekf_covariance import (
    add_at_once,
    add_from_middle,
    carry_covariance,
    couplings,
    exponential,
    mirror,
    take_in,
)
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.chain import PSI, F, M, R, V
from kempf.pipeline.model.dynamics import (
    N_AFTER,
    N_BEFORE,
    ON_INITIAL,
    ON_LATERAL,
    ON_NOISE,
    SPEED,
    E,
    add_programs,
    asks_for_jerk,
    dynamics,
    measured_by,
    room_of,
)
from kempf.pipeline.model.lanes import at, everywhere, put

#: rows of the input table from one instant to the next, and substeps; a substep reads three rows
ROWS, SUBSTEPS = 4, 2
_LOG_2PI = float(np.log(2.0 * np.pi))


@njit(**FILLING)
def _begin(P, table, values, slopes, stack, by, total, drive, lanes):  # type: ignore[no-untyped-def]
    """Add the initial variance of the effects' own states to P, and fill the intensities of what drives them."""
    width = P.shape[0] - N_AFTER
    for i in range(width - N_BEFORE):
        add_programs(ON_INITIAL + i, table, values, slopes, stack, by, total[:1], lanes)
        own, std = (N_BEFORE + i, N_BEFORE + i), at(total, 0, lanes)
        put(P, own, at(P, own, lanes) + std * std, lanes)
        add_programs(ON_NOISE + i, table, values, slopes, stack, by, total[:1], lanes)
        intensity = at(total, 0, lanes)
        put(drive, 5 + i, intensity * intensity, lanes)


@njit(cache=True, nogil=True, error_model="numpy")
def _live_states(P0, width):  # type: ignore[no-untyped-def]
    """Return the states of the chain and of effects that there are, and those after them."""
    before, after = np.empty(width, dtype=np.uint64), np.empty(N_AFTER, dtype=np.uint64)
    m = k = 0
    for i in range(P0.shape[0]):
        if i < width and (i <= PSI or i >= N_BEFORE or P0[i, i] > 0.0):
            before[m] = i
            m += 1
        elif i >= width and P0[i, i] > 0.0:
            after[k] = i
            k += 1
    return before[:m], after[:k]


@njit(**FILLING)
def _substep(  # type: ignore[no-untyped-def]
    x, rows, rudders, h, ship, live, linearised, table, values, slopes, stack, by, total, room, lanes
):
    """Move means over one substep; with ``linearised`` the equations and the rudder's work are kept where it begins."""
    k1, k2, k3, k4, xs, A, w = room
    width = k1.shape[0] if linearised else 0
    dynamics(x, rows[0], rudders[0], ship, table, values, slopes, stack, by, total, k1, A[:width], lanes)
    if linearised:
        # what a unit of rudder does
        speed = at(values, SPEED, lanes)
        put(w, V, at(ship[0], 4, lanes) * (speed * speed), lanes)
        put(w, R, at(ship[0], 5, lanes) * (speed * speed), lanes)
    for i in live:
        put(xs, i, at(x, i, lanes) + 0.5 * h * at(k1, i, lanes), lanes)
    dynamics(xs, rows[1], rudders[1], ship, table, values, slopes, stack, by, total, k2, A[:0], lanes)
    for i in live:
        put(xs, i, at(x, i, lanes) + 0.5 * h * at(k2, i, lanes), lanes)
    dynamics(xs, rows[1], rudders[1], ship, table, values, slopes, stack, by, total, k3, A[:0], lanes)
    for i in live:
        put(xs, i, at(x, i, lanes) + h * at(k3, i, lanes), lanes)
    dynamics(xs, rows[2], rudders[2], ship, table, values, slopes, stack, by, total, k4, A[:0], lanes)
    for i in live:
        middle = at(k1, i, lanes) + 2.0 * at(k2, i, lanes) + 2.0 * at(k3, i, lanes) + at(k4, i, lanes)
        put(x, i, at(x, i, lanes) + h / 6.0 * middle, lanes)


@njit(**FILLING)
def _noise_at_once(P, w, h, drive, driven, lanes):  # type: ignore[no-untyped-def]
    """Add to P the noise that comes in during h seconds, as if at this instant."""
    if driven[2]:
        for i in (V, R):
            for j in (V, R):
                add_at_once(P, i, j, drive[2], h, w, lanes)
    for turn in range(driven.shape[0] - 2):
        source, state = _source(turn)
        if driven[source]:
            add_at_once(P, state, state, drive[source], h, w, lanes)


@njit(**STEP)
def _source(turn):  # type: ignore[no-untyped-def]
    """Return the row of ``drive`` and the state that it drives: F, M, the speed's error, states of effects."""
    if turn < 3:
        return (0, 1, 4)[turn], (F, M, E)[turn]
    return turn + 2, N_BEFORE + turn - 3


@njit(**FILLING)
def _spread(P, A, w, h, drive, driven, decay, live, after, room, lanes):  # type: ignore[no-untyped-def]
    """Move covariances over one step, linearised at its middle.

    ``drive`` holds the intensities squared of F, M, the rudder's error, the current, e, then of effects' states;
    ``driven`` which of them there are in any lane.
    """
    Half, Phi, term, work, W, along, direct, reached = room
    couplings(A, live, direct, reached, lanes)
    exponential(A, h, live, direct, reached, Half, Phi, term, work, lanes)
    _noise_at_once(P, w, h / 6.0, drive, driven, lanes)
    carry_covariance(P, Phi, decay, live, after, W, reached, lanes)
    for i in after[: after.size - (after.size > 0 and after[after.size - 1] == P.shape[0] - 1)]:
        put(P, (i, i), at(P, (i, i), lanes) + at(drive, 3, lanes) * h, lanes)
    if driven[2]:
        add_from_middle(P, Half, reached, drive[2], 4.0 * h / 6.0, w, (V, R), live, along, lanes)
    for turn in range(driven.shape[0] - 2):
        source, state = _source(turn)
        if driven[source]:
            add_from_middle(P, Half, reached, drive[source], 4.0 * h / 6.0, w, (state,), live, along, lanes)
    mirror(P, live, lanes)
    _noise_at_once(P, w, h / 6.0, drive, driven, lanes)


@njit(**FILLING)
def _measurements(  # type: ignore[no-untyped-def]
    k,
    x,
    P,
    rows,
    rudders,
    step_s,
    jerky,
    measured,
    offset_s,
    withheld,
    current_row,
    levels,
    ship,
    states,
    table,
    values,
    slopes,
    stack,
    by,
    total,
    room,
    predicted,
    variance,
    log_likelihood,
    lanes,
):
    """Predict the measurements of instant ``k``, take them in, and add theirs to the log-likelihoods."""
    k1, J, gain, h, stood, value, S, jerk = room
    n, width = x.shape[0], k1.shape[0]
    # linearised once, where the prediction stands; one measurement after the other moves on from there
    measured_by(
        *(x, rows[-1], rudders[-1], step_s, rows[0], rudders[0], jerky, ship),
        *(table, values, slopes, stack, by, total, jerk, k1, J, lanes),
    )
    for i in range(n):
        put(stood, i, at(x, i, lanes), lanes)
    for channel in range(3):
        late, state = offset_s[channel], (V, R, PSI)[channel]
        mean = at(stood, state, lanes) + late * at(k1, state, lanes)
        for j in range(n):
            put(h, j, late * at(J, (state, j), lanes) if j < width else everywhere(0.0, lanes), lanes)
        put(h, state, at(h, state, lanes) + 1.0, lanes)
        if channel == 0:
            put(h, n - 3, current_row[0], lanes)
            put(h, n - 2, current_row[1], lanes)
            mean += current_row[0] * at(stood, n - 3, lanes) + current_row[1] * at(stood, n - 2, lanes)
        elif channel == 1:
            put(h, n - 1, 1.0, lanes)
            mean += at(stood, n - 1, lanes)
        if add_programs(ON_LATERAL + channel, table, values, slopes, stack, by, total, lanes):
            mean += at(total, 0, lanes)
            for j in range(width):
                put(h, j, at(h, j, lanes) + at(total, j + 1, lanes), lanes)
        std = at(levels, 3 + channel, lanes)
        spread = std * std
        for i in states:
            covariance = everywhere(0.0, lanes)
            for j in states:
                covariance += at(P, (i, j), lanes) * at(h, j, lanes)
            put(gain, i, covariance, lanes)
            mean += at(h, i, lanes) * (at(x, i, lanes) - at(stood, i, lanes))
            spread += at(h, i, lanes) * covariance
        put(value, (), mean, lanes)
        put(S, (), spread, lanes)
        put(predicted, (k, channel), mean, lanes)
        put(variance, (k, channel), spread, lanes)
        made = not np.isnan(measured[channel])
        for b in range(each(lanes)):
            if not np.isfinite(value[b]) or (made and not (S[b] > 0.0)):
                log_likelihood[b] = -np.inf
        if made and not withheld:
            for b in range(each(lanes)):
                e, precision = measured[channel] - value[b], 1.0 / S[b]
                # a lane that ran away stays there: what is added is no number, or changes nothing
                log_likelihood[b] -= 0.5 * (_LOG_2PI + np.log(S[b]) + e * e * precision)
                value[b], S[b] = e, precision
            take_in(x, P, value, S, gain, states, lanes)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def extended(  # type: ignore[no-untyped-def]
    hull,
    levels,
    parameters,
    step_s,
    inputs,
    rudder,
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
    lanes,
):
    """Run the filter over one run, for several sets of parameters.

    Parameters
    ----------
    hull : ndarray, shape (6, lanes)
        a11, a12, a21, a22, b1, b2.
    levels : ndarray, shape (6, lanes)
        Intensities of what drives F, m/s^2 per sqrt s, M, and the current, and standard deviations of the three
        measurements.
    parameters : ndarray, shape (p, lanes)
        Of the effects, in the order of their programs' variables.
    step_s : float
        From one instant to the next.
    inputs : ndarray, shape (ROWS (n - 1) + 1, N_INPUT)
        V, m/s, delta as it was measured, then the symbols of channels and run, and the rudder that a unit of the
        speed's error does the work of, rad s/m; at a quarter of the step.
    rudder : ndarray, shape (ROWS (n - 1) + 1, lanes)
        delta, rad, at the same instants, as the effects have it.
    rudder_noise : ndarray, shape (n,)
        Intensity of the rudder's error before each instant, rad s^0.5.
    measured : ndarray, shape (n, 3)
        y_v, y_r, y_psi, NaN where there is none.
    offset_s : ndarray, shape (n, 3)
        How much later than the instant each was measured.
    withheld : ndarray of bool, shape (n,)
        Instants whose measurements are predicted and not taken in.
    current_row : ndarray, shape (n, 2)
    constants_of_ship : ndarray, shape (7,)
        l, L, T, V0, n0, the exponent of V in the rudder's force and the speed of the approach that it goes by.
    rates : ndarray, shape (4,)
        Correlation rates of F, M, the current and the speed's error, 1/s.
    x0 : ndarray, shape (9 + k, lanes); P0 : ndarray, shape (9 + k, 9 + k)
        Mean and covariance of the state at the first instant; effects add to those of their own states.
    table : tuple
        See `kempf.pipeline.model.effect_model.EffectModel.table`.
    kept : tuple of ndarray
        ``predicted`` and ``variance``, shape (n, 3, lanes), to be filled; ``states`` and ``spread``,
        shape (n, 9 + k, lanes), the filtered states and their variances, or 0 rows.
    lanes : tuple
        `ONE` or `LANES` of `kempf.pipeline.model.batch`.

    Returns
    -------
    ndarray, shape (lanes,)
        Log-likelihoods; -inf where the filter runs away.
    """
    predicted, variance, states, spread = kept
    n, width, B = P0.shape[0], P0.shape[0] - N_AFTER, each(lanes)
    x, P = x0.copy(), np.zeros((n, n, B))
    for b in range(B):
        P[:, :, b] = P0
    ship, values, slopes, stack, by, total = room_of(
        hull, parameters, constants_of_ship, (rates[0], rates[1], rates[3]), width
    )
    values[SPEED] = inputs[0, 0]
    for i in range(width):
        slopes[i, i] = 1.0
    live, after = _live_states(P0, width)
    there = np.concatenate((live, after))
    drive = np.zeros((5 + width - N_BEFORE, B))
    _begin(P, table, values, slopes, stack, by, total, drive, lanes)
    k1, J = np.zeros((width, B)), np.zeros((width, width, B))
    vector, matrix, pattern = (width, B), (width, width, B), (width, width)
    A, w, state = np.zeros(matrix), np.ones(vector), np.zeros(vector)
    moving = (k1, np.zeros(vector), np.zeros(vector), np.zeros(vector), state, A, w)
    spreading = (
        *(np.zeros(matrix), np.zeros(matrix), np.zeros(matrix), np.zeros(matrix), np.zeros((n, n, B))),
        *(np.zeros(vector), np.zeros(pattern, dtype=np.bool_), np.zeros(pattern, dtype=np.bool_)),
    )
    gain, h, stood, decay = np.zeros((n, B)), np.zeros((n, B)), np.zeros((n, B)), np.ones(n)
    at_measurements = (k1, J, gain, h, stood, np.zeros(B), np.zeros(B), (np.zeros(vector), np.zeros(vector)))
    decay[n - 3 : n - 1] = np.exp(-rates[2] * step_s)
    drive[0], drive[3], drive[4] = levels[0] ** 2, levels[2] ** 2, 2.0 * rates[3] * P0[E, E]
    if P0[M, M] > 0.0:
        drive[1] = levels[1] ** 2
    driven = np.zeros(drive.shape[0], dtype=np.bool_)
    for source in range(drive.shape[0]):
        driven[source] = np.any(drive[source] > 0.0)
    # what does not move acts all the same: a constant force in a free run
    state[:] = x[:width]
    log_likelihood, jerky = np.zeros(B), asks_for_jerk(table)
    for k in range(measured.shape[0]):
        if k > 0:
            drive[2], driven[2] = rudder_noise[k] ** 2, rudder_noise[k] > 0.0
            for sub in range(SUBSTEPS):
                i = ROWS * (k - 1) + 2 * sub
                _substep(
                    *(x, inputs[i : i + 3], rudder[i : i + 3], step_s / SUBSTEPS, ship, live, sub == 1),
                    *(table, values, slopes, stack, by, total, moving, lanes),
                )
            for i in after:
                put(x, i, at(x, i, lanes) * decay[i], lanes)
            _spread(P, A, w, step_s, drive, driven, decay, live, after, spreading, lanes)
        here, earlier = ROWS * k + 1, max(ROWS * (k - 1), 0)
        _measurements(
            *(k, x, P, inputs[earlier:here], rudder[earlier:here], step_s, jerky),
            *(measured[k], offset_s[k], withheld[k], current_row[k]),
            *(
                levels,
                ship,
                there,
                table,
                values,
                slopes,
                stack,
                by,
                total,
                at_measurements,
                predicted,
                variance,
                log_likelihood,
                lanes,
            ),
        )
        if np.all(~np.isfinite(log_likelihood)):
            break
        if states.shape[0] > 0:
            states[k] = x
            for i in range(n):
                spread[k, i] = P[i, i]
    for b in range(B):
        if np.isnan(log_likelihood[b]):
            log_likelihood[b] = -np.inf
    return log_likelihood
