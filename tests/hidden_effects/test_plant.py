"""The plant without an effect is eq. (16) as the other simulator has it, and every effect is what its equation says."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from benchmarks.hidden_effects import plant, programme, sail
from benchmarks.hidden_effects.effects import CATALOGUE, theta
from benchmarks.hidden_effects.outsiders import OUTSIDERS
from pipeline.simulate import programme as other
from pipeline.simulate.disturbances import Disturbance, Environment
from pipeline.simulate.hulls import HULLS
from pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest

MOVING = {name: e for name, e in (CATALOGUE | OUTSIDERS).items() if not e.sensor}
WEATHER = Environment(Disturbance(4e-3, 1e-3), Disturbance(0.2, 0.05), Disturbance(-0.1, 0.05))


@pytest.mark.parametrize("name", sorted(HULLS))
def test_without_an_effect_she_sails_as_the_ship_of_the_other_simulator(name: str) -> None:
    """The same rudder and the same weather on the same grid: the paths agree to what a corner within a cell makes."""
    hull = replace(HULLS[name], speed_loss=0.8)
    time_s = hull.length_m / hull.trial_speed_m_s
    run = (SteadyCourse(2 * time_s), ZigzagTest(20.0, 20.0, legs=4, duration_s=40 * time_s))
    path, _ = other.sail(hull, run, WEATHER, seed=5, heading_deg=40.0)
    ship, none = sail.constants(hull, 0.0), np.zeros(plant.N_THETA)
    state, now, work = np.zeros(plant.N_STATE), np.zeros(plant.N_CONDITIONS), np.empty((4, plant.N_STATE))
    state[:6] = path.state[0]
    now[plant.N_], now[plant.H_] = hull.shaft_speed_per_s, 50.0
    found = [state[:6].copy()]
    forcing = np.column_stack([path.forcing[:, :3], np.zeros(path.rudder.size)])
    for k in range(path.rudder.size - 1):
        ends = (path.rudder[k], path.rudder[k + 1]), (forcing[k], forcing[k + 1])
        plant.advance(state, *ends, now, path.step_s, ship, none, work)
        found.append(state[:6].copy())
    scale = np.max(np.abs(path.state - path.state[0]), axis=0)
    np.testing.assert_array_less(np.max(np.abs(np.array(found) - path.state), axis=0) / scale, 1e-4)


@pytest.fixture(scope="module")
def boat() -> tuple[programme.Hull, tuple[programme.Weather, ...], sail.Voyage]:
    hull = programme.ship("usv", 3)
    weathers = tuple(programme.weather(hull, "moderate", 3, day) for day in range(programme.DAYS))
    return hull, weathers, sail.voyage(hull, weathers[1], None, 0.0, 3, 1)


@pytest.mark.parametrize("name", sorted(MOVING))
def test_every_effect_changes_the_motion_and_every_zigzag_is_finished(name: str, boat) -> None:
    hull, weathers, plain = boat
    effect = MOVING[name]
    c, voyages = sail.voyages(hull, weathers, effect, 2, 3)
    with_effect = voyages[1]
    n = min(plain.logged.size, with_effect.logged.size)
    moved = np.abs(with_effect.trajectory().column("r")[:n] - plain.trajectory().column("r")[:n])
    assert np.max(moved) > radians(0.02)
    assert [len(e) for e in with_effect.executes_s] == [len(e) for e in plain.executes_s]
    assert effect.sign * c >= 0.0
    if not effect.sizes and effect.most == float("inf"):
        # the strength was chosen without the effect; with it she turns less, and the share is another, but not wholly
        assert 0.1 < sail.added(voyages, hull, weathers, theta(effect, c, hull)) < 0.6


def gain(name: str, c: float, state: np.ndarray, rudder: float) -> tuple[float, float]:
    """What an effect adds to dv/dt and dr/dt of the ferry in a given state."""
    hull = HULLS["ferry"]
    now = np.zeros(plant.N_CONDITIONS)
    now[plant.N_], now[plant.H_], now[plant.DAY_] = 0.9 * hull.shaft_speed_per_s, 3.0 * hull.draught_m, 1.0
    forcing, out = np.array([0.0, 0.3, -0.2, 9.0]), np.zeros((2, plant.N_STATE))
    effect, ship = (CATALOGUE | OUTSIDERS)[name], sail.constants(hull, 0.0)
    for row, one in enumerate((theta(effect, c, hull), np.zeros(plant.N_THETA))):
        plant.derivative(state, rudder, forcing, now, ship, one, out[row])
    return float(out[0, 0] - out[1, 0]), float(out[0, 1] - out[1, 1])


def test_effects_are_their_equations() -> None:
    hull = HULLS["ferry"]
    p, L, V0, n0 = hull.parameters, hull.length_m, hull.trial_speed_m_s, hull.shaft_speed_per_s
    v, r, V, d, phi = -0.9, 0.02, 8.5, -0.25, -0.03
    state = np.zeros(plant.N_STATE)
    state[[0, 1, 2, 5, 6]] = v, r, 0.7, V, phi
    x = np.linspace(-L / 2, L / 2, 20001)
    u = v + x * r
    north, east = 9.0 + V * np.cos(0.7) - v * np.sin(0.7) + 0.3, V * np.sin(0.7) + v * np.cos(0.7) - 0.2
    U2, g = north**2 + east**2, np.arctan2(east, north) - 0.7
    lift = p.b1 * V**2, p.b2 * V**2
    told = {
        "cross_flow_drag": (
            -np.trapezoid(np.abs(u) * u, x) / L,
            -12 / L**2 * np.trapezoid(x * np.abs(u) * u, x) / L,
        ),
        "sway_quadratic": (v * abs(v), 0),
        "yaw_quadratic": (0, r * abs(r)),
        "sway_abs_v_r": (abs(v) * r, 0),
        "yaw_abs_r_v": (0, abs(r) * v),
        "sway_cubic": (v**3 / V, 0),
        "yaw_v2r": (0, v**2 * r / V),
        "yaw_vr2": (0, v * r**2 / V),
        "yaw_cubic": (0, r**3 / V),
        "rudder_stall": tuple(-b * d**3 for b in lift),
        "flow_straightening": tuple(b * (v / V) ** 2 * d for b in lift),
        "neutral_angle": lift,
        "rudder_asymmetry": tuple(-b * d for b in lift),
        "propeller_wash": tuple(b * d * ((0.9 * V0 / V) ** 2 - 1) for b in lift),
        "propeller_walk": tuple(b * V0**2 * 0.9**2 for b in (p.b1, p.b2)),
        "wind_relative": (U2 * np.sin(g), -2 / L * U2 * np.sin(2 * g)),
        "shallow_water": tuple(V * (a * v + b * r) / 9 for a, b in ((p.a11, p.a12), (p.a21, p.a22))),
        "roll_coupling": (0, phi),
        "load_condition": (0, lift[1] * d),
        "bow_thruster_product": (L / 6 * v * V * d, v * V * d),
        "heading_harmonic": (L / 6 * np.sin(2.1), np.sin(2.1)),
        "dead_zone": (-p.a11 * V * -0.05 * V0, -p.a21 * V * -0.05 * V0),
    }
    for name, expected in told.items():
        assert gain(name, 1e-3, state, d) == pytest.approx([1e-3 * e for e in expected], rel=2e-3, abs=1e-12), name
    assert n0 > 0.0


def test_the_rudder_stock_is_late_slow_and_loose() -> None:
    step = 0.05
    time = np.arange(0.0, 60.0, step)
    logged = radians(20.0) * np.clip(np.sin(0.3 * time) * 3.0, -1.0, 1.0)

    def stock(slot: int, c: float) -> np.ndarray:
        strengths = np.zeros(plant.N_THETA)
        strengths[slot] = c
        fed = logged.copy()
        for k in range(1, time.size):
            fed[k] = plant.feed(logged, fed, k, step, strengths)
        return fed

    late = stock(plant.DEAD_TIME, 1.33)
    np.testing.assert_allclose(late, np.interp(time - 1.33, time, logged), atol=1e-12)
    slow = np.diff(stock(plant.RATE_LIMIT, 0.05)) / step
    assert np.max(np.abs(slow)) == pytest.approx(0.05)
    gap = stock(plant.BACKLASH, radians(4.0)) - logged
    assert np.max(np.abs(gap)) == pytest.approx(radians(2.0))
    assert np.min(gap) == pytest.approx(-np.max(gap))
