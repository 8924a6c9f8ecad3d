"""What moves the ship of eq. (16) and what effects add to it: dx/dt with its derivatives, compiled.

Everything stands in lanes (`pipeline.model.batch`). Terms of effects are programs (`pipeline.model.terms.program`),
added to what their kind says: to the speed and the rudder that the hull feels, to sway and yaw, to states of their own.
"""

from __future__ import annotations

from kempf.pipeline.compiled import FILLING, njit
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.chain import N_CHAIN, PSI, F, M, R, V
from kempf.pipeline.model.terms.evaluation import evaluate
from kempf.pipeline.model.terms.program import VARIABLE
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
#: what a program is added to
ON_SPEED, ON_RUDDER, ON_SWAY, ON_YAW, ON_EXTRA, ON_LATERAL, ON_YAW_RATE, ON_HEADING = 0, 1, 2, 3, 4, 5, 6, 7
ON_NOISE, ON_INITIAL = 8, 9


@njit(**FILLING)
def add_programs(  # type: ignore[no-untyped-def]
    kind, place, table, values, slopes, stack, by, width, total, lanes
):
    """Fill ``total``, shape (1 + width, lanes), with the sum of all programs of a kind (and place, for extra states).

    Return whether there is any.
    """
    programs, code, constants = table
    for j in range(width + 1):
        for b in range(each(lanes)):
            total[j, b] = 0.0
    found = False
    for p in range(programs.shape[0]):
        if programs[p, 0] == kind and programs[p, 1] == place:
            found = True
            evaluate(code[programs[p, 2] : programs[p, 3]], constants, values, slopes, stack, by, width, lanes)
            for j in range(width + 1):
                for b in range(each(lanes)):
                    total[j, b] += stack[0, j, b]
    return found


@njit(**FILLING)
def dynamics(  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over lanes
    x, row, rudder, ship, width, carried, table, values, slopes, stack, by, total, f, J, lanes
):
    """Fill f = dx/dt of chain and effects' states, shape (width, lanes), and its derivatives J, (width, width, lanes).

    ``carried`` is ``width``, or 0 where J is not wanted.
    """
    hull, (arm, mu_F, mu_M, mu_E, exponent, V0) = ship
    gain = row[SPEED_ERROR_GAIN]
    busy = table[0].shape[0] > 0
    for b in range(each(lanes)):
        values[SPEED, b], values[DELTA, b] = row[0], rudder[b]
    if busy:
        for i in range(width):
            for b in range(each(lanes)):
                values[i, b] = x[i, b]
        for i in range(N_INPUT - 3):
            for b in range(each(lanes)):
                values[CHANNEL + i, b] = row[2 + i]
        for j in range(carried):
            for b in range(each(lanes)):
                slopes[SPEED, j, b] = slopes[DELTA, j, b] = 0.0
        for kind in range(2):
            where = SPEED if kind == 0 else DELTA
            if add_programs(kind, 0, table, values, slopes, stack, by, carried, total, lanes):
                for b in range(each(lanes)):
                    values[where, b] += total[0, b]
                    for j in range(carried):
                        slopes[where, j, b] = total[j + 1, b]
    for b in range(each(lanes)):
        U, delta = values[SPEED, b], values[DELTA, b] + gain * x[E, b]
        square = U * U if exponent == 2.0 else U * abs(U / V0) ** (exponent - 1.0) * V0
        v, r, force = x[V, b], x[R, b], x[F, b]
        f[V, b] = hull[0, b] * U * v + hull[1, b] * U * r + hull[4, b] * square * delta + force
        f[R, b] = hull[2, b] * U * v + hull[3, b] * U * r + hull[5, b] * square * delta + arm * force + x[M, b]
        f[PSI, b], f[F, b], f[M, b], f[E, b] = r, -mu_F * force, -mu_M * x[M, b], -mu_E * x[E, b]
    if carried > 0:
        J[:, :, :] = 0.0
        for b in range(each(lanes)):
            U = values[SPEED, b]
            square = U * U if exponent == 2.0 else U * abs(U / V0) ** (exponent - 1.0) * V0
            J[V, V, b], J[V, R, b], J[V, F, b] = hull[0, b] * U, hull[1, b] * U, 1.0
            J[R, V, b], J[R, R, b], J[R, F, b], J[R, M, b] = hull[2, b] * U, hull[3, b] * U, arm, 1.0
            J[PSI, R, b], J[F, F, b], J[M, M, b], J[E, E, b] = 1.0, -mu_F, -mu_M, -mu_E
            J[V, E, b], J[R, E, b] = hull[4, b] * square * gain, hull[5, b] * square * gain
            delta, steeper = values[DELTA, b] + gain * x[E, b], exponent * square / U if U != 0.0 else 0.0
            v, r = x[V, b], x[R, b]
            for j in range(width):
                # effects may let the speed go with the states, as they may the rudder
                by_rudder, by_speed = slopes[DELTA, j, b], slopes[SPEED, j, b]
                J[V, j, b] += hull[4, b] * square * by_rudder
                J[R, j, b] += hull[5, b] * square * by_rudder
                J[V, j, b] += (hull[0, b] * v + hull[1, b] * r + hull[4, b] * steeper * delta) * by_speed
                J[R, j, b] += (hull[2, b] * v + hull[3, b] * r + hull[5, b] * steeper * delta) * by_speed
    if busy:
        for kind in range(2 + width - N_BEFORE):
            target = kind if kind < 2 else N_BEFORE + kind - 2
            on, place = (ON_SWAY + kind, 0) if kind < 2 else (ON_EXTRA, kind - 2)
            add_programs(on, place, table, values, slopes, stack, by, carried, total, lanes)
            for b in range(each(lanes)):
                f[target, b] = total[0, b] + (f[target, b] if kind < 2 else 0.0)
            for j in range(carried):
                for b in range(each(lanes)):
                    J[target, j, b] += total[j + 1, b]


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
    width,
    carried,
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
    if jerky:
        dynamics(x, row, rudder, ship, width, 0, table, values, slopes, stack, by, total, f, J, lanes)
        for i in range(width):
            for b in range(each(lanes)):
                earlier[i, b] = x[i, b] - step_s * f[i, b]
        dynamics(
            *(earlier, before, rudder_before, ship, width, 0),
            *(table, values, slopes, stack, by, total, f_earlier, J, lanes),
        )
    dynamics(x, row, rudder, ship, width, carried, table, values, slopes, stack, by, total, f, J, lanes)
    for i in range(width):
        for b in range(each(lanes)):
            values[i, b] = x[i, b]
    for b in range(each(lanes)):
        values[VDOT, b], values[RDOT, b] = f[V, b], f[R, b]
        for j in range(carried):
            slopes[VDOT, j, b], slopes[RDOT, j, b] = J[V, j, b], J[R, j, b]
    if jerky:
        for b in range(each(lanes)):
            values[VDDOT, b] = (f[V, b] - f_earlier[V, b]) / step_s
            values[RDDOT, b] = (f[R, b] - f_earlier[R, b]) / step_s
            for j in range(carried):
                slopes[VDDOT, j, b] = slopes[RDDOT, j, b] = 0.0
                for i in range(carried):
                    slopes[VDDOT, j, b] += J[V, i, b] * J[i, j, b]
                    slopes[RDDOT, j, b] += J[R, i, b] * J[i, j, b]
