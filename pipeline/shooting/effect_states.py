"""The states of effects along the motion that was measured: where they stand when a window begins, compiled.

A window begins with the drift and the yaw rate that were measured there. What an effect remembers was not measured: a
flow around the hull that takes lengths to settle, the speed that the turn before has cost. Begun at nothing in every
window, a memory as long as a leg would be as good as none, and its effect on the hull would go to the hull. So these
states are led from the beginning of the manoeuvre along the measured course.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import njit
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.chain import PSI, F, M, R, V
from kempf.pipeline.model.dynamics import N_BEFORE, SPEED, dynamics, room_of
from kempf.pipeline.model.lanes import at, put


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def integrate_effect_states(  # type: ignore[no-untyped-def]
    hull, parameters, step_s, inputs, rudder, current_row, constants_of_ship, course, own, table, states, lanes
):
    """Fill ``states`` with the effects' own at every instant of a run, by Heun's rule from nothing at its first.

    Parameters
    ----------
    hull, parameters, step_s, inputs, rudder, current_row, constants_of_ship, table, lanes
        See `kempf.pipeline.shooting.kernel.shoot`.
    course : ndarray, shape (n, 3)
        Lateral speed with the current in it, m/s, yaw rate with the bias of the gyro in it, rad/s, and heading, rad, at
        the instants.
    own : ndarray, shape (5, lanes)
        Constant F, M, both parts of the current and the bias.
    states : ndarray, shape (n, k, lanes)
        To be filled.
    """
    k, B = states.shape[1], each(lanes)
    width = N_BEFORE + k
    ship, values, slopes, stack, by, total = room_of(hull, parameters, constants_of_ship, (0.0, 0.0, 0.0), width)
    values[SPEED] = inputs[0, 0]
    J, x = np.zeros((0, width, B)), np.zeros((width, B))
    before, after = np.zeros((width, B)), np.zeros((width, B))
    x[F], x[M] = own[0], own[1]
    states[0] = 0.0
    for i in range(course.shape[0]):
        x[V] = course[i, 0] - current_row[i, 0] * own[2] - current_row[i, 1] * own[3]
        x[R], x[PSI] = course[i, 1] - own[4], course[i, 2]
        if i > 0:
            # where the slope before leads, and half of what the slope there is more than that
            for j in range(N_BEFORE, width):
                put(x, j, at(states[i - 1], j - N_BEFORE, lanes) + step_s * at(before, j, lanes), lanes)
            dynamics(
                *(x, inputs[ROWS * i], rudder[ROWS * i], ship, table, values, slopes, stack, by, total, after, J),
                lanes,
            )
            for j in range(N_BEFORE, width):
                more = at(after, j, lanes) - at(before, j, lanes)
                put(x, j, at(x, j, lanes) + 0.5 * step_s * more, lanes)
        states[i] = x[N_BEFORE:]
        dynamics(
            *(x, inputs[ROWS * i], rudder[ROWS * i], ship, table, values, slopes, stack, by, total, before, J),
            lanes,
        )
