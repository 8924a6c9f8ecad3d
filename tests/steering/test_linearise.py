"""The linear model of a ship with effects against eq. (16), closed forms, and the effects' own code."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from kempf.flows.jobs.steering.steered_ship import SteeredShip
from kempf.pipeline.model.chain import N_CHAIN
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.effects import RUDDER_COURSES
from kempf.pipeline.model.terms.own import from_expression
from kempf.pipeline.simulate.disturbances import CALM
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.steering_gear import DeadTime, Lag, Play, RateLimit, SteeringGear
from kempf.pipeline.steering.carried import carried, sentences
from kempf.pipeline.steering.course_keeping import LawSettings, course_law
from kempf.pipeline.steering.motion import ShipEffects, equivalent_hull, linear_hull, linear_motion
from kempf.pipeline.steering.robustness import closed_loop, share_held
from kempf.pipeline.steering.state_space import continuous, discretised
from kempf.pipeline.steering.track import course_change, keep_course
from kempf.schemas import effects as catalogue
from kempf.schemas.model_spec import ModelSpec
from tests.steering.ships import covariance_of, hull_of

HULL, V, ARM, LENGTH = hull_of("mariner"), 7.7, 0.004, 160.93
PAGE = Path(__file__).parents[2] / "docs" / "effects.md"
STILL = ModelSpec(wind="none", current="none")


def having(**values: float | tuple[float, ...]) -> ShipEffects:
    """Effects of the catalogue by name with their parameters."""
    model = EffectModel(tuple(catalogue.get(name) for name in values))
    return ShipEffects(model, np.hstack([np.atleast_1d(v) for v in values.values()]), LENGTH, 7.5, 1.0)


def own(text: str, *values: float) -> ShipEffects:
    return ShipEffects(EffectModel((from_expression(text),)), np.array(values), LENGTH, 7.5)


def test_without_effects_the_compiled_model_is_eq_16_to_the_last_bit() -> None:
    plain = linear_motion(HULL, None, V, arm_per_m=ARM)
    same = linear_motion(HULL, ShipEffects(EffectModel(), np.zeros(0)), V, arm_per_m=ARM)
    for name in ("A", "B", "C", "D", "offsets"):
        assert np.array_equal(getattr(plain, name), getattr(same, name)), name


def test_terms_change_the_matrices_as_they_are_written() -> None:
    plain = linear_motion(HULL, None, V)
    both = linear_motion(HULL, own("yaw: c*r; rudder: k*delta", -0.01, 0.2), V)
    change = both.A - plain.A
    assert change[1, 1] == pytest.approx(-0.01) and np.count_nonzero(np.abs(change) > 1e-15) == 1
    assert pytest.approx(1.2 * plain.B) == both.B
    hull = equivalent_hull(HULL, own("yaw: c*r; rudder: k*delta", -0.01, 0.2), V)
    assert hull.a22 == pytest.approx(HULL.a22 - 0.01 / V) and hull.b2 == pytest.approx(1.2 * HULL.b2)


def test_memory_is_a_state_that_has_settled_in_slow_motion() -> None:
    flow = having(memory=0.3)
    model = continuous(HULL, STILL, V, effects=flow)
    assert list(model.states.items())[3:] == [("memory_m1", "m/s")]
    rate = V / LENGTH
    assert model.A[0, 3] == pytest.approx(0.3 * rate) and model.A[0, 0] == pytest.approx(HULL.a11 * V - 0.3 * rate)
    assert model.A[3] == pytest.approx([rate / 3.0, 0.0, 0.0, -rate / 3.0])
    result = linear_hull(HULL, flow, np.eye(7), V)
    assert result.settled and result.hull.array() == pytest.approx(HULL.array())


def test_what_is_measured_has_its_effects() -> None:
    late = continuous(HULL, STILL, V, effects=having(gnss_latency=0.7, gyro_scale=0.1))
    # the acceleration across her V r to second order, that of the drift to first: the rudder's rate is no input
    by_drift, by_turn, by_rudder = HULL.a21 * V, HULL.a22 * V, HULL.b2 * V**2
    second = 0.5 * 0.7**2 * V
    assert late.D[0, 0] == pytest.approx(-0.7 * HULL.b1 * V**2 + second * by_rudder)
    assert late.C[1, 1] == pytest.approx(1.1)
    turned = -0.7 * (HULL.a12 * V + V) + second * by_turn
    assert late.C[0, :2] == pytest.approx([1.0 - 0.7 * HULL.a11 * V + second * by_drift, turned])
    sea = continuous(HULL, STILL, V, effects=having(waves=(0.01, 1.0, 6.0)))
    assert list(sea.states)[3:] == ["waves_m1", "waves_m2"] and sea.Q[4, 4] > 0.0 and not sea.Q[3, 3]
    assert sea.steered == [0, 1, 2]


def test_a_shifted_course_is_found_first() -> None:
    motion = linear_motion(HULL, having(neutral_angle=0.02, rudder_stall=1.5), V)
    # delta - stall delta^3 + c of a reading: the effects add up at the angle that is read
    assert motion.rudder_rad - 1.5 * motion.rudder_rad**3 == pytest.approx(-0.02, rel=1e-9)
    assert motion.B[1] == pytest.approx(HULL.b2 * V**2 * (1.0 - 4.5 * motion.rudder_rad**2), rel=1e-9)


def test_a_lag_and_a_dead_time_are_states_of_the_rudder() -> None:
    late = having(rudder_lag=4.0, dead_time=1.5)
    model = continuous(HULL, STILL, V, effects=late)
    assert list(model.states.items())[3:] == [("rudder_lag", "rad"), ("dead_time_1", "rad"), ("dead_time_2", "rad")]
    bare = continuous(HULL, STILL, V)
    for frequency in (0.01, 0.1, 0.5):
        s = 1j * frequency
        there, here = ((m.C[1] @ np.linalg.solve(s * np.eye(len(m.states)) - m.A, m.B))[0] for m in (model, bare))
        assert there / here == pytest.approx(np.exp(-1.5 * s) / (1.0 + 4.0 * s), abs=2e-3)
    # a held step through the exact discrete system, and the effect's own answer to a step
    sampled, x, u = discretised(continuous(HULL, STILL, V, effects=having(rudder_lag=4.0)), 0.5), np.zeros(4), 0.1
    for _ in range(10):
        x = sampled.A @ x + sampled.B[:, 0] * u
    assert x[3] == pytest.approx(0.1 * (1.0 - np.exp(-5.0 / 4.0)), rel=1e-12)


def test_a_state_that_forgets_at_once_leaves_the_noise_as_it_is() -> None:
    fast, bare = (continuous(HULL, ModelSpec(), V, effects=e) for e in (having(rudder_lag=1e-3), None))
    assert discretised(fast, 10.0).Q[:6, :6] == pytest.approx(discretised(bare, 10.0).Q, rel=1e-9, abs=1e-24)


def test_each_effect_of_the_catalogue_is_accounted_for() -> None:
    every = {name: tuple(p.steps[0] for p in one.parameters) for name, one in catalogue.catalogue().items()}
    how = {name: carried(HULL, having(**{name: v}), V)[0] for name, v in every.items()}
    gone = "no part of a straight course"
    assert {how[n].how for n in ("yaw_cubic", "cross_flow_drag", "sway_quadratic", "speed_exponent", "wind_force")} == {
        gone
    }
    assert {n for n, one in how.items() if one.how == "left out"} == {"backlash", "rate_limit"}
    assert how["backlash"].sentence == "backlash of 0.57 deg is no part of the linear model"
    assert "Padé" in how["dead_time"].sentence and how["rudder_lag"].sentence == ""
    assert "corner" in how["rudder_asymmetry"].sentence and "calm air" in how["wind_force"].sentence
    assert "rudder at -0.57 deg" in how["neutral_angle"].sentence
    assert how["memory"].how == how["load_condition"].how == how["gyro_scale"].how == "carried"
    said = sentences(carried(HULL, having(yaw_cubic=1.0, yaw_quadratic=1.0), V))
    assert said == ("yaw_cubic, yaw_quadratic are no part of a linear model about a straight course",)
    assert carried(HULL, None, V) == ()


def test_the_page_says_what_comes_of_each_effect() -> None:
    rows = re.findall(
        r"^\| (carried|shifts the course|left out)[^|]*\| (`[^|]+) \|$", PAGE.read_text(), flags=re.MULTILINE
    )
    documented = {name: how for how, names in rows for name in re.findall(r"`(\w+)`", names)}
    assert len(rows) == 3
    for name, one in catalogue.catalogue().items():
        found = carried(HULL, having(**{name: tuple(p.steps[0] for p in one.parameters)}), V)[0]
        assert documented.get(name, "no part of a straight course") == found.how, name


def test_errors_are_those_of_draws() -> None:
    effect = own("rudder: c*delta; yaw: k*r", 0.2, -0.01)
    covariance = np.diag([*np.diag(covariance_of(HULL)), 0.02**2, 0.002**2]) * 0.01
    result = linear_hull(HULL, effect, covariance, V)
    draws = np.random.default_rng(0).multivariate_normal([*HULL.array(), 0.2, -0.01], covariance, 4000)
    drawn = [(p[3] + p[7] / V, p[5] * (1.0 + p[6])) for p in draws]
    assert np.sqrt(np.diag(result.covariance))[[3, 5]] == pytest.approx(np.std(drawn, axis=0), rel=0.05)
    # what does not act on the hull takes part in nothing, known or not
    blind = np.full((7, 7), np.nan)
    blind[:6, :6] = covariance_of(HULL)
    lag = linear_hull(HULL, having(rudder_lag=4.0), blind, V)
    assert lag.hull.array() == pytest.approx(HULL.array(), rel=1e-12)
    assert lag.covariance == pytest.approx(covariance_of(HULL), rel=1e-6)


@pytest.mark.parametrize("method", ["lqr", "poles"])
def test_a_law_that_knows_of_the_lag_steers_the_late_ship_better(method: str) -> None:
    late = having(rudder_lag=8.0)
    settings = LawSettings(method=method, rudder_rate_rad_s=np.radians(5.0))  # type: ignore[arg-type]
    knows, ignores = (course_law(HULL, V, arm_per_m=ARM, settings=settings, effects=e) for e in (late, None))
    assert list(knows.plant.states) == ["v", "r", "psi", "F", "V_T", "rudder_lag"]
    better, worse = (closed_loop(law, HULL, V, late) for law in (knows, ignores))
    assert better.stable and better.modulus_margin > 1.2 * worse.modulus_margin
    turns = []
    for law in (knows, ignores):
        ship = SteeredShip(HULLS["mariner"], CALM, 1205.0, seed=2, gear=SteeringGear([Lag(8.0)]))
        turns.append(course_change(keep_course(ship, law, 1200.0, 0.0, ((300.0, np.radians(10.0)),))))
    assert turns[0].overshoot_rad < 0.7 * turns[1].overshoot_rad
    covariance = np.zeros((7, 7))
    covariance[:6, :6], covariance[6, 6] = covariance_of(HULL), 4.0**2
    assert share_held(knows, HULL, covariance, V, effects=late, draws=60) == 1.0
    # so short a lag that its errors reach beyond nothing, and none
    for tau in (1e-3, 0.0):
        short = having(rudder_lag=tau)
        law = course_law(HULL, V, arm_per_m=ARM, settings=settings, effects=short)
        assert closed_loop(law, HULL, V, short).stable
        assert share_held(law, HULL, covariance, V, effects=short, draws=60) > 0.9


PARTS = {
    "rudder_lag": (Lag, 3.7),
    "dead_time": (DeadTime, 1.63),
    "backlash": (Play, 0.04),
    "rate_limit": (RateLimit, 40.0),
}


@pytest.mark.parametrize("name", PARTS)
def test_the_simulated_gear_does_what_the_effect_says(name: str) -> None:
    # two codes of one equation; the rudder is linear between the points of the grid
    cell, time = 0.02, 0.02 * np.arange(6001)
    order = 0.3 * np.sign(np.sin(0.2 * time)) * (time > 3.0)
    rudder = np.zeros(time.size)
    for k in range(1, time.size):
        rudder[k] = rudder[k - 1] + np.clip(order[k] - rudder[k - 1], -0.087 * cell, 0.087 * cell)
    made, size = PARTS[name]
    gear = SteeringGear([made(size)], zero_rad=0.01)
    pieces = [gear.felt(rudder[i : i + 51], cell) for i in range(0, 6000, 50)]
    wanted = RUDDER_COURSES[name](time, rudder, np.array([size]))[1:] + 0.01  # type: ignore[index]
    assert np.concatenate(pieces) == pytest.approx(wanted, abs=6e-4 if name == "rate_limit" else 2e-5)
    assert np.max(np.abs(wanted - 0.01 - rudder[1:])) > 0.01


def test_a_ship_with_an_idle_gear_sails_as_one_without() -> None:
    law = course_law(HULL, V, arm_per_m=ARM)
    tracks = [
        keep_course(SteeredShip(HULLS["mariner"], CALM, 305.0, seed=3, gear=gear), law, 300.0, 0.1)
        for gear in (None, SteeringGear())
    ]
    assert tracks[0].truth == pytest.approx(tracks[1].truth, abs=1e-3)
    assert linear_motion(HULL, None, V).A.shape == (N_CHAIN, N_CHAIN)
