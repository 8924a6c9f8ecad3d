"""The mean motion of a ship of eq. (16) with effects, with her speed and her track, compiled.

The lateral motion is that of `pipeline.model.dynamics`, by which the filter moves: no effect is written out again. The
speed is `pipeline.manoeuvre.surge`'s. There is no wave or current, nothing random, and no wind but a given one.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, njit
from kempf.pipeline.manoeuvre.helm import DEAD_TIME, pass_through
from kempf.pipeline.model.chain import PSI, F, R, V
from kempf.pipeline.model.dynamics import CHANNEL, N_BEFORE, N_INPUT, SPEED, dynamics, room_of
from kempf.schemas.symbols import SYMBOLS

#: columns of a track: s, m, m, rad, m/s (forward, lateral), rad/s, rad (reading), m along the track
TIME, NORTH, EAST, HEADING, FORWARD, LATERAL, RATE, RUDDER, PATH = range(9)
N_TRACK = 9
#: how a manoeuvre ended
SAILED, RAN_AWAY, NEVER_CAME = 0, 1, 2
#: parts of the ship's vector, `kempf.pipeline.manoeuvre.ship.Ship.vector`
LENGTH, DRAUGHT, APPROACH, TIME_LENGTHS, LOSS_BY_DRIFT, LOSS_BY_RATE, LOSS_BY_RUDDER, RUDDER_RATE = range(8)
EXPONENT, SCALE, FORCE, ARM, SETTLED, WIND, WIND_FROM, SHAFT, LOSS_BY_WIND = range(8, 17)
_TRUE_HEADING = 2 + SYMBOLS.index("K") - CHANNEL
_RUN_TIME = 2 + SYMBOLS.index("t") - CHANNEL
_WIND_SPEED, _WIND_ANGLE, _SHAFT, _DEPTH = (2 + SYMBOLS.index(name) - CHANNEL for name in ("U", "gamma", "n", "h"))
#: a crossing is found to this part of a step
_HALVINGS = 48
#: she is no ship any more: this share of the approach speed is left; v / V; r L / V. Hulls reach 0.8 and 1.3
_SLOWEST, _FASTEST_SIDEWAYS, _FASTEST_TURN = 0.02, 2.0, 4.0
_ROUNDS = 40


@njit(**FILLING)
def _kept(numbers, u, v, r, rudder, heading):  # type: ignore[no-untyped-def]
    """Return the forward speed that thrust and resistance keep with this drift, turn, rudder and wind, m/s."""
    unit, settled = numbers[LENGTH] / numbers[SETTLED], numbers[SETTLED]
    steered = rudder * rudder * max(u / settled, 0.0) ** numbers[EXPONENT]
    lost = numbers[LOSS_BY_RATE] * (unit * r) ** 2 + numbers[LOSS_BY_RUDDER] * steered
    if numbers[WIND] > 0.0:
        away = numbers[WIND_FROM] - heading
        ahead, abeam = numbers[WIND] * np.cos(away) + u, numbers[WIND] * np.sin(away) + v
        lost += numbers[LOSS_BY_WIND] * (ahead * np.hypot(ahead, abeam) - u * u) / settled**2
    return settled * (1.0 + numbers[LOSS_BY_DRIFT] * unit * r * v / settled - lost)


@njit(**FILLING)
def _steady(numbers, v, r, rudder):  # type: ignore[no-untyped-def]
    """Return the forward speed of a steady turn, on the course of the approach where there is a wind, m/s."""
    # the faster she is the more the rudder costs: what she keeps falls, and meets the speed once
    low, high = 0.0, 2.0 * max(numbers[APPROACH], numbers[SETTLED])
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _kept(numbers, middle, v, r, rudder, 0.0) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@njit(**FILLING)
def rates(x, s, rudder, sea, numbers, fx, fs):  # type: ignore[no-untyped-def]
    """Fill dx/dt of the lateral states, and d(V, north, east, path)/dt."""
    row, ship, table, values, slopes, stack, by, total, J = sea
    row[0], row[_TRUE_HEADING] = s[0], x[PSI, 0]
    # where the air over the deck comes from, clockwise from the bow: in calm air that of her own way
    away = numbers[WIND_FROM] - x[PSI, 0]
    ahead, abeam = numbers[WIND] * np.cos(away) + s[0], numbers[WIND] * np.sin(away) + x[V, 0]
    row[_WIND_SPEED], row[_WIND_ANGLE] = np.hypot(ahead, abeam), np.arctan2(abeam, ahead)
    # a number as the filters give it: a constant is of a type of its own, for which all of it would be compiled again
    dynamics(x, row, rudder, ship, table, values, slopes, stack, by, total, fx, J, (np.int64(1),))
    length, settled = numbers[LENGTH], numbers[SETTLED]
    fs[0] = (
        (_kept(numbers, s[0], x[V, 0], x[R, 0], rudder[0], x[PSI, 0]) - s[0])
        * settled
        / (numbers[TIME_LENGTHS] * length)
    )
    # the speed that effects make of the logged one is the one that she has
    u, v, cosine, sine = values[SPEED, 0], x[V, 0], np.cos(x[PSI, 0]), np.sin(x[PSI, 0])
    fs[1], fs[2], fs[3] = u * cosine - v * sine, u * sine + v * cosine, np.hypot(u, v)


@njit(**FILLING)
def _advance(x, s, felt, h, sea, numbers, room, xn, sn):  # type: ignore[no-untyped-def]
    """Write both states a step later; fourth-order Runge-Kutta with the felt rudder at beginning, middle and end."""
    k1, k2, k3, k4, l1, l2, l3, l4, rudder = room
    rudder[0] = felt[0]
    rates(x, s, rudder, sea, numbers, k1, l1)
    rudder[0] = felt[1]
    for stage in range(2):
        k, slope = (k1, l1) if stage == 0 else (k2, l2)
        for i in range(x.shape[0]):
            xn[i, 0] = x[i, 0] + 0.5 * h * k[i, 0]
        for i in range(4):
            sn[i] = s[i] + 0.5 * h * slope[i]
        if stage == 0:
            rates(xn, sn, rudder, sea, numbers, k2, l2)
        else:
            rates(xn, sn, rudder, sea, numbers, k3, l3)
    rudder[0] = felt[2]
    for i in range(x.shape[0]):
        xn[i, 0] = x[i, 0] + h * k3[i, 0]
    for i in range(4):
        sn[i] = s[i] + h * l3[i]
    rates(xn, sn, rudder, sea, numbers, k4, l4)
    for i in range(x.shape[0]):
        xn[i, 0] = x[i, 0] + h / 6.0 * (k1[i, 0] + 2.0 * k2[i, 0] + 2.0 * k3[i, 0] + k4[i, 0])
    for i in range(4):
        sn[i] = s[i] + h / 6.0 * (l1[i] + 2.0 * l2[i] + 2.0 * l3[i] + l4[i])


@njit(cache=True, nogil=True, error_model="numpy")
def _at_sea(numbers, hull, values_of_effects, day, table, extra):  # type: ignore[no-untyped-def]
    """Return what `rates` needs of a ship in calm, deep water with her shaft turning as on the approach."""
    width, row = N_BEFORE + extra, np.zeros(N_INPUT)
    # the shaft turning on, deep water, upright; n and n0 are 1 and V0 is the speed that the shaft keeps
    row[_SHAFT], row[_DEPTH], row[_RUN_TIME + 1] = 1.0, 1e12, day
    constants = (
        *(numbers[ARM], numbers[LENGTH], numbers[DRAUGHT], numbers[SHAFT], 1.0),
        *(numbers[EXPONENT], numbers[APPROACH]),
    )
    ship, values, slopes, stack, by, total = room_of(
        hull, values_of_effects.reshape((-1, 1)), np.array(constants), (0.0, 0.0, 0.0), width
    )
    return row, ship, table, values, slopes, stack, by, total, np.zeros((0, width, 1))


@njit(cache=True, nogil=True, error_model="numpy")
def balanced(numbers, hull, effects, day, table, extra, given, rate_given, start):  # type: ignore[no-untyped-def]
    """Find a steady motion: the rudder that holds a yaw rate, or the yaw rate that a rudder comes to.

    Newton's rule on f = 0 for sway, turn and the effects' states, the speed being that of the steady turn.

    Parameters
    ----------
    given : float
        Yaw rate in rad/s where ``rate_given``, else the rudder that the hull feels, rad.
    start : ndarray, shape (2 + extra,)
        Lateral speed, the other of rudder and rate, and the effects' states to start from; filled with the solution.

    Returns
    -------
    (float, bool)
        Forward speed, and whether a solution was found.
    """
    sea = _at_sea(numbers, hull, effects, day, table, extra)
    n = 2 + extra
    x, s, fx, fs = np.zeros((N_BEFORE + extra, 1)), np.zeros(4), np.zeros((N_BEFORE + extra, 1)), np.zeros(4)
    rudder, A, z = np.zeros(1), np.zeros((n, n + 1)), start.copy()
    f, moved = np.zeros(n), np.zeros(n)
    V0, L = numbers[APPROACH], numbers[LENGTH]
    scale = np.ones(n)
    scale[0], scale[1] = V0, (1.0 if rate_given else V0 / L)
    weight = np.ones(n) * L / V0**2
    weight[1] = (L / V0) ** 2
    for _ in range(_ROUNDS):
        for column in range(n + 1):
            moved[:] = z
            if column > 0:
                moved[column - 1] += 1e-6 * scale[column - 1]
            r, delta = (given, moved[1]) if rate_given else (moved[1], given)
            s[0] = _steady(numbers, moved[0], r, delta)
            x[V, 0], x[R, 0], x[F, 0], rudder[0] = moved[0], r, numbers[FORCE], delta
            x[N_BEFORE:, 0] = moved[2:]
            rates(x, s, rudder, sea, numbers, fx, fs)
            for i in range(n):
                here = fx[V, 0] if i == 0 else (fx[R, 0] if i == 1 else fx[N_BEFORE + i - 2, 0])
                if column == 0:
                    f[i] = here
                    A[i, n] = -here * weight[i]
                else:
                    A[i, column - 1] = (here - f[i]) * weight[i] / 1e-6
        if not _eliminate(A):
            return s[0], False
        largest = 0.0
        for i in range(n):
            largest = max(largest, abs(A[i, n]))
        # far from a solution the linear step would leave the ship
        share = min(1.0, 0.5 / largest) if largest > 0.0 else 1.0
        for i in range(n):
            z[i] += share * A[i, n] * scale[i]
        if largest < 1e-10:
            break
    start[:] = z
    r, delta = (given, z[1]) if rate_given else (z[1], given)
    u = _steady(numbers, z[0], r, delta)
    return u, largest < 1e-7 and u > _SLOWEST * V0


@njit(**FILLING)
def _eliminate(A):  # type: ignore[no-untyped-def]
    """Solve the system whose right side is the last column, in place; return whether it can be solved."""
    n = A.shape[0]
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        if not abs(A[best, k]) > 1e-14:
            return False
        for j in range(n + 1):
            A[k, j], A[best, j] = A[best, j], A[k, j]
        for i in range(n):
            if i != k:
                factor = A[i, k] / A[k, k]
                for j in range(k, n + 1):
                    A[i, j] -= factor * A[k, j]
    for k in range(n):
        A[k, n] /= A[k, k]
    return True


@njit(**FILLING)
def _step(x, s, begun, before, speed, h, t, sea, numbers, gear, held, room, xn, sn):  # type: ignore[no-untyped-def]
    """Write both states a step later, while the rudder's reading moves at a speed; return the rudder that is felt."""
    kinds, sizes, out, half, gone, past, felt = gear
    middle, after = before + 0.5 * speed * h, before + speed * h
    felt[0] = begun
    felt[1] = pass_through(before, middle, 0.5 * h, t + 0.5 * h, kinds, sizes, out, half, past, held)
    felt[2] = pass_through(middle, after, 0.5 * h, t + h, kinds, sizes, half, gone, past, held)
    _advance(x, s, felt, h, sea, numbers, room, xn, sn)
    return felt[2]


@njit(cache=True, nogil=True, error_model="numpy")
def sail(numbers, hull, effects, day, table, extra, kinds, sizes, start, air, phases, step_s, track, ends):  # type: ignore[no-untyped-def]  # noqa: PLR0912, PLR0915 - one loop
    """Sail a manoeuvre, from a steady straight course on or as it really began.

    Parameters
    ----------
    numbers : ndarray, shape (17,)
        See the constants of this file.
    hull : ndarray, shape (6, 1)
    effects : ndarray, shape (p,)
        Parameters of the effects.
    day, table, extra
        Of the effects: see `kempf.pipeline.manoeuvre.ship.Waters`.
    kinds, sizes : ndarray, shape (m,)
        See `kempf.pipeline.manoeuvre.helm.pass_through`.
    start : ndarray, shape (4,)
        Forward and lateral speed, m/s, yaw rate, rad/s, and rudder, rad, to begin with; NaN: as on a straight course.
    air : ndarray, shape (k, 3)
        Course of the true wind: instant, s, and its parts from north and from east, m/s, linear in between and constant
        beyond; without rows the steady one of the numbers. The approach is in the steady one.
    phases : ndarray, shape (q, 4)
        Rudder order, rad (NaN: the one that holds a straight course); side (+1, -1) to which the heading has to pass
        the target that ends the phase, 0 for none; target, rad; longest duration, s.
    step_s : float
        Steps are no longer than this.
    track : ndarray, shape (n, N_TRACK)
        Filled.
    ends : ndarray of int, shape (q,)
        Filled with the row at which each phase ended.

    Returns
    -------
    (int, int)
        How it ended, and the rows of the track.
    """
    sea = _at_sea(numbers, hull, effects, day, table, extra)
    shape, m = (N_BEFORE + extra, 1), kinds.size
    room = (
        *(np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape)),
        *(np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(1)),
    )
    x, xn, s, sn = np.zeros(shape), np.zeros(shape), np.zeros(4), np.zeros(4)
    rest = np.zeros(2 + extra)
    _, at_rest = balanced(numbers, hull, effects, day, table, extra, 0.0, np.bool_(1), rest)
    if not at_rest:
        rest[:] = 0.0
    straight = rest[1]
    x[V, 0], x[F, 0], s[0] = rest[0], numbers[FORCE], numbers[APPROACH]
    x[N_BEFORE:, 0] = rest[2:]
    if not np.isnan(start[0]):
        s[0] = start[0]
    if not np.isnan(start[1]):
        x[V, 0] = start[1]
    if not np.isnan(start[2]):
        x[R, 0] = start[2]
    reading = straight if np.isnan(start[3]) else start[3]
    out, gone = np.full(m, reading), np.zeros(m)
    past = np.zeros((2 * m, track.shape[0] if np.any(kinds == DEAD_TIME) else 1))
    past[1::2, 0] = reading
    gear = (kinds, sizes, out, np.zeros(m), gone, past, np.zeros(3))
    begun, t, n = reading, 0.0, np.int64(1)
    room[8][0] = reading
    rates(x, s, room[8], sea, numbers, room[0], room[4])
    _record(track[0], t, x, s, reading, sea)
    limit, V0, scale = numbers[RUDDER_RATE], numbers[APPROACH], numbers[SCALE]
    numbers, row_of_air = numbers.copy(), np.int64(0)
    for k in range(phases.shape[0]):
        order, side, target, longest = phases[k]
        if np.isnan(order):
            order = straight
        begin = t
        while True:
            gap, h, arrives = order - reading, step_s, False
            if gap != 0.0 and abs(gap) <= limit * h:
                h, arrives = abs(gap) / limit, True
            if begin + longest - t < h:
                h, arrives = begin + longest - t, False
            speed = np.sign(gap) * limit
            if air.shape[0] > 0:
                row_of_air = _blow(air, row_of_air, t + 0.5 * h, numbers)
            felt = _step(x, s, begun, reading, speed, h, t, sea, numbers, gear, n, room, xn, sn)
            crossed = side != 0.0 and side * (xn[PSI, 0] - target) >= 0.0
            if crossed:
                low, high = 0.0, h
                for _ in range(_HALVINGS):
                    middle = 0.5 * (low + high)
                    _step(x, s, begun, reading, speed, middle, t, sea, numbers, gear, n, room, xn, sn)
                    if side * (xn[PSI, 0] - target) >= 0.0:
                        high = middle
                    else:
                        low = middle
                arrives, h = arrives and high == h, high
                felt = _step(x, s, begun, reading, speed, h, t, sea, numbers, gear, n, room, xn, sn)
            x[:], s[:], out[:] = xn, sn, gone
            t, begun, reading = t + h, felt, order if arrives else reading + speed * h
            if past.shape[1] > 1:
                for i in range(m):
                    past[2 * i, n], past[2 * i + 1, n] = t, (reading if i == 0 else out[i - 1])
            _record(track[n], t, x, s, reading, sea)
            n += 1
            away = (
                not np.isfinite(s[0] + x[V, 0] + x[R, 0])
                or s[0] < _SLOWEST * V0
                or abs(x[V, 0]) > _FASTEST_SIDEWAYS * s[0]
                or abs(x[R, 0]) * scale > _FASTEST_TURN * s[0]
            )
            if away or n >= track.shape[0]:
                return (RAN_AWAY if away else NEVER_CAME), n
            if crossed:
                break
            if t - begin >= longest * (1.0 - 1e-12):
                if side != 0.0:
                    return NEVER_CAME, n
                break
        ends[k] = n - 1
    return SAILED, n


@njit(**FILLING)
def _blow(air, row, t, numbers):  # type: ignore[no-untyped-def]
    """Write the wind at an instant into the numbers; return the row of the course to look from the next time."""
    while row < air.shape[0] - 2 and air[row + 1, 0] < t:
        row += 1
    after = min(row + 1, air.shape[0] - 1)
    span = air[after, 0] - air[row, 0]
    share = min(max((t - air[row, 0]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    north = air[row, 1] + share * (air[after, 1] - air[row, 1])
    east = air[row, 2] + share * (air[after, 2] - air[row, 2])
    numbers[WIND], numbers[WIND_FROM] = np.hypot(north, east), np.arctan2(east, north)
    return row


@njit(**FILLING)
def _record(row, t, x, s, reading, sea):  # type: ignore[no-untyped-def]
    """Write a row of the track; the speed is the one that effects make of the logged one, as of the last call."""
    row[TIME], row[NORTH], row[EAST], row[HEADING] = t, s[1], s[2], x[PSI, 0]
    row[FORWARD], row[LATERAL], row[RATE] = sea[3][SPEED, 0], x[V, 0], x[R, 0]
    row[RUDDER], row[PATH] = reading, s[3]
