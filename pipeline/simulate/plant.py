"""The ship and her helm, compiled: eq. (16) in continuous time with her speed and her track, and the rudder.

The state is (v, r, psi, north, east, V): lateral speed through the water, m/s; yaw rate, rad/s; heading, rad, not
wrapped; position, m; forward speed through the water (what the log shows), m/s.

The path lies on a fine grid. Between its points a step is cut where the rudder arrives at its order and where the
heading of a zigzag crosses its limit, found by bisection, so no event waits for the grid.

All kernels stand in this one file: the compiled copy on disk is renewed when the file of the kernel changes, not when
that of a kernel it calls does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.compiled import compiled
from kempf.pipeline.simulate.hulls import SimulatedHull

Float = NDArray[np.float64]

#: Columns of the state.
STATE = ("v", "r", "psi", "north", "east", "V")

#: How the rudder order comes about.
AUTOPILOT, ZIGZAG, FIXED, ORDERS = 0, 1, 2, 3

#: A crossing is found to this part of the step; 2^-60 is below the rounding of the time.
_HALVINGS = 60


def hull_constants(hull: SimulatedHull) -> Float:
    """Return what the kernels read of a hull: a11, a12, a21, a22, b1, b2, l, V0, T, c, L; shape (11,)."""
    p = hull.parameters
    own = [hull.wind_arm_per_m, hull.trial_speed_m_s, hull.surge_time_s, hull.speed_loss, hull.length_m]
    return np.array([p.a11, p.a12, p.a21, p.a22, p.b1, p.b2, *own])


@compiled
def _derivative(state: Float, rudder: float, forcing: Float, constants: Float, out: Float) -> None:
    """Write d(state)/dt into ``out``: eq. (16), the speed, and the velocity over ground.

    ``forcing`` is F in m/s^2, the current to north and east in m/s, and V_T in m/s; ``constants`` see `hull_constants`.
    """
    a11, a12, a21, a22, b1, b2, arm, V0, T, c, L = constants
    v, r, psi, _, _, V = state
    F, current_north, current_east, V_T = forcing
    cosine, sine = np.cos(psi), np.sin(psi)
    out[0] = a11 * V * v + a12 * V * r + b1 * V * V * rudder + F
    out[1] = a21 * V * v + a22 * V * r + b2 * V * V * rudder + arm * F
    out[2] = r
    out[3] = V * cosine - (v + V_T) * sine + current_north
    out[4] = V * sine + (v + V_T) * cosine + current_east
    # the turn costs speed by its dimensionless rate; slow, first order
    turn = L * r / V0
    out[5] = (V0 * (1.0 - c * turn * turn) - V) / T


@compiled
def _advance(
    state: Float,
    rudder: float,
    rudder_speed: float,
    forcing: Float,
    forcing_slope: Float,
    step_s: float,
    constants: Float,
    out: Float,
) -> None:
    """Write the state ``step_s`` later into ``out``; fourth-order Runge-Kutta."""
    half = 0.5 * step_s
    k1, k2, k3, k4 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    _derivative(state, rudder, forcing, constants, k1)
    middle = forcing + half * forcing_slope
    rudder_middle = rudder + half * rudder_speed
    _derivative(state + half * k1, rudder_middle, middle, constants, k2)
    _derivative(state + half * k2, rudder_middle, middle, constants, k3)
    last = forcing + step_s * forcing_slope
    _derivative(state + step_s * k3, rudder + step_s * rudder_speed, last, constants, k4)
    out[:] = state + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@compiled
def slopes(states: Float, rudder: Float, forcing: Float, constants: Float) -> Float:
    """Return d(state)/dt at every row, shape (n, 6)."""
    out = np.empty_like(states)
    for k in range(states.shape[0]):
        _derivative(states[k], rudder[k], forcing[k], constants, out[k])
    return out


@compiled
def _autopilot_order(
    heading_error: float, yaw_rate: float, integral: float, tick_s: float, gains: Float, limit: float
) -> tuple[float, float]:
    """Return the rudder order of a PID course keeper and its new integral, rad and rad s."""
    # far from the course the integral would only wind up
    if abs(heading_error) < 0.1:
        integral += heading_error * tick_s
    order = -(gains[0] * heading_error + gains[1] * yaw_rate + gains[2] * integral)
    return min(max(order, -limit), limit), integral


@compiled
def _cell(
    state: Float,
    rudder: float,
    order: float,
    rudder_rate: float,
    forcing: Float,
    forcing_slope: Float,
    length_s: float,
    target: float,
    side: float,
    constants: Float,
) -> tuple[float, float, bool]:
    """Integrate up to ``length_s`` or to the first event; ``state`` is changed in place.

    The events: the rudder arrives at its order; the heading crosses ``target`` towards ``side`` (0: not watched).
    """
    step, speed, arrives = length_s, 0.0, False
    gap = order - rudder
    if gap != 0.0:
        speed = rudder_rate if gap > 0.0 else -rudder_rate
        if abs(gap) / rudder_rate <= step:
            step, arrives = abs(gap) / rudder_rate, True
    new = np.empty(6)
    _advance(state, rudder, speed, forcing, forcing_slope, step, constants, new)
    crossed = side != 0.0 and side * (new[2] - target) >= 0.0
    if crossed:
        low, high = 0.0, step
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            _advance(state, rudder, speed, forcing, forcing_slope, middle, constants, new)
            if side * (new[2] - target) >= 0.0:
                high = middle
            else:
                low = middle
        arrives = arrives and high == step
        step = high
        _advance(state, rudder, speed, forcing, forcing_slope, step, constants, new)
    state[:] = new
    return order if arrives else rudder + speed * step, step, crossed


@compiled
def _through_cell(
    state: Float,
    helm: Float,
    zigzag: Float,
    rudder_rate: float,
    forcing: Float,
    forcing_slope: Float,
    begin_s: float,
    cell_s: float,
    substeps: int,
    constants: Float,
    crossings: Float,
) -> None:
    """Integrate one cell of the grid; ``state``, ``helm`` and ``crossings`` are changed in place.

    ``helm`` is the rudder, its order, the side (0 unless in a zigzag) and the number of crossings so far; ``zigzag`` is
    the base heading, psi0, delta0, the first side and the number of legs, not read where the side is 0.
    """
    for part in range(substeps):
        now, end = cell_s * part / substeps, cell_s * (part + 1) / substeps
        while now < end:
            side = helm[2]
            target = zigzag[0] + side * zigzag[1] if side != 0.0 else 0.0
            here = forcing + now * forcing_slope
            helm[0], gone, crossed = _cell(
                state, helm[0], helm[1], rudder_rate, here, forcing_slope, end - now, target, side, constants
            )
            now = end if gone >= end - now else now + gone
            if crossed:
                number = int(helm[3])
                crossings[number] = begin_s + now
                helm[3] += 1.0
                # after the last leg the rudder keeps its order until the next manoeuvre begins
                helm[2] = -side if helm[3] < zigzag[4] else 0.0
                if helm[2] != 0.0:
                    helm[1] = helm[2] * zigzag[2]


@compiled
def steer(
    kind: int,
    settings: Float,
    orders: Float,
    grid: tuple[float, int, int],
    span: tuple[int, int],
    rudder_limits: tuple[float, float],
    constants: Float,
    states: Float,
    rudders: Float,
    ordered: Float,
    forcing: Float,
    crossings: Float,
) -> tuple[int, int]:
    """Sail one manoeuvre into the tables.

    Parameters
    ----------
    kind : int
        `AUTOPILOT`, `ZIGZAG`, `FIXED` or `ORDERS`.
    settings : ndarray
        Of the kind. AUTOPILOT: heading, three gains. ZIGZAG: base heading, psi0, delta0, first side (+1, -1), number
        of legs. FIXED: rudder, change of heading that ends it. ORDERS: none.
    orders : ndarray, shape (n_ticks,)
        Rudder orders of kind ORDERS, one a tick.
    grid : (float, int, int)
        Length of a cell in s, integrator steps in it, cells between two orders of a helmsman.
    span : (int, int)
        Row to start from, which holds the initial state, and number of cells at most.
    rudder_limits : (float, float)
        Rate in rad/s, largest angle in rad.
    constants : ndarray, shape (11,)
        See `kempf.pipeline.simulate.plant.hull_constants`.
    states, rudders, ordered, forcing : ndarray
        The columns of the tables in `kempf.pipeline.simulate.programme`.
    crossings : ndarray
        Receives the instants of the zigzag's crossings, s since row 0.
    """
    cell_s, substeps, tick_cells = grid
    first, cells = span
    rudder_rate, limit = rudder_limits
    state, integral = states[first].copy(), 0.0
    start_heading = state[2]
    helm = np.array([rudders[first], ordered[first], 0.0, 0.0])
    if kind == ZIGZAG:
        helm[2] = settings[3]
        helm[1] = settings[3] * settings[2]
    elif kind == FIXED:
        helm[1] = settings[0]
    for k in range(cells):
        row = first + k
        if kind == AUTOPILOT and k % tick_cells == 0:
            error, tick_s = state[2] - settings[0], tick_cells * cell_s
            helm[1], integral = _autopilot_order(error, state[1], integral, tick_s, settings[1:4], limit)
        elif kind == ORDERS and k % tick_cells == 0:
            helm[1] = orders[k // tick_cells]
        ordered[row] = helm[1]
        slope = (forcing[row + 1] - forcing[row]) / cell_s
        _through_cell(
            state,
            helm,
            settings,
            rudder_rate,
            forcing[row],
            slope,
            row * cell_s,
            cell_s,
            substeps,
            constants,
            crossings,
        )
        states[row + 1], rudders[row + 1], ordered[row + 1] = state, helm[0], helm[1]
        turned = kind == FIXED and abs(state[2] - start_heading) >= settings[1]
        if turned or (kind == ZIGZAG and helm[3] >= settings[4]):
            return k + 1, int(helm[3])
    return cells, int(helm[3])


@compiled
def follow(rudder: Float, grid: tuple[float, int], first: int, constants: Float, states: Float, forcing: Float) -> None:
    """Sail cells whose rudder is known into the table of states.

    Parameters
    ----------
    rudder : ndarray, shape (n + 1,)
        What the hull feels at the cells' ends, rad; linear between them.
    grid : (float, int)
        Length of a cell in s, integrator steps in it.
    first : int
        Row to start from, which holds the initial state.
    constants : ndarray, shape (11,)
        See `kempf.pipeline.simulate.plant.hull_constants`.
    states, forcing : ndarray
        The columns of the tables in `kempf.pipeline.simulate.programme`.
    """
    cell_s, substeps = grid
    step_s = cell_s / substeps
    for k in range(rudder.size - 1):
        row = first + k
        rate, slope = (rudder[k + 1] - rudder[k]) / cell_s, (forcing[row + 1] - forcing[row]) / cell_s
        states[row + 1] = states[row]
        for part in range(substeps):
            now, state = part * step_s, states[row + 1].copy()
            _advance(
                state,
                rudder[k] + now * rate,
                rate,
                forcing[row] + now * slope,
                slope,
                step_s,
                constants,
                states[row + 1],
            )
