"""What moves the ship of eq. (16) and what effects add to it: dx/dt with its derivatives, compiled.

Everything stands in lanes (`pipeline.model.batch`). Terms of effects are programs (`pipeline.model.terms.program`),
added to what their kind says: to the speed and the rudder that the hull feels, to sway and yaw, to states of their own.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, STEP, njit
from kempf.pipeline.model.chain import N_CHAIN, PSI, F, M, R, V
from kempf.pipeline.model.lanes import at, choose, everywhere, power, put
from kempf.pipeline.model.terms.evaluation import evaluate
from kempf.pipeline.model.terms.program import DEPTH, VARIABLE
from kempf.schemas.symbols import SYMBOLS

#: places of symbols among the variables; states come first, in the filter's order
DELTA, SPEED, VDOT, RDOT = (SYMBOLS.index(name) for name in ("delta", "V", "vdot", "rdot"))
VDDOT, RDDOT = SYMBOLS.index("vddot"), SYMBOLS.index("rddot")
SHIP, CHANNEL, PARAMETER = SYMBOLS.index("a11"), SYMBOLS.index("U"), len(SYMBOLS)
#: columns of the input table: V, delta, the symbols of channels and of the run, and the rudder that does what a unit
#: of the speed's error does
N_INPUT = 2 + PARAMETER - CHANNEL + 1
SPEED_ERROR_GAIN = N_INPUT - 1
#: states before those of effects, and after
E, N_BEFORE, N_AFTER, MOST_EXTRA = N_CHAIN, N_CHAIN + 1, 3, 4
#: what a program is added to; for states of effects the first one's
ON_SPEED, ON_RUDDER, ON_SWAY, ON_YAW, ON_LATERAL, ON_YAW_RATE, ON_HEADING = 0, 1, 2, 3, 4, 5, 6
ON_EXTRA, ON_NOISE, ON_INITIAL = 100, 200, 300


@njit(cache=True, nogil=True, error_model="numpy")
def room_of(hull, parameters, constants_of_ship, rates, width):  # type: ignore[no-untyped-def]
    """Return what `dynamics` needs beside states and inputs: the ship, and room for variables and programs.

    Parameters
    ----------
    hull, parameters : ndarray, shape (6, lanes) and (p, lanes)
        Of eq. (16), and of the effects in the order of their programs' variables.
    constants_of_ship : ndarray, shape (7,)
        l, L, T, V0, n0, the exponent of V in the rudder's force and the speed of the approach that it goes by.
    rates : tuple of float
        Correlation rates of F, M and the speed's error, 1/s.
    width : int
        States of chain and effects.

    Returns
    -------
    ship : tuple
    values, slopes : ndarray, shape (m, lanes) and (m, width, lanes)
        Variables, ship and parameters among them filled, and their derivatives, all 0.
    stack, by, total : ndarray
        For programs.
    """
    arm, length, draught, V0, n0, exponent, approach = constants_of_ship
    m, B = PARAMETER + parameters.shape[0], hull.shape[1]
    values, slopes = np.zeros((m, B)), np.zeros((m, width, B))
    values[SHIP : SHIP + 6] = hull
    values[SHIP + 6], values[SHIP + 7], values[SHIP + 8], values[SHIP + 9] = length, draught, V0, n0
    values[PARAMETER:] = parameters
    stack, by, total = np.zeros((DEPTH, width + 1, B)), np.zeros(B), np.zeros((width + 1, B))
    return (hull, (arm, *rates, exponent, approach)), values, slopes, stack, by, total


@njit(**FILLING)
def add_programs(target, table, values, slopes, stack, by, total, lanes):  # type: ignore[no-untyped-def]
    """Fill ``total``, shape (1 + width, lanes), with the sum of all programs that are added to something.

    With one row it takes no derivatives. Return whether there is any; where there is none nothing is filled.
    """
    programs, code, constants, moving = table
    found = False
    for p in range(programs.shape[0]):
        if programs[p, 0] == target:
            if not found:
                for j in range(total.shape[0]):
                    put(total, j, 0.0, lanes)
            found = True
            columns = moving[programs[p, 3] : programs[p, 4] if total.shape[0] > 1 else programs[p, 3]]
            evaluate(code[programs[p, 1] : programs[p, 2]], constants, columns, values, slopes, stack, by, lanes)
            put(total, 0, at(total, 0, lanes) + at(stack, (0, 0), lanes), lanes)
            for j in columns:
                put(total, j + 1, at(total, j + 1, lanes) + at(stack, (0, j + 1), lanes), lanes)
    return found


@njit(**STEP)
def _square(U, V0, exponent):  # type: ignore[no-untyped-def]
    """Return the speed by which the rudder's force goes, squared."""
    return U * U if exponent == 2.0 else U * power(abs(U / V0), exponent - 1.0) * V0


@njit(**STEP)
def _felt(x, row, rudder, table, values, slopes, stack, by, total, lanes):  # type: ignore[no-untyped-def]
    """Fill the variables, the speed and the rudder among them as effects let the hull feel them."""
    put(values, SPEED, row[0], lanes)
    put(values, DELTA, at(rudder, (), lanes), lanes)
    if table[0].shape[0] == 0:
        return
    for i in range(slopes.shape[1]):
        put(values, i, at(x, i, lanes), lanes)
    for i in range(N_INPUT - 3):
        put(values, CHANNEL + i, row[2 + i], lanes)
    carried = total.shape[0] - 1
    for j in range(carried):
        put(slopes, (SPEED, j), 0.0, lanes)
        put(slopes, (DELTA, j), 0.0, lanes)
    for target, where in ((ON_SPEED, SPEED), (ON_RUDDER, DELTA)):
        if add_programs(target, table, values, slopes, stack, by, total, lanes):
            put(values, where, at(values, where, lanes) + at(total, 0, lanes), lanes)
            for j in range(carried):
                put(slopes, (where, j), at(total, j + 1, lanes), lanes)


@njit(**STEP)
def _add_slopes_of_felt(J, hull, v, r, U, delta, square, exponent, slopes, lanes):  # type: ignore[no-untyped-def]
    """Add what the hull does where effects let the speed or the rudder go with the states."""
    a11, a12, b1 = at(hull, 0, lanes), at(hull, 1, lanes), at(hull, 4, lanes)
    a21, a22, b2 = at(hull, 2, lanes), at(hull, 3, lanes), at(hull, 5, lanes)
    steeper = choose(abs(U), 0.0, 0.0, exponent * square / U)
    sway_by_speed = a11 * v + a12 * r + b1 * steeper * delta
    yaw_by_speed = a21 * v + a22 * r + b2 * steeper * delta
    for j in range(J.shape[0]):
        by_rudder, by_speed = at(slopes, (DELTA, j), lanes), at(slopes, (SPEED, j), lanes)
        sway = at(J, (V, j), lanes) + b1 * square * by_rudder
        yaw = at(J, (R, j), lanes) + b2 * square * by_rudder
        put(J, (V, j), sway + sway_by_speed * by_speed, lanes)
        put(J, (R, j), yaw + yaw_by_speed * by_speed, lanes)


@njit(**FILLING)
def dynamics(x, row, rudder, ship, table, values, slopes, stack, by, total, f, J, lanes):  # type: ignore[no-untyped-def]
    """Fill f = dx/dt of chain and effects' states, shape (width, lanes), and its derivatives J, (width, width, lanes).

    A J of no rows is not wanted.
    """
    hull, (arm, mu_F, mu_M, mu_E, exponent, V0) = ship
    gain, width, carried = row[SPEED_ERROR_GAIN], f.shape[0], J.shape[0]
    busy, total = table[0].shape[0] > 0, total[: 1 + carried]
    _felt(x, row, rudder, table, values, slopes, stack, by, total, lanes)
    a11, a12, b1 = at(hull, 0, lanes), at(hull, 1, lanes), at(hull, 4, lanes)
    a21, a22, b2 = at(hull, 2, lanes), at(hull, 3, lanes), at(hull, 5, lanes)
    U, delta = at(values, SPEED, lanes), at(values, DELTA, lanes) + gain * at(x, E, lanes)
    square = _square(U, V0, exponent)
    v, r, force, moment = at(x, V, lanes), at(x, R, lanes), at(x, F, lanes), at(x, M, lanes)
    put(f, V, a11 * U * v + a12 * U * r + b1 * square * delta + force, lanes)
    put(f, R, a21 * U * v + a22 * U * r + b2 * square * delta + arm * force + moment, lanes)
    put(f, PSI, r, lanes)
    put(f, F, -mu_F * force, lanes)
    put(f, M, -mu_M * moment, lanes)
    put(f, E, -mu_E * at(x, E, lanes), lanes)
    if carried > 0:
        J[:, :, :] = 0.0
        put(J, (V, V), a11 * U, lanes)
        put(J, (V, R), a12 * U, lanes)
        put(J, (R, V), a21 * U, lanes)
        put(J, (R, R), a22 * U, lanes)
        put(J, (V, E), b1 * square * gain, lanes)
        put(J, (R, E), b2 * square * gain, lanes)
        for i, j, slope in ((V, F, 1.0), (R, F, arm), (R, M, 1.0), (PSI, R, 1.0), (F, F, -mu_F), (M, M, -mu_M)):
            put(J, (i, j), slope, lanes)
        put(J, (E, E), -mu_E, lanes)
        if busy:
            _add_slopes_of_felt(J, hull, v, r, U, delta, square, exponent, slopes, lanes)
    if busy:
        for kind in range(2 + width - N_BEFORE):
            target = kind if kind < 2 else N_BEFORE + kind - 2
            on = ON_SWAY + kind if kind < 2 else ON_EXTRA + kind - 2
            if add_programs(on, table, values, slopes, stack, by, total, lanes):
                there = at(f, target, lanes) if kind < 2 else everywhere(0.0, lanes)
                put(f, target, at(total, 0, lanes) + there, lanes)
                for j in range(carried):
                    put(J, (target, j), at(J, (target, j), lanes) + at(total, j + 1, lanes), lanes)


@njit(**FILLING)
def asks_for_jerk(table):  # type: ignore[no-untyped-def]
    """Return whether any program speaks of vddot or rddot."""
    code, found = table[1], False
    for i in range(code.shape[0]):
        found |= code[i, 0] == VARIABLE and (code[i, 1] == VDDOT or code[i, 1] == RDDOT)
    return found


@njit(**FILLING)
def measured_by(  # type: ignore[no-untyped-def]
    x,
    row,
    rudder,
    step_s,
    before,
    rudder_before,
    jerky,
    ship,
    table,
    values,
    slopes,
    stack,
    by,
    total,
    room,
    f,
    J,
    lanes,
):
    """Do as `dynamics`, and fill the variables that measurements alone may ask for, with their slopes.

    The accelerations' rate of change is the difference over the step that ends here, along the motion as it is here,
    so that the rudder's movement is in it (decision 0077). Its slopes leave out the curvature of the forces.

    Parameters
    ----------
    before, rudder_before
        Row of inputs and rudder one step earlier.
    jerky : bool
        See `asks_for_jerk`.
    room : tuple of ndarray, shape (width, lanes)
        Two, scratch.
    """
    earlier, f_earlier = room
    width, carried = f.shape[0], J.shape[0]
    if jerky:
        dynamics(x, row, rudder, ship, table, values, slopes, stack, by, total, f, J[:0], lanes)
        for i in range(width):
            put(earlier, i, at(x, i, lanes) - step_s * at(f, i, lanes), lanes)
        dynamics(
            *(earlier, before, rudder_before, ship),
            *(table, values, slopes, stack, by, total, f_earlier, J[:0], lanes),
        )
    dynamics(x, row, rudder, ship, table, values, slopes, stack, by, total, f, J, lanes)
    for i in range(width):
        put(values, i, at(x, i, lanes), lanes)
    for rate, state in ((VDOT, V), (RDOT, R)):
        put(values, rate, at(f, state, lanes), lanes)
        for j in range(carried):
            put(slopes, (rate, j), at(J, (state, j), lanes), lanes)
    if jerky:
        for rate, state in ((VDDOT, V), (RDDOT, R)):
            put(values, rate, (at(f, state, lanes) - at(f_earlier, state, lanes)) / step_s, lanes)
            for j in range(carried):
                slope = everywhere(0.0, lanes)
                for i in range(carried):
                    slope += at(J, (state, i), lanes) * at(J, (i, j), lanes)
                put(slopes, (rate, j), slope, lanes)
