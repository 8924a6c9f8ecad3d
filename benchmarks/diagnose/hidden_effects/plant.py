"""The ship of the hidden-effect cases, compiled: surge, sway, yaw and roll, and one effect switched on by ``theta``.

With ``theta`` all zero sway and yaw are exactly eq. (16) with the logged speed, and roll, memory and waves are
passengers that act on nothing. All kernels stand in this one file: the compiled copy on disk is renewed when the file
of the kernel changes, not when that of a kernel it calls does. The rudder is a chain of straight lines between the
points of the grid; the helmsman answers at the points of the grid. Reference: Fossen (2021), chapters 6 and 8.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.compiled import compiled

Float = NDArray[np.float64]

#: Columns of the state: the six of `pipeline.simulate.plant.STATE`, roll angle and rate, the rudder behind a lag, the
#: slow memory of the lateral speed, and the first-order motion in waves: yaw angle, sway displacement and their rates.
STATE = ("v", "r", "psi", "north", "east", "V", "phi", "p", "lagged", "memory", "q_psi", "dq_psi", "q_y", "dq_y")
N_STATE = 14

#: Slots of the constants of a hull.
CONSTANTS = (
    *("a11", "a12", "a21", "a22", "b1", "b2", "l", "V0", "T_V", "c_V", "L", "n0", "T", "heel", "w_roll", "z_roll"),
    *("w_wave", "wave_from", "g"),
)

#: Columns of the forcing: F m/s^2, current north and east m/s, true wind m/s.
FORCING = ("F", "current_north", "current_east", "wind")

# Slots of the conditions, which change from cell to cell: shaft speed 1/s, depth m, 1 on the second day, sign of the
# kick after an execute, sign of the hysteresis, 1 once the run is 60 % over, v some time ago, white noise of the waves,
# where the run began and its base heading, direction the true wind comes from.
N_, H_, DAY_, KICK_, HYST_, FOUL_, VLATE_, WPSI_, WY_, NORTH_, EAST_, BASE_, WIND_ = range(13)
N_CONDITIONS = 13

# Slots of theta; `effects.py` and `outsiders.py` say what each does.
CROSS_FLOW, SWAY_QUAD, YAW_QUAD, SWAY_ABS_R, YAW_ABS_V, SWAY_CUBIC, YAW_CUBIC, YAW_V3 = range(8)
SWAY_V2R, SWAY_VR2, YAW_V2R, YAW_VR2, SHALLOW, ROLL, LOAD, MEMORY = range(8, 16)
STALL, STRAIGHTEN, LAG, DEAD_TIME, BACKLASH, RATE_LIMIT, NEUTRAL, ASYMMETRY, WASH, EXPONENT = range(16, 26)
WALK_Y, WALK_N, WIND_Y, WIND_N, WAVE_PSI, WAVE_Y = range(26, 32)
KICK, KICK_S, HYSTERESIS, HYSTERESIS_R, THRUSTER, BANK, BANK_M, LATE_LIFT, LATE_S, FOULING = range(32, 42)
HARMONIC, DEAD_ZONE, DEAD_ZONE_V, SWAY_ABS_V, YAW_ABS_R, CROSS_FLOW_CUBIC = range(42, 48)
N_THETA = 48

_STRIPS = 40
_WAVE_DAMPING = 0.1


@compiled
def effective_rudder(fed: float, v: float, V: float, theta: Float) -> float:
    """Return the rudder angle that the hull feels, rad."""
    d = fed + theta[NEUTRAL]
    d += theta[ASYMMETRY] * abs(d)
    drift = v / V
    return d * (1.0 - theta[STALL] * d * d + theta[STRAIGHTEN] * drift * drift)


@compiled
def cross_flow(v: float, r: float, L: float, power: int) -> tuple[float, float]:
    """Return the means over the length of |u|^(power-1) u and of x times it with u = v + x r, by midpoint strips."""
    force, moment = 0.0, 0.0
    for k in range(_STRIPS):
        x = L * ((k + 0.5) / _STRIPS - 0.5)
        u = v + x * r
        drag = abs(u) ** (power - 1) * u
        force += drag
        moment += x * drag
    return force / _STRIPS, moment / _STRIPS


@compiled
def hull_effects(state: Float, theta: Float, L: float) -> tuple[float, float]:
    """Return what the hull effects of the catalogue add to dv/dt and dr/dt."""
    v, r, V = state[0], state[1], state[5]
    dv = theta[SWAY_QUAD] * v * abs(v) + theta[SWAY_ABS_R] * abs(r) * v + theta[SWAY_ABS_V] * abs(v) * r
    dv += (theta[SWAY_CUBIC] * v**3 + theta[SWAY_V2R] * v * v * r + theta[SWAY_VR2] * v * r * r) / V
    dv += theta[MEMORY] * V * (v - state[9])
    dr = theta[YAW_QUAD] * r * abs(r) + theta[YAW_ABS_V] * abs(v) * r + theta[YAW_ABS_R] * abs(r) * v
    dr += theta[ROLL] * V * V * state[6]
    dr += (theta[YAW_CUBIC] * r**3 + theta[YAW_V3] * v**3 + theta[YAW_V2R] * v * v * r + theta[YAW_VR2] * v * r * r) / V
    if theta[CROSS_FLOW] != 0.0:
        force, moment = cross_flow(v, r, L, 2)
        dv -= theta[CROSS_FLOW] * force
        dr -= theta[CROSS_FLOW] * 16.0 / (L * L) * moment
    if theta[CROSS_FLOW_CUBIC] != 0.0:
        force, moment = cross_flow(v, r, L, 3)
        dv -= theta[CROSS_FLOW_CUBIC] / V * force
        dr -= theta[CROSS_FLOW_CUBIC] / V * 16.0 / (L * L) * moment
    return dv, dr


@compiled
def wind_and_screw(
    state: Float, forcing: Float, now: Float, theta: Float, north: float, east: float
) -> tuple[float, float]:
    """Return what relative wind and propeller walk add; ``north`` and ``east`` are the velocity over ground."""
    dv, dr = theta[WALK_Y] * now[N_] ** 2, theta[WALK_N] * now[N_] ** 2
    if theta[WIND_Y] != 0.0 or theta[WIND_N] != 0.0:
        from_north = forcing[3] * np.cos(now[WIND_]) + north
        from_east = forcing[3] * np.sin(now[WIND_]) + east
        angle = np.arctan2(from_east, from_north) - state[2]
        U2 = from_north**2 + from_east**2
        dv += theta[WIND_Y] * U2 * np.sin(angle)
        dr += theta[WIND_N] * U2 * np.sin(2.0 * angle)
    return dv, dr


@compiled
def outside_effects(state: Float, rudder: float, now: Float, theta: Float, L: float) -> tuple[float, float]:
    """Return what the effects outside the catalogue add to dv/dt and dr/dt."""
    v, V, psi = state[0], state[5], state[2]
    # a force at the bow, x = L/2, of a hull whose mass is spread evenly: r' = (6/L) v'
    bow = theta[THRUSTER] * v * rudder * V
    if theta[HARMONIC] != 0.0:
        bow += theta[HARMONIC] * np.sin(3.0 * psi)
    if theta[BANK] != 0.0:
        across = (state[4] - now[EAST_]) * np.cos(now[BASE_]) - (state[3] - now[NORTH_]) * np.sin(now[BASE_])
        bow += theta[BANK] * np.sin(2.0 * np.pi * across / theta[BANK_M])
    dr = bow + theta[KICK] * now[KICK_] + theta[HYSTERESIS] * now[HYST_]
    dv = (bow - theta[KICK] * now[KICK_]) * L / 6.0
    lift = theta[LATE_LIFT] * now[VLATE_] * abs(v)
    return dv + lift, dr + 3.0 / L * lift


@compiled
def derivative(state: Float, fed: float, forcing: Float, now: Float, hull: Float, theta: Float, out: Float) -> None:
    """Write d(state)/dt into ``out``.

    Parameters
    ----------
    state, out : ndarray, shape (14,)
        Columns `STATE`.
    fed : float
        Rudder angle behind dead time, rate limit and backlash, rad.
    forcing : ndarray, shape (4,)
        Columns `FORCING`.
    now : ndarray, shape (13,)
        The conditions.
    hull, theta : ndarray
        Slots `CONSTANTS`; strengths of the effects.
    """
    a11, a12, a21, a22, b1, b2, arm, V0, T_V, c_V, L, n0, T, heel, w_roll, z_roll, w_wave, wave_from, g = hull
    v, r, psi, V = state[0], state[1], state[2], state[5]
    rudder = effective_rudder(state[8] if theta[LAG] > 0.0 else fed, v, V, theta)
    ahead = V0 * now[N_] / n0
    inflow = V * V * (ahead / V) ** theta[EXPONENT] if theta[EXPONENT] != 0.0 else V * V
    inflow += theta[WASH] * (ahead * ahead - V * V)
    inflow *= 1.0 - theta[FOULING] * now[FOUL_]
    lift_v = v - theta[DEAD_ZONE] * min(max(v, -theta[DEAD_ZONE_V]), theta[DEAD_ZONE_V])
    load = 1.0 + theta[LOAD] * now[DAY_]
    bottom = load + theta[SHALLOW] * (T / now[H_]) ** 2
    cosine, sine = np.cos(psi), np.sin(psi)
    out[3] = V * cosine - v * sine + forcing[1]
    out[4] = V * sine + v * cosine + forcing[2]
    hull_v, hull_r = hull_effects(state, theta, L)
    wind_v, wind_r = wind_and_screw(state, forcing, now, theta, out[3], out[4])
    out_v, out_r = outside_effects(state, rudder, now, theta, L)
    out[0] = V * (bottom * a11 * lift_v + a12 * r) + load * b1 * inflow * rudder + forcing[0] + hull_v + wind_v + out_v
    out[1] = bottom * V * (a21 * lift_v + a22 * r) + load * b2 * inflow * rudder
    out[1] += arm * forcing[0] + hull_r + wind_r + out_r
    out[2] = r
    turn = L * r / ahead
    out[5] = (ahead * (1.0 - c_V * turn * turn) - V) / T_V
    # she heels outward; a turn to starboard heels her to port, which is negative
    out[6] = state[7]
    out[7] = -2.0 * z_roll * w_roll * state[7] - w_roll**2 * (state[6] + heel * V * r / g)
    out[8] = (fed - state[8]) / theta[LAG] if theta[LAG] > 0.0 else 0.0
    out[9] = V * (v - state[9]) / (3.0 * L)
    out[10:14] = 0.0
    if theta[WAVE_PSI] != 0.0:
        w = abs(w_wave + w_wave**2 * V * np.cos(wave_from - psi) / g)
        drive = np.sqrt(4.0 * _WAVE_DAMPING * w**3)
        out[10], out[12] = state[11], state[13]
        out[11] = -2.0 * _WAVE_DAMPING * w * state[11] - w * w * state[10] + theta[WAVE_PSI] * drive * now[WPSI_]
        out[13] = -2.0 * _WAVE_DAMPING * w * state[13] - w * w * state[12] + theta[WAVE_Y] * drive * now[WY_]


@compiled
def advance(
    state: Float,
    fed: tuple[float, float],
    forcing: tuple[Float, Float],
    now: Float,
    step_s: float,
    hull: Float,
    theta: Float,
    work: Float,
) -> None:
    """Move ``state`` one cell on, fourth-order Runge-Kutta; rudder and forcing are straight lines from end to end.

    Parameters
    ----------
    state : ndarray, shape (14,)
        Changed in place.
    fed, forcing : tuple
        At the beginning and at the end of the cell.
    now : ndarray, shape (13,)
        The conditions, constant in the cell.
    work : ndarray, shape (4, 14)
        Scratch.
    """
    middle_fed, middle = 0.5 * (fed[0] + fed[1]), 0.5 * (forcing[0] + forcing[1])
    half = 0.5 * step_s
    derivative(state, fed[0], forcing[0], now, hull, theta, work[0])
    derivative(state + half * work[0], middle_fed, middle, now, hull, theta, work[1])
    derivative(state + half * work[1], middle_fed, middle, now, hull, theta, work[2])
    derivative(state + step_s * work[2], fed[1], forcing[1], now, hull, theta, work[3])
    for i in range(N_STATE):
        state[i] += step_s / 6.0 * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i])


@compiled
def slopes(states: Float, fed: Float, forcing: Float, now: Float, hull: Float, theta: Float) -> Float:
    """Return d(state)/dt at every row, shape (n, 14)."""
    out = np.empty_like(states)
    for k in range(states.shape[0]):
        derivative(states[k], fed[k], forcing[k], now[k], hull, theta, out[k])
    return out


# Columns of the orders, one row a step of the programme: 1 for a zigzag and 0 for a steady course; longest time s;
# heading of a steady course rad; psi0, delta0 rad; first side; legs; shaft speed 1/s; depth m.
KIND_, LONGEST_, HEADING_, PSI0_, DELTA0_, SIDE_, LEGS_, SHAFT_, BOTTOM_ = range(9)

#: Of the rudder of the last zigzag: the turn to the next course shall not look like one more leg.
_SHARE_OF_AUTOPILOT = 0.75


@compiled
def feed(logged: Float, fed: Float, row: int, step_s: float, theta: Float) -> float:
    """Return what the rudder stock makes at ``row`` of the logged rudder: dead time, then rate limit, then backlash."""
    wanted = logged[row]
    if theta[DEAD_TIME] > 0.0:
        place = row - theta[DEAD_TIME] / step_s
        if place <= 0.0:
            wanted = logged[0]
        else:
            low = int(place)
            wanted = logged[low] + (place - low) * (logged[low + 1] - logged[low])
    if theta[RATE_LIMIT] > 0.0:
        most = step_s / theta[RATE_LIMIT]
        wanted = min(max(wanted, fed[row - 1] - most), fed[row - 1] + most)
    if theta[BACKLASH] > 0.0:
        half = 0.5 * theta[BACKLASH]
        wanted = min(max(fed[row - 1], wanted - half), wanted + half)
    return wanted


@compiled
def autopilot(state: Float, heading: float, integral: Float, tick_s: float, time_s: float, limit: float) -> float:
    """Return the rudder order of a course keeper, rad; ``integral`` (shape (1,), rad) is changed in place."""
    error = state[2] + state[10] - heading
    if abs(error) < 0.1:
        integral[0] += 0.15 * error * tick_s / time_s
    order = -(error + 1.5 * time_s * (state[1] + state[11]) + integral[0])
    return min(max(order, -limit), limit)


@compiled
def change(now: Float, order: Float, state: Float, late_v: float, step_s: float, n0: float, theta: Float) -> None:
    """Write the conditions of the next cell into ``now``: shaft, bottom, the memory of a side, v of some time ago."""
    if order[KIND_] == 0.0:
        # shaft speed and bottom are where they shall be well before the next zigzag
        share = 8.0 * step_s / order[LONGEST_]
        now[N_] += min(max(order[SHAFT_] - now[N_], -n0 * share), n0 * share)
        now[H_] += (order[BOTTOM_] - now[H_]) * share
    if abs(state[1]) > theta[HYSTERESIS_R]:
        now[HYST_] = 1.0 if state[1] > 0.0 else -1.0
    now[VLATE_] = late_v


@compiled
def voyage(
    orders: Float,
    rudder_rate: float,
    grid: tuple[float, int],
    hull: Float,
    theta: Float,
    forcing: Float,
    white: Float,
    states: Float,
    logged: Float,
    fed: Float,
    conditions: Float,
    run: NDArray[np.int64],
    executes: Float,
) -> int:
    """Sail a day into the tables and return the number of cells.

    Parameters
    ----------
    orders : ndarray, shape (n_steps, 9)
        The programme.
    rudder_rate : float
        rad/s.
    grid : (float, int)
        Length of a cell in s, cells between two orders of the autopilot.
    forcing : ndarray, shape (n, 4)
    white : ndarray, shape (n, 2)
        Standard normal numbers that drive the waves.
    states : ndarray, shape (n, 14)
        Row 0 holds the initial state.
    logged, fed : ndarray, shape (n,)
        Rudder of the log and rudder behind dead time, rate limit and backlash; result.
    conditions : ndarray, shape (n, 13)
        Row 0 is given; result.
    run : ndarray of int, shape (n,)
        Result: 1, 2, ... in the first, second, ... zigzag, 0 outside.
    executes : ndarray, shape (n_steps, 20)
        Result: instants of the executes and, last, of the end, s; NaN beyond.
    """
    step_s, tick = grid
    state, work, integral = states[0].copy(), np.empty((4, N_STATE)), np.zeros(1)
    row, zigzags, kick_until = 0, 0, -1.0
    for s in range(orders.shape[0]):
        one = orders[s]
        zigzag, crossed, side = one[KIND_] == 1.0, 0, one[SIDE_]
        zigzags += 1 if zigzag else 0
        base = state[2] + state[10]
        now = conditions[row].copy()
        now[BASE_], now[NORTH_], now[EAST_], now[FOUL_] = base, state[3], state[4], 0.0
        heading = base + (one[HEADING_] - base + np.pi) % (2.0 * np.pi) - np.pi
        limit = _SHARE_OF_AUTOPILOT * orders[s - 1, DELTA0_] if s > 0 else 0.1
        order = side * one[DELTA0_]
        integral[0] = 0.0
        if zigzag:
            executes[s, 0] = row * step_s
            now[KICK_], kick_until = side, row * step_s + theta[KICK_S]
        for k in range(round(one[LONGEST_] / step_s)):
            if not zigzag and k % tick == 0:
                order = autopilot(state, heading, integral, tick * step_s, hull[10] / hull[7], limit)
            if row * step_s >= kick_until:
                now[KICK_] = 0.0
            change(now, one, state, states[max(row - round(theta[LATE_S] / step_s), 0), 0], step_s, hull[11], theta)
            now[WPSI_], now[WY_] = white[row, 0] / np.sqrt(step_s), white[row, 1] / np.sqrt(step_s)
            conditions[row], run[row] = now, zigzags if zigzag else 0
            most = rudder_rate * step_s
            logged[row + 1] = logged[row] + min(max(order - logged[row], -most), most)
            fed[row + 1] = feed(logged, fed, row + 1, step_s, theta)
            advance(state, (fed[row], fed[row + 1]), (forcing[row], forcing[row + 1]), now, step_s, hull, theta, work)
            row += 1
            states[row] = state
            if zigzag and side * (state[2] + state[10] - base) >= one[PSI0_]:
                crossed += 1
                executes[s, crossed] = row * step_s
                if crossed >= one[LEGS_]:
                    break
                side = -side
                order = side * one[DELTA0_]
                now[KICK_], kick_until = side, row * step_s + theta[KICK_S]
                now[FOUL_] = 1.0 if crossed >= 0.6 * one[LEGS_] else 0.0
        conditions[row], run[row] = now, zigzags if zigzag else 0
    return row
