"""The law against closed forms, and on the independent simulator, with right parameters and with wrong ones."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from kempf.flows.jobs.steering.steered_ship import ShipInstruments, SteeredShip
from kempf.pipeline.estimate.filters.kalman_filter import run_filter
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.disturbances import CALM, Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT
from kempf.pipeline.steering.course_keeping import LawSettings, course_law
from kempf.pipeline.steering.robustness import closed_loop, share_held
from kempf.pipeline.steering.state_space import continuous, discretised
from kempf.pipeline.steering.track import course_change, keep_course, performance
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.model_spec import ModelSpec
from tests.steering.ships import covariance_of, hull_of

STEADY = Environment(Disturbance(5e-3), Disturbance(0.15), Disturbance(0.26))
QUIET = ShipInstruments(0.0, 0.0, 0.0, 0.0)


def law_of(name: str, factor: float = 1.0, **changes):
    ship = HULLS[name]
    hull = Hull(*(hull_of(name).array() * [1, 1, 1, 1, factor, factor]))
    settings = LawSettings(rudder_rate_rad_s=ship.rudder_rate_rad_s, **changes)
    return course_law(hull, ship.trial_speed_m_s, arm_per_m=ship.wind_arm_per_m, settings=settings)


@lru_cache(maxsize=16)
def sailed(name: str, factor: float = 1.0, method: str = "lqr", environment=PAPER_ENVIRONMENT, quiet: bool = False):
    law = law_of(name, factor, method=method)
    ship = SteeredShip(HULLS[name], environment, 1605.0, seed=4, instruments=QUIET if quiet else None)
    return keep_course(ship, law, 1600.0, 0.0, ((1000.0, np.radians(10.0)),))


@pytest.mark.parametrize("method", ["lqr", "poles"])
@pytest.mark.parametrize("name", HULLS)
def test_poles_of_the_loop_are_those_of_regulator_and_estimator(name, method):
    law = law_of(name, method=method)
    A, B, H = law.plant.A, law.plant.B, law.plant.measured
    regulator = np.linalg.eigvals(A[:3, :3] - B[:3] @ law.gain[None, :])
    estimator = np.linalg.eigvals(A - A @ law.observer @ H)
    loop = closed_loop(law, hull_of(name), HULLS[name].trial_speed_m_s)
    assert loop.stable and loop.modulus_margin > 0.4
    assert np.sort_complex(loop.poles) == pytest.approx(
        np.sort_complex(np.concatenate([regulator, estimator])), abs=2e-6
    )


def test_poles_go_where_they_were_asked_to():
    ship = HULLS["ferry"]
    law = law_of("ferry", method="poles", bandwidth=0.8, damping=0.9)
    A, B = law.plant.A[:3, :3], law.plant.B[:3]
    rates = np.log(np.linalg.eigvals(A - B @ law.gain[None, :]).astype(complex)) / law.step_s
    w = 0.8 * ship.trial_speed_m_s * np.sqrt(ship.parameters.b2)
    pair = rates[np.argsort(np.abs(rates))][:2]
    assert np.abs(pair) == pytest.approx(w, rel=1e-8) and -pair.real == pytest.approx(0.9 * w, rel=1e-8)


def test_estimator_is_the_filter_of_the_model_when_it_has_settled():
    law = law_of("mariner")
    plant, n = law.plant, 4000
    random = np.random.default_rng(2)
    root = np.linalg.cholesky(plant.Q + 1e-24 * np.eye(5))
    x, Y, u = np.zeros(5), np.empty((n, 3)), np.zeros((n, 1))
    for k in range(n):
        Y[k] = plant.measured @ x + np.sqrt(np.diag(plant.R)) * random.standard_normal(3)
        u[k] = 0.05 * np.sin(k / 50)
        x = plant.A @ x + plant.B[:, 0] * u[k] + root @ random.standard_normal(5)
    G = root
    whole = run_filter(plant.A, plant.B, G, plant.measured, plant.R, Y, u, np.zeros(5), np.eye(5) * 1e-4)
    mine = np.zeros(5)
    for k in range(n):
        mine = law.correct(mine if k == 0 else law.predict(mine, float(u[k - 1, 0])), Y[k])
    assert mine == pytest.approx(whole.updated[-1], rel=1e-5, abs=1e-9)


def test_it_is_the_regulator_of_the_augmented_plant_with_slow_disturbances():
    # the Riccati equation over (v, r, psi, F) with what the rudder should be in that wind as its zero
    law, ship = law_of("mariner"), HULLS["mariner"]
    slow = ModelSpec(current="none", wind_correlation_rate_per_s=1e-7)
    arm = ship.wind_arm_per_m
    plant = discretised(continuous(hull_of("mariner"), slow, ship.trial_speed_m_s, arm_per_m=arm), law.step_s)
    A, B = plant.A, plant.B
    Q = np.diag([0.0, 0.0, 1.0, 0.0])
    Q[3, 3] = law.rudder_per_force**2
    S = np.array([[0.0], [0.0], [0.0], [-law.rudder_per_force]])
    P = solve_discrete_are(A, B, Q, np.eye(1), s=S)
    gain = np.linalg.solve(np.eye(1) + B.T @ P @ B, B.T @ P @ A + S.T)[0]
    assert law.feedback[:4] == pytest.approx(gain, rel=2e-3)


@pytest.mark.parametrize("factor", [1.0, 0.4, 2.0])
@pytest.mark.parametrize("name", ["mariner", "ferry", "usv"])
def test_a_steady_wind_leaves_no_heading_error_even_with_wrong_parameters(name, factor):
    track = sailed(name, factor, environment=STEADY, quiet=True)
    late = performance(track, 800.0, 1000.0)
    assert late.heading_rms_rad < np.radians(0.05)
    # the rudder that the simulator's own equilibrium needs: r = 0 under F
    p, V = HULLS[name].parameters, HULLS[name].trial_speed_m_s
    matrix = [[p.a11 * V, p.b1 * V**2], [p.a21 * V, p.b2 * V**2]]
    _, rudder = np.linalg.solve(matrix, [-5e-3, -5e-3 * HULLS[name].wind_arm_per_m])
    assert late.rudder_mean_rad == pytest.approx(rudder, rel=0.02)


@pytest.mark.parametrize("method", ["lqr", "poles"])
@pytest.mark.parametrize("name", ["mariner", "tanker", "ferry"])
def test_right_parameters_keep_the_course_in_wind_and_stream(name, method):
    track = sailed(name, method=method)
    kept = performance(track, 300.0, 1000.0)
    assert kept.kept and kept.heading_rms_rad < np.radians(0.15)
    change = course_change(track)
    assert change is not None and change.overshoot_rad < np.radians(1.0) and change.settled_s < 200.0


@pytest.mark.parametrize("name", ["mariner", "ferry"])
def test_wrong_parameters_cost(name):
    right, wrong = sailed(name), sailed(name, 3.0)
    assert performance(wrong, 300.0, 1000.0).heading_rms_rad > 1.5 * performance(right, 300.0, 1000.0).heading_rms_rad
    assert course_change(wrong).overshoot_rad > np.radians(3.0) > course_change(right).overshoot_rad
    hull, V = hull_of(name), HULLS[name].trial_speed_m_s
    assert (
        closed_loop(law_of(name, 3.0), hull, V).modulus_margin < 0.3 < closed_loop(law_of(name), hull, V).modulus_margin
    )


def test_wind_is_seen():
    track = sailed("mariner")
    late = track.time_s > 300.0
    error = track.estimate[late, 3] - track.truth[late, 7]
    assert np.sqrt(np.mean(error**2)) < 0.2 * np.mean(track.truth[late, 7])


def test_unstable_poles_are_seen_on_the_simulator_too():
    # a law for a ship whose rudder is taken for far more effective than it is, placed fast, lets her go
    law, hull, V = law_of("mariner", 5.0, method="poles", bandwidth=1.2), hull_of("mariner"), 7.7175
    loop = closed_loop(law, hull, V)
    assert not loop.stable and loop.slowest_s == np.inf and loop.modulus_margin == 0.0
    calm = SteeredShip(HULLS["mariner"], CALM, 3005.0, seed=1)
    track = keep_course(calm, law, 3000.0, 0.0)
    early, late = performance(track, 300.0, 900.0), performance(track, 2400.0)
    assert late.heading_rms_rad > 1.5 * early.heading_rms_rad


def test_margin_is_the_gain_at_which_she_is_lost():
    # 1 / (1 - m) bounds the gain: raise the true rudder's effect until the loop is unstable
    law, hull, V = law_of("mariner"), hull_of("mariner"), 7.7175
    margin = closed_loop(law, hull, V).modulus_margin
    for factor in (1 / (1 + 0.98 * margin), 1 / (1 - 0.98 * margin)):
        moved = replace(hull, b1=hull.b1 * factor, b2=hull.b2 * factor)
        assert closed_loop(law, moved, V).stable


def test_share_of_ships_held():
    hull, law, V = hull_of("mariner"), law_of("mariner"), 7.7175
    assert share_held(law, hull, covariance_of(hull), V) == 1.0
    lost = share_held(law, hull, covariance_of(hull, np.full(6, 1.0)), V, draws=100)
    assert 0.0 < lost < 1.0 and lost == share_held(law, hull, covariance_of(hull, np.full(6, 1.0)), V, draws=100)
    assert np.isnan(share_held(law, hull, np.full((6, 6), np.nan), V))


def test_equal_seeds_give_equal_bits():
    sailed.cache_clear()
    first = sailed("ferry")
    sailed.cache_clear()
    again = sailed("ferry")
    assert all(np.array_equal(getattr(first, n), getattr(again, n)) for n in ("truth", "estimate"))


def test_the_rudder_keeps_its_limit_and_rate():
    law = law_of("tanker", rudder_limit_rad=np.radians(10.0))
    ship = replace(HULLS["tanker"], rudder_limit_rad=np.radians(10.0))
    track = keep_course(SteeredShip(ship, CALM, 905.0, seed=1), law, 900.0, np.radians(60.0))
    rudder, rate = track.truth[:, 6], np.diff(track.truth[:, 6]) / law.step_s
    assert np.max(np.abs(rudder)) == pytest.approx(np.radians(10.0))
    assert np.max(np.abs(rate)) <= HULLS["tanker"].rudder_rate_rad_s * (1 + 1e-9)
    assert abs(track.heading_error_rad[-1]) < np.radians(0.5)  # and the estimator did not wind up


def test_a_measurement_that_is_missing_is_bridged():
    law = law_of("ferry")
    x = np.array([0.1, 0.01, 0.02, 1e-3, 0.1])
    assert np.array_equal(law.correct(x, np.full(3, np.nan)), x)


@pytest.mark.parametrize("p", [(-0.005, -0.3, -1e-4, -0.013, 0.0, 0.0), (-0.005, -0.3, 0.0, -0.013, -0.001, 0.0)])
def test_a_rudder_that_does_nothing_allows_no_law(p):
    with pytest.raises(DataRejected) as caught:
        course_law(Hull(*p), 7.0)
    assert caught.value.code == "no_course_keeping_law"


def test_impossible_settings_are_refused():
    hull = hull_of("ferry")
    for change in ({"rudder_weight": 0.0}, {"damping": -1.0}, {"step_s": np.nan}, {"rudder_limit_rad": 0.0}):
        with pytest.raises(UsageError):
            course_law(hull, 9.0, settings=LawSettings(**change))
    law = course_law(hull, 9.0)
    with pytest.raises(UsageError):
        keep_course(SteeredShip(HULLS["ferry"], CALM, 100.0), law, 5.0, 0.0)
    track = keep_course(SteeredShip(HULLS["ferry"], CALM, 100.0), law, 60.0, 0.0)
    with pytest.raises(UsageError):
        performance(track, 58.0)
    with pytest.raises(UsageError):
        SteeredShip(HULLS["ferry"], CALM, 10.0).hold(0.0, 20.0)
