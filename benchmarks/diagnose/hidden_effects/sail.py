"""One day of a hidden case: the programme sailed by the plant, its effect made as strong as it shall be."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from benchmarks.diagnose.hidden_effects import plant, programme
from benchmarks.diagnose.hidden_effects.effects import SHARES, HiddenEffect, scales, theta
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.trajectory import Trajectory
from kempf.schemas.errors import KempfError

Float = NDArray[np.float64]

_GRAVITY_M_S2 = 9.80665
_TICK_S = 0.5
_WEAKENINGS, _WEAKER = 5, 0.6


class VoyageFailed(KempfError):
    """A ship left the range of the model or did not finish a zigzag; her case cannot be written."""


@dataclass(frozen=True, eq=False)
class Voyage:
    """What truly happened on a day."""

    #: Of the grid.
    step_s: float
    #: state, slope: Shape (n, 14). Columns `benchmarks.diagnose.hidden_effects.plant.STATE`, and their rates.
    state: Float
    slope: Float
    #: logged, fed: Shape (n,). Rudder of the log, and behind dead time, rate limit and backlash, rad.
    logged: Float
    fed: Float
    #: forcing, conditions: Shape (n, 4) and (n, 13).
    forcing: Float
    conditions: Float
    #: Shape (n,). Number of the zigzag, 0 outside.
    run: NDArray[np.int64]
    #: By zigzag: instants of the executes and of the end.
    executes_s: tuple[tuple[float, ...], ...]

    def trajectory(self) -> Trajectory:
        """Return the path as the instruments of `kempf.pipeline.simulate` read it; waves are part of the motion."""
        state, slope = self.state[:, :6].copy(), self.slope[:, :6].copy()
        name = plant.STATE.index
        for base, wave in (("psi", "q_psi"), ("r", "dq_psi"), ("v", "dq_y")):
            state[:, name(base)] += self.state[:, name(wave)]
            slope[:, name(base)] += self.slope[:, name(wave)]
        forcing = np.column_stack([self.forcing[:, :3], np.zeros(self.logged.size)])
        return Trajectory(self.step_s, state, slope, self.logged, self.logged, forcing)


def constants(hull: SimulatedHull, wave_from_rad: float) -> Float:
    """Return what the kernels read of a hull, slots `benchmarks.diagnose.hidden_effects.plant.CONSTANTS`."""
    p, L, V0 = hull.parameters, hull.length_m, hull.trial_speed_m_s
    own = [hull.wind_arm_per_m, V0, hull.surge_time_s, hull.speed_loss, L, hull.shaft_speed_per_s, hull.draught_m]
    # a period of roll of 0.5 to 1 ship time, lightly damped
    roll = [hull.heel_per_g, 2.0 * pi * V0 / (0.7 * L), 0.15]
    waves = [sqrt(2.0 * pi * _GRAVITY_M_S2 / L), wave_from_rad, _GRAVITY_M_S2]
    return np.array([p.a11, p.a12, p.a21, p.a22, p.b1, p.b2, *own, *roll, *waves])


def voyage(
    hull: SimulatedHull, weather: programme.Weather, effect: HiddenEffect | None, c: float, seed: int, day: int
) -> Voyage:
    """Sail a day by its programme, see `by_orders`."""
    return by_orders(programme.orders(hull, seed, day), hull, weather, effect, c, seed, day)


def by_orders(
    orders: Float,
    hull: SimulatedHull,
    weather: programme.Weather,
    effect: HiddenEffect | None,
    c: float,
    seed: int,
    day: int,
) -> Voyage:
    """Sail a day.

    Parameters
    ----------
    orders : ndarray, shape (n, 9)
        As `programme.orders` gives them.
    effect : HiddenEffect or None
        None: eq. (16).
    c : float
        Its parameter.
    seed : int
        Of everything random; not of the effect.
    day : int
        0 or 1.

    Raises
    ------
    VoyageFailed
        She left the range of the model, or a zigzag was not finished.
    """
    step_s = programme.grid_s(hull)
    n = int(np.sum(np.rint(orders[:, plant.LONGEST_] / step_s))) + 1
    states, logged, fed = np.zeros((n, plant.N_STATE)), np.zeros(n), np.zeros(n)
    conditions, run = np.zeros((n, plant.N_CONDITIONS)), np.zeros(n, dtype=np.int64)
    executes = np.full((orders.shape[0], 20), np.nan)
    states[0, plant.STATE.index("psi")] = orders[0, plant.HEADING_]
    states[0, plant.STATE.index("V")] = hull.trial_speed_m_s
    now = conditions[0]
    now[plant.N_], now[plant.H_] = orders[0, plant.SHAFT_], orders[0, plant.BOTTOM_]
    now[plant.DAY_], now[plant.WIND_], now[plant.HYST_] = day, weather.wind_from_rad, 1.0
    day_seed = seed * programme.DAYS + day
    forcing = weather.forcing(n, step_s, day_seed)
    white = stream(day_seed, "waves").standard_normal((n, 2))
    strengths, ship = theta(effect, c, hull), constants(hull, weather.wave_from_rad)
    grid = (step_s, max(1, round(min(_TICK_S, 0.02 * hull.length_m / hull.trial_speed_m_s) / step_s)))
    cells = plant.voyage(
        *(orders, hull.rudder_rate_rad_s, grid, ship, strengths, forcing, white),
        *(states, logged, fed, conditions, run, executes),
    )
    end = cells + 1
    _check(hull, orders, states[:end], executes)
    slope = plant.slopes(states[:end], fed[:end], forcing[:end], conditions[:end], ship, strengths)
    stated = tuple(tuple(row[np.isfinite(row)].tolist()) for row in executes[orders[:, plant.KIND_] == 1.0])
    return Voyage(
        *(step_s, states[:end], slope, logged[:end], fed[:end], forcing[:end], conditions[:end], run[:end], stated)
    )


def _check(hull: SimulatedHull, orders: Float, states: Float, executes: Float) -> None:
    V, r = states[:, plant.STATE.index("V")], states[:, plant.STATE.index("r")]
    turn = np.abs(r) * hull.length_m / hull.trial_speed_m_s
    sane = bool(np.all(np.isfinite(states))) and float(V.min()) > 0.2 * hull.trial_speed_m_s and float(turn.max()) < 3.0
    legs = np.sum(np.isfinite(executes), axis=1) - 1
    zigzags = orders[:, plant.KIND_] == 1.0
    if not sane or bool(np.any(legs[zigzags] < orders[zigzags, plant.LEGS_])):
        raise VoyageFailed(
            "voyage_failed",
            f"{hull.name} sailed {legs[zigzags].tolist()} of {orders[zigzags, plant.LEGS_].tolist()} legs, "
            f"V down to {float(V.min()):.3g} m/s, turn up to {float(turn.max()):.3g} speeds a length.",
            "Take a weaker effect.",
        )


def added(
    days: tuple[Voyage, ...], hull: SimulatedHull, weathers: tuple[programme.Weather, ...], strengths: Float
) -> float:
    """Return what ``strengths`` would add along voyages that went on without, as a share of the rudder's work.

    Root mean square over the zigzags of what dv/dt gains over that of b1 V^2 d, and of dr/dt over b2 V^2 d; the greater
    share.
    """
    squares = np.zeros((2, 2))
    none = np.zeros(plant.N_THETA)
    for day, weather in zip(days, weathers, strict=True):
        rows = day.run > 0
        ship = constants(hull, weather.wave_from_rad)
        given = (day.state[rows], day.fed[rows], day.forcing[rows], day.conditions[rows], ship)
        gain = plant.slopes(*given, strengths)[:, :2] - plant.slopes(*given, none)[:, :2]
        V = day.state[rows, plant.STATE.index("V")]
        rudder = V**2 * day.logged[rows]
        squares[0] += np.sum(gain**2, axis=0)
        squares[1] += np.sum(rudder**2) * np.array([hull.parameters.b1, hull.parameters.b2]) ** 2
    return float(np.sqrt(np.max(squares[0] / squares[1])))


def strength_of(
    hull: SimulatedHull, weathers: tuple[programme.Weather, ...], effect: HiddenEffect, strength: int, seed: int
) -> float:
    """Return the parameter c of an effect that makes it small (0), medium (1) or large (2) in this case.

    Parameters
    ----------
    weathers : tuple of Weather
        One a day.
    """
    sign = float(effect.sign) or (1.0 if stream(seed, "sign").random() < 0.5 else -1.0)
    if effect.sizes:
        return sign * effect.sizes[strength] * scales(hull)[effect.scale]
    # what an effect needs beside its own parameter, such as the time of a kick, is there before
    days = tuple(voyage(hull, w, effect, 0.0, seed, day) for day, w in enumerate(weathers))
    unit = added(days, hull, weathers, theta(effect, 1.0, hull))
    return sign * min(SHARES[strength] / unit, effect.most)


def voyages(
    hull: SimulatedHull, weathers: tuple[programme.Weather, ...], effect: HiddenEffect | None, strength: int, seed: int
) -> tuple[float, tuple[Voyage, ...]]:
    """Return the parameter of the effect and the voyages, one a day; an effect she cannot sail with is weakened.

    Parameters
    ----------
    weathers : tuple of Weather
        One a day.
    strength : int
        0, 1 or 2.

    Raises
    ------
    VoyageFailed
        She could not sail either way.
    """
    c = strength_of(hull, weathers, effect, strength, seed) if effect else 0.0
    for _ in range(_WEAKENINGS):
        try:
            return c, tuple(voyage(hull, w, effect, c, seed, day) for day, w in enumerate(weathers))
        except VoyageFailed:
            c *= _WEAKER
    return c, tuple(voyage(hull, w, effect, c, seed, day) for day, w in enumerate(weathers))
