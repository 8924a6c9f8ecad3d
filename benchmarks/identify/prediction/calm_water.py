"""What a ship with an effect does in calm, deep water: sailed by the plant of the hidden cases."""

from __future__ import annotations

from math import degrees, radians

import numpy as np
from numpy.typing import NDArray

from benchmarks.diagnose.hidden_effects import plant, sail
from benchmarks.identify.prediction.compared import (
    ANGLES_DEG,
    OVERSHOOTS,
    RUDDERS_DEG,
    TURNS,
    Truth,
    circle,
    circle_figures,
    zigzag,
)
from kempf.pipeline.channels.series import Float
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.schemas.errors import DataRejected

#: Steady course before the first execute and the longest that a manoeuvre takes, in ship lengths at the trial speed.
_STEADY_LENGTHS, _LONGEST_LENGTHS = 80.0, 1000.0
#: Of the grid: a helmsman who answers at its points is late by no more than a thousandth of a length.
_CELLS_A_LENGTH = 1000.0
#: Of the water, in draughts.
_DEEP = 1e6
_TURN_RAD = 2.0 * np.pi * TURNS


def truth_of(hull: SimulatedHull, strengths: Float) -> Truth:
    """Return the figures of every manoeuvre.

    Parameters
    ----------
    strengths : ndarray, shape (47,)
        Of the effects, see `benchmarks.diagnose.hidden_effects.plant`.

    Raises
    ------
    DataRejected
        ``no_ship``: she does not come to the end of one.
    """
    found = {circle(rudder): circle_of(*sailed(hull, strengths, _TURN_RAD, rudder, 1)) for rudder in RUDDERS_DEG}
    for heading, rudder in ANGLES_DEG:
        _, state, rows = sailed(hull, strengths, radians(heading), rudder, 4)
        found[zigzag(heading, rudder)] = _overshoots(state, rows)
    return found


def circle_of(time_s: Float, state: Float, _: NDArray[np.int64]) -> dict[str, float]:
    """Return the figures of a circle from its execute on."""
    v, psi, north, east, forward = (state[:, plant.STATE.index(x)] for x in ("v", "psi", "north", "east", "V"))
    return circle_figures(time_s, north, east, psi, v, forward)


def _overshoots(state: Float, rows: NDArray[np.int64]) -> dict[str, float]:
    psi, found = state[:, plant.STATE.index("psi")], {}
    for k, name in enumerate(OVERSHOOTS):
        swing = (-1) ** k * psi[rows[k + 1] : rows[k + 2] + 1]
        # counted from where the helmsman of the grid answers, just after the heading that he waits for
        found[name] = degrees(float(swing.max() - swing[0]))
    return found


def sailed(
    hull: SimulatedHull, strengths: Float, heading_rad: float, rudder_deg: float, legs: int
) -> tuple[Float, Float, NDArray[np.int64]]:
    """Sail one manoeuvre to starboard from a settled straight course.

    Parameters
    ----------
    heading_rad : float
        Heading change that ends a leg: one leg of many turns is a circle.

    Returns
    -------
    (ndarray, ndarray, ndarray of int)
        Instants from the first execute, s, shape (n,); states, shape (n, 14); rows of the orders and of the end.

    Raises
    ------
    DataRejected
        ``no_ship``: she does not come to its end.
    """
    own_s = hull.length_m / hull.trial_speed_m_s
    step_s = own_s / _CELLS_A_LENGTH
    orders = np.zeros((2, 9))
    orders[:, plant.SHAFT_], orders[:, plant.BOTTOM_] = hull.shaft_speed_per_s, _DEEP * hull.draught_m
    orders[0, plant.LONGEST_], orders[1, plant.LONGEST_] = _STEADY_LENGTHS * own_s, _LONGEST_LENGTHS * own_s
    orders[1, plant.KIND_], orders[1, plant.SIDE_], orders[1, plant.LEGS_] = 1.0, 1.0, legs
    orders[1, plant.PSI0_], orders[1, plant.DELTA0_] = heading_rad, radians(rudder_deg)
    n = int(np.sum(np.rint(orders[:, plant.LONGEST_] / step_s))) + 1
    states, conditions = np.zeros((n, plant.N_STATE)), np.zeros((n, plant.N_CONDITIONS))
    executes = np.full((2, 20), np.nan)
    states[0, plant.STATE.index("V")] = hull.trial_speed_m_s
    now = conditions[0]
    # of the last of her two days, as which the program takes a ship whose load changes
    now[plant.N_], now[plant.H_], now[plant.DAY_] = hull.shaft_speed_per_s, _DEEP * hull.draught_m, 1.0
    cells = plant.voyage(
        *(orders, hull.rudder_rate_rad_s, (step_s, 20), sail.constants(hull, 0.0), strengths),
        *(np.zeros((n, len(plant.FORCING))), np.zeros((n, 2))),
        *(states, np.zeros(n), np.zeros(n), conditions, np.zeros(n, dtype=np.int64), executes),
    )
    instants = executes[1][np.isfinite(executes[1])]
    if instants.size < legs + 1 or not np.all(np.isfinite(states[: cells + 1])):
        raise DataRejected("no_ship", f"{hull.name} does not come to its end.", "Take a weaker effect.")
    rows = np.rint(instants / step_s).astype(np.int64)
    time_s = step_s * np.arange(cells + 1 - rows[0])
    return time_s, states[rows[0] : cells + 1], rows - rows[0]
