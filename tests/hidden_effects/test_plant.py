"""The plant without an effect is eq. (16) as the other simulator has it, and every effect is what its equation says."""

from __future__ import annotations

from dataclasses import asdict, replace
from math import radians

import numpy as np
import pytest

from benchmarks.diagnose.hidden_effects import plant, programme, sail
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE, theta
from benchmarks.diagnose.hidden_effects.outsiders import OUTSIDERS
from kempf.pipeline.model.batch import ONE
from kempf.pipeline.model.terms.evaluation import evaluate
from kempf.pipeline.model.terms.expression import compiled
from kempf.pipeline.model.terms.program import DEPTH
from kempf.pipeline.simulate import programme as other
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest
from kempf.schemas.effects import catalogue

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
    for stated in catalogue()[name].parameters if name in CATALOGUE else ():
        assert stated.low <= effect.parameters(c).get(stated.name, stated.low) <= stated.high
    if not effect.sizes and effect.most == float("inf"):
        # the strength was chosen without the effect; with it she turns less, and the share is another, but not wholly
        assert 0.1 < sail.added(voyages, hull, weathers, theta(effect, c, hull)) < 0.6


#: A state of the ferry at which every term says something.
V, R, SPEED, RUDDER, ROLL, HEADING, BEHIND = -0.9, 0.02, 8.5, -0.25, -0.03, 0.7, -0.4
FERRY = HULLS["ferry"]
WIND = (
    9.0 + SPEED * np.cos(HEADING) - V * np.sin(HEADING) + 0.3,
    SPEED * np.sin(HEADING) + V * np.cos(HEADING) - 0.2,
)


def gain(name: str, c: float) -> tuple[float, float]:
    """What an effect adds to dv/dt and dr/dt of the ferry."""
    state, now = np.zeros(plant.N_STATE), np.zeros(plant.N_CONDITIONS)
    state[[0, 1, 2, 5, 6, 9]] = V, R, HEADING, SPEED, ROLL, BEHIND
    now[plant.N_], now[plant.H_], now[plant.DAY_] = 0.9 * FERRY.shaft_speed_per_s, 3.0 * FERRY.draught_m, 1.0
    forcing, out = np.array([0.0, 0.3, -0.2, 9.0]), np.zeros((2, plant.N_STATE))
    effect, ship = (CATALOGUE | OUTSIDERS)[name], sail.constants(FERRY, 0.0)
    for row, one in enumerate((theta(effect, c, FERRY), np.zeros(plant.N_THETA))):
        plant.derivative(state, RUDDER, forcing, now, ship, one, out[row])
    return float(out[0, 0] - out[1, 0]), float(out[0, 1] - out[1, 1])


def said(text: str, c: dict[str, float]) -> float:
    """What an expression of the catalogue says in that state; the approach was at the same shaft speed."""
    p = asdict(FERRY.parameters)
    angle = float(np.arctan2(WIND[1], WIND[0])) - HEADING
    here = {"v": V, "r": R, "V": SPEED, "delta": RUDDER, "phi": ROLL, "m1": BEHIND, "day": 1.0, "T": FERRY.draught_m}
    here |= {"U": float(np.hypot(*WIND)), "gamma": angle, "h": 3.0 * FERRY.draught_m, "L": FERRY.length_m}
    n = 0.9 * FERRY.shaft_speed_per_s
    here |= {"n": n, "n0": n, "V0": 0.9 * FERRY.trial_speed_m_s} | p | c
    program = compiled(text, {name: k for k, name in enumerate(here)})
    stack, values = np.zeros((DEPTH, 1, 1)), np.array(list(here.values()))[:, None]
    none, slopes = np.zeros(0, dtype=np.int64), np.zeros((len(here), 0, 1))
    evaluate(program.code, program.constants, none, values, slopes, stack, np.zeros(1), ONE)
    return float(stack[0, 0, 0])


TERMS = sorted(name for name, e in CATALOGUE.items() if not e.sensor and catalogue()[name].terms and name != "waves")


@pytest.mark.parametrize("name", TERMS)
def test_an_effect_is_what_the_catalogue_calls_so(name: str) -> None:
    """Two programs that share no line: the plant's, and the expressions of the catalogue, at the same parameter."""
    c = 1e-3
    terms, given = catalogue()[name].terms, CATALOGUE[name].parameters(c)
    lift = [b * SPEED**2 for b in (FERRY.parameters.b1, FERRY.parameters.b2)]
    turned = said(terms["rudder"], given) if "rudder" in terms else 0.0
    stated = [
        (said(terms[target], given) if target in terms else 0.0) + b * turned
        for target, b in zip(("sway", "yaw"), lift, strict=True)
    ]
    # the strips of the one differ a little from the integral of the other
    close = {"cross_flow_drag": 2e-2, "cross_flow_cubic": 3e-3}.get(name, 1e-6)
    assert gain(name, c) == pytest.approx(stated, rel=close, abs=1e-15)


def test_effects_outside_the_catalogue_are_their_equations() -> None:
    p, L = FERRY.parameters, FERRY.length_m
    flat = 0.05 * FERRY.trial_speed_m_s
    stated = {
        "bow_thruster_product": (L / 6 * V * SPEED * RUDDER, V * SPEED * RUDDER),
        "heading_harmonic": (L / 6 * np.sin(3 * HEADING), np.sin(3 * HEADING)),
        "dead_zone": (p.a11 * SPEED * flat, p.a21 * SPEED * flat),
    }
    for name, expected in stated.items():
        assert gain(name, 1e-3) == pytest.approx([1e-3 * e for e in expected], rel=1e-6), name


def test_the_catalogue_knows_every_effect_of_its_own_and_no_other() -> None:
    assert set(CATALOGUE) <= set(catalogue())
    assert not set(OUTSIDERS) & set(catalogue())
    for name, effect in CATALOGUE.items():
        assert set(effect.parameters(1.0)) <= {p.name for p in catalogue()[name].parameters}, name
        assert effect.unit == catalogue()[name].parameters[0].unit, name


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
    slow = np.diff(stock(plant.RATE_LIMIT, 20.0)) / step
    assert np.max(np.abs(slow)) == pytest.approx(0.05)
    gap = stock(plant.BACKLASH, radians(4.0)) - logged
    assert np.max(np.abs(gap)) == pytest.approx(radians(2.0))
    assert np.min(gap) == pytest.approx(-np.max(gap))
