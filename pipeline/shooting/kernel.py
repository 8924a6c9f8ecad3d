"""A ship let run over windows of a manoeuvre, several sets of parameters at once, compiled.

Equation (16) with effects, without noise and without covariance: between instants the mean moves by the classical
fourth-order Runge-Kutta rule from the state at which each window begins. Steps are whole (decision 0051), where the
extended filter takes two (`kempf.pipeline.estimate.filters.ekf`). Sets of parameters stand in lanes
(`kempf.pipeline.model.batch`).
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, njit
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.chain import PSI, R, V
from kempf.pipeline.model.dynamics import (
    N_AFTER,
    ON_LATERAL,
    SPEED,
    add_programs,
    asks_for_jerk,
    dynamics,
    measured_by,
    room_of,
)
from kempf.pipeline.model.lanes import at, put

#: rows of the inputs over half a step
HALF = ROWS // 2


@njit(**FILLING)
def _step(x, rows, rudders, h, ship, table, values, slopes, stack, by, total, room, lanes):  # type: ignore[no-untyped-def]
    """Move the means over one step; ``k1``, their slopes at its beginning, is there already."""
    k1, k2, k3, k4, xs, J = room
    width = k1.shape[0]
    for i in range(width):
        put(xs, i, at(x, i, lanes) + 0.5 * h * at(k1, i, lanes), lanes)
    dynamics(xs, rows[1], rudders[1], ship, table, values, slopes, stack, by, total, k2, J, lanes)
    for i in range(width):
        put(xs, i, at(x, i, lanes) + 0.5 * h * at(k2, i, lanes), lanes)
    dynamics(xs, rows[1], rudders[1], ship, table, values, slopes, stack, by, total, k3, J, lanes)
    for i in range(width):
        put(xs, i, at(x, i, lanes) + h * at(k3, i, lanes), lanes)
    dynamics(xs, rows[2], rudders[2], ship, table, values, slopes, stack, by, total, k4, J, lanes)
    for i in range(width):
        middle = at(k1, i, lanes) + 2.0 * at(k2, i, lanes) + 2.0 * at(k3, i, lanes) + at(k4, i, lanes)
        put(x, i, at(x, i, lanes) + h / 6.0 * middle, lanes)


@njit(**FILLING)
def _measured(  # type: ignore[no-untyped-def]
    x,
    rows,
    rudders,
    step_s,
    jerky,
    offset_s,
    current_row,
    ship,
    table,
    values,
    slopes,
    stack,
    by,
    total,
    room,
    out,
    lanes,
):
    """Fill ``out``, shape (3, lanes), with what would be measured at one instant."""
    k1, k2, k3, _, _, J = room
    n = x.shape[0]
    measured_by(
        *(x, rows[-1], rudders[-1], step_s, rows[0], rudders[0], jerky, ship),
        *(table, values, slopes, stack, by, total, (k2, k3), k1, J, lanes),
    )
    for channel in range(3):
        state, late = (V, R, PSI)[channel], offset_s[channel]
        shown = at(x, state, lanes) + late * at(k1, state, lanes)
        if channel == 0:
            shown += current_row[0] * at(x, n - 3, lanes) + current_row[1] * at(x, n - 2, lanes)
        elif channel == 1:
            shown += at(x, n - 1, lanes)
        if add_programs(ON_LATERAL + channel, table, values, slopes, stack, by, total[:1], lanes):
            shown += at(total, 0, lanes)
        put(out, channel, shown, lanes)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def shoot(  # type: ignore[no-untyped-def]
    hull,
    parameters,
    step_s,
    inputs,
    rudder,
    offset_s,
    current_row,
    constants_of_ship,
    begins,
    ends,
    starts,
    table,
    predicted,
    lanes,
):
    """Let a ship run over windows of one run; what would be measured goes to ``predicted``.

    Parameters
    ----------
    hull : ndarray, shape (6, lanes)
        a11, a12, a21, a22, b1, b2.
    parameters : ndarray, shape (p, lanes)
        Of the effects, in the order of their programs' variables.
    step_s, inputs, rudder, offset_s, current_row, constants_of_ship, table, lanes
        See `kempf.pipeline.estimate.filters.ekf.extended`.
    begins, ends : ndarray of int, shape (w,)
        First and last instant of every window.
    starts : ndarray, shape (w, 9 + k, lanes)
        State at the beginning of every window.
    predicted : ndarray, shape (m, 3, lanes)
        To be filled, window after window, m their instants.
    """
    size, width, B = starts.shape[1], starts.shape[1] - N_AFTER, each(lanes)
    ship, values, slopes, stack, by, total = room_of(hull, parameters, constants_of_ship, (0.0, 0.0, 0.0), width)
    values[SPEED] = inputs[0, 0]
    # no derivatives
    J, x = np.zeros((0, width, B)), np.zeros((size, B))
    k1, k2, k3, k4, xs = (
        np.zeros((width, B)),
        np.zeros((width, B)),
        np.zeros((width, B)),
        np.zeros((width, B)),
        np.zeros((width, B)),
    )
    room = (k1, k2, k3, k4, xs, J)
    row, jerky = 0, asks_for_jerk(table)
    for w in range(begins.shape[0]):
        x[:] = starts[w]
        for k in range(begins[w], ends[w] + 1):
            if k > begins[w]:
                i, end = ROWS * (k - 1), ROWS * k + 1
                _step(
                    *(x, inputs[i:end:HALF], rudder[i:end:HALF], step_s, ship),
                    *(table, values, slopes, stack, by, total, room, lanes),
                )
            here, earlier = ROWS * k + 1, max(ROWS * (k - 1), 0)
            _measured(
                *(x, inputs[earlier:here], rudder[earlier:here], step_s, jerky, offset_s[k], current_row[k], ship),
                *(table, values, slopes, stack, by, total, room, predicted[row], lanes),
            )
            row += 1
