"""The rivals: right where their assumptions hold, wrong and saying so where wind and stream act."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from benchmarks.baselines import multiple_models, smoothed_regression
from benchmarks.baselines.estimators import NAMES, default_settings, estimate
from benchmarks.baselines.start import ranked_starts
from benchmarks.baselines.step import exact_step, innovations
from kempf.pipeline.estimate.classical import subspace
from kempf.pipeline.estimate.classical.resample import even, step_of, without_means
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.model.ship import Hull, discrete_from_continuous, mariner_like
from kempf.pipeline.simulate.disturbances import CALM
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, Trial
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed, truth_of

RIVALS = ("output-error", "prediction-error", "subspace", "multiple-models", "ekf-ols")
STILL = ModelSpec(wind="none", current="none")


@lru_cache(maxsize=32)
def found_by(name: str, trial: Trial, *, spec: ModelSpec = STILL) -> Estimate:
    return estimate(name, record_of(trial), spec, trial.truth.wind_arm_per_m, default_settings(name))


def percent(found: Estimate, trial: Trial) -> float:
    return float(100.0 * np.sqrt(np.mean((found.hull.array() / truth_of(trial) - 1.0) ** 2)))


def calm(hull: str = "mariner", seed: int = 1, duration_s: float = 900.0) -> Trial:
    return sailed(hull, seed=seed, environment=CALM, duration_s=duration_s)


def rough(hull: str = "mariner", seed: int = 1) -> Trial:
    return sailed(hull, seed=seed, environment=PAPER_ENVIRONMENT, duration_s=900.0)


def test_every_rival_has_a_name() -> None:
    assert set(RIVALS) < set(NAMES)
    for name in NAMES:
        json.dumps(default_settings(name), allow_nan=False)


@pytest.mark.parametrize("name", RIVALS)
def test_in_calm_water_a_rival_finds_the_ship(name: str) -> None:
    trial = calm()
    found = found_by(name, trial)
    assert found.estimator == name
    assert found.converged and found.report["converged"] is True
    # reached: 2 to 6 %
    assert percent(found, trial) < 12.0
    assert not any("does not model" in warning for warning in found.warnings)
    json.dumps([found.report, list(found.iterations), found.fit], allow_nan=False)


@pytest.mark.parametrize("name", ["output-error", "prediction-error", "multiple-models"])
def test_in_calm_water_the_standard_errors_are_honest(name: str) -> None:
    z = [
        (found_by(name, trial).hull.array() - truth_of(trial)) / [p.std for p in found_by(name, trial).parameters]
        for trial in ((calm(),) if name == "multiple-models" else (calm(), calm("ferry", 2)))
    ]
    assert np.max(np.abs(z)) < 3.5
    assert 0.2 < np.sqrt(np.mean(np.square(z))) < 2.0


@pytest.mark.parametrize("name", RIVALS)
def test_in_wind_and_stream_it_is_far_off_and_warns(name: str) -> None:
    trial = rough()
    # output error creeps where its model is so wrong; that it is far off shows long before it settles
    hurried = {"max_iterations": 20, "gate_rounds": 0} if name == "output-error" else {}
    found = estimate(name, record_of(trial), ModelSpec(), 0.0, {**default_settings(name), **hurried})
    assert percent(found, trial) > 2.0 * percent(found_by(name, calm()), calm())
    assert percent(found, trial) > 8.0
    assert any("does not model" in warning for warning in found.warnings)


def test_subspace_says_that_it_has_no_standard_errors() -> None:
    found = found_by("subspace", calm())
    assert all(np.isnan(p.std) for p in found.parameters)
    assert any("no standard errors" in warning for warning in found.warnings)


def test_regression_on_smoothed_states_says_that_its_errors_are_too_small() -> None:
    trial = calm()
    found = found_by("ekf-ols", trial)
    assert any("too small" in warning for warning in found.warnings)
    stopped = smoothed_regression.identify(
        record_of(trial), STILL, 0.0, smoothed_regression.SmoothedRegressionSettings(iterations=1)
    )
    assert not stopped.converged
    assert any("not converged" in warning for warning in stopped.warnings)


def test_a_bank_that_may_not_move_says_so() -> None:
    settings = multiple_models.MultipleModelsSettings(rounds=1)
    found = multiple_models.identify(record_of(calm()), STILL, 0.0, settings)
    assert not found.converged
    assert "still moved" in found.report["reason"]


@pytest.mark.parametrize("name", ["prediction-error", "subspace", "ekf-ols"])
def test_two_runs_give_the_same_bits(name: str) -> None:
    trial = calm(duration_s=300.0)
    one, other = (
        estimate(name, record_of(trial), STILL, trial.truth.wind_arm_per_m, default_settings(name)) for _ in range(2)
    )
    assert [p.value for p in one.parameters] == [p.value for p in other.parameters]
    np.testing.assert_array_equal(one.covariance, other.covariance)
    assert one.report == other.report


@pytest.mark.parametrize("name", ["subspace", "prediction-error", "ekf-ols"])
def test_the_heading_stands_in_for_the_yaw_rate(name: str) -> None:
    trial = calm("ferry", 2, 300.0)
    found = estimate(name, record_of(trial, "yaw_rate"), STILL, 0.0, default_settings(name))
    assert np.all(np.isfinite(found.hull.array()))
    assert found.hull.b2 > 0.0


def test_without_noise_and_speed_loss_the_exact_methods_are_exact() -> None:
    """Against the simulator, which shares no code with the estimators; the rudder between its samples is left."""
    trial = sailed("ferry", noise_scale=0.0, environment=CALM, speed_loss=0.0, duration_s=600.0)
    for name, limit in (("prediction-error", 2.0), ("subspace", 4.0)):
        assert percent(found_by(name, trial), trial) < limit


@pytest.mark.parametrize(("length", "speed", "span"), [(150.0, 8.0, 1.0), (3.0, 2.0, 1.0), (20.0, 5.0, 4.0)])
def test_the_step_is_exact(length: float, speed: float, span: float) -> None:
    hull = mariner_like(length)
    A, g = np.empty((2, 2)), np.empty(2)
    assert exact_step(hull.array(), speed, span, 0.1, -0.3, A, g)
    expected, held = discrete_from_continuous(hull, speed, span)
    np.testing.assert_allclose(A, expected, rtol=1e-12, atol=1e-15)
    F, b = hull.continuous(speed)
    ramp = solve_ivp(
        lambda t, x: F @ x + b[:, 0] * (0.1 - 0.4 * t / span), (0.0, span), [0.0, 0.0], rtol=1e-11, atol=1e-14
    )
    np.testing.assert_allclose(g, ramp.y[:, -1], rtol=1e-8)
    assert exact_step(hull.array(), speed, span, 0.2, 0.2, A, g)
    np.testing.assert_allclose(g, 0.2 * held[:, 0], rtol=1e-12)


def test_a_hull_that_answers_absurdly_fast_is_refused() -> None:
    assert not exact_step(mariner_like(0.05).array(), 10.0, 1.0, 0.0, 0.0, np.empty((2, 2)), np.empty(2))
    assert not exact_step(np.full(6, np.nan), 10.0, 1.0, 0.0, 0.0, np.empty((2, 2)), np.empty(2))


def test_innovations_of_the_true_predictor_are_the_noise_that_made_the_record() -> None:
    random, n, step, speed = np.random.default_rng(5), 300, 1.0, 8.0
    hull = mariner_like(140.0)
    A, B = discrete_from_continuous(hull, speed, step)
    K = np.array([[0.2, 1.0], [0.0005, 0.3]])
    u = np.full(n, 0.2)
    e = random.standard_normal((n, 2)) * [0.05, 5e-4]
    x, y = np.array([0.3, -0.002]), np.empty((n, 2))
    for k in range(n):
        y[k] = x + e[k]
        x = A @ x + B[:, 0] * u[k] + K @ e[k]
    out = np.empty((n, 2))
    assert innovations(hull.array(), K, np.array([0.3, -0.002]), step, np.full(n, speed), u, y, out)
    np.testing.assert_allclose(out, e, atol=1e-12)


def _driven(n: int, hull: Hull, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    A, B = discrete_from_continuous(hull, 8.0, 1.0)
    u = np.random.default_rng(seed).uniform(-0.3, 0.3, (n, 1))
    x = np.zeros((n, 2))
    for k in range(n - 1):
        x[k + 1] = A @ x[k] + B @ u[k]
    return A, B, u, x


def test_n4sid_realises_a_noiseless_system_exactly() -> None:
    A, B, u, x = _driven(400, mariner_like(150.0), 6)
    found = subspace.realise(x / x.std(axis=0), u, 10)
    scale = x.std(axis=0)
    np.testing.assert_allclose(found.A * np.outer(scale, 1.0 / scale), A, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(found.B * scale[:, None], B, rtol=1e-7)
    assert found.singular[1] > 1e6 * found.singular[2]


def test_n4sid_names_what_it_cannot_do() -> None:
    found = subspace.realise(np.zeros((200, 2)), np.random.default_rng(1).standard_normal((200, 1)), 10)
    assert "fewer than two states" in found.reason
    with pytest.raises(DataRejected, match="horizon"):
        subspace.identify(record_of(calm()), STILL, 0.0, subspace.SubspaceSettings(horizon=400))


def test_the_bank_weighs_by_the_joint_gaussian() -> None:
    """A filter's log-likelihood is that of all measurements at once, written out as one Gaussian vector."""
    random, n, speed = np.random.default_rng(3), 7, 8.0
    hull, process, noise = mariner_like(120.0), np.array([1e-4, 1e-8]), np.array([2.5e-3, 2.5e-7])
    y, u = random.standard_normal((n, 2)) * [0.3, 5e-3], np.full(n, 0.15)
    value = np.empty(1)
    multiple_models.bank_log_likelihood(hull.array()[None], process, noise, 1.0, np.full(n, speed), u, y, value)
    F, b = hull.continuous(speed)
    A, B = discrete_from_continuous(hull, speed, 1.0)
    Q = 0.5 * (A @ np.diag(process) @ A.T + np.diag(process))
    mean, own = np.zeros((n, 2)), [np.diag([4.0, 0.04])]
    for k in range(1, n):
        mean[k] = A @ mean[k - 1] + B[:, 0] * u[k]
        own.append(A @ own[-1] @ A.T + Q)
    joint = np.zeros((2 * n, 2 * n))
    for i in range(n):
        for j in range(i, n):
            block = expm(F * (j - i)) @ own[i]
            joint[2 * j : 2 * j + 2, 2 * i : 2 * i + 2] = block
            joint[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = block.T
    joint += np.diag(np.tile(noise, n))
    off = (y - mean).ravel()
    expected = -0.5 * (off @ np.linalg.solve(joint, off) + np.linalg.slogdet(2.0 * np.pi * joint)[1])
    np.testing.assert_allclose(value[0], expected, rtol=1e-9)
    assert b.shape == (2, 1)


def test_the_smoother_gives_the_conditional_mean() -> None:
    """Smoothed states against regression on the joint Gaussian, at the first instant, which only the smoother moves."""
    record = even(record_of(calm()), None)
    short = replace(
        record,
        **{
            name: getattr(record, name)[:40]
            for name in ("time_s", "speed_m_s", "rudder_rad", "measured", "heading_rad")
        },
    )
    hull, settings = truth_of(calm()), smoothed_regression.SmoothedRegressionSettings()
    states = smoothed_regression.smooth(short, hull, np.zeros(2), settings)
    assert states is not None
    step, y = step_of(short), short.measured[:, :2]
    noise = np.maximum(short.noise_start[:2], 1e-3 * np.std(y, axis=0)) ** 2
    q = (settings.process_share * multiple_models.accelerations(y, step)) ** 2 * step
    n, first = 40, np.diag([4.0, 0.04])
    # every state as a linear map of (x_0, w_1, w_2, ..), two noises a step
    maps, mean = [np.zeros((2, 2 + 4 * (n - 1)))], [np.zeros(2)]
    maps[0][:, :2] = np.eye(2)
    A, g = np.empty((2, 2)), np.empty(2)
    for k in range(1, n):
        V = 0.5 * (short.speed_m_s[k - 1] + short.speed_m_s[k])
        exact_step(hull, V, step, short.rudder_rad[k - 1], short.rudder_rad[k], A, g)
        one = maps[-1].copy()
        one[:, 4 * k - 2 : 4 * k] = np.eye(2)
        one = A @ one
        one[:, 4 * k : 4 * k + 2] = np.eye(2)
        maps.append(one)
        mean.append(A @ mean[-1] + g)
    source = np.concatenate([np.diag(first), np.tile(0.5 * step * q, 2 * (n - 1))])
    M = np.vstack(maps)
    joint = M @ np.diag(source) @ M.T
    measured = joint + np.diag(np.tile(noise, n))
    expected = np.array(mean).ravel() + joint @ np.linalg.solve(measured, (y - np.array(mean)).ravel())
    np.testing.assert_allclose(states.ravel(), expected, rtol=1e-6, atol=1e-9)


def test_an_even_record_keeps_its_gaps_and_invents_nothing() -> None:
    record = record_of(calm())
    measured = record.measured.copy()
    hole = (record.time_s > 300.0) & (record.time_s < 330.0)
    measured[hole] = np.nan
    used = even(replace(record, measured=measured), None)
    inside = (used.time_s > 302.0) & (used.time_s < 328.0)
    assert np.all(np.isnan(used.measured[inside][:, :2]))
    assert np.all(np.isfinite(used.measured[~inside & (used.time_s < 290.0)][:, :2]))
    np.testing.assert_allclose(np.diff(used.time_s), step_of(used), rtol=1e-9)
    for name in ("prediction-error", "subspace", "ekf-ols"):
        found = estimate(name, replace(record, measured=measured), STILL, 0.0, default_settings(name))
        assert percent(found, calm()) < 20.0


def test_too_few_whole_instants_are_refused() -> None:
    record = record_of(calm())
    measured = record.measured.copy()
    measured[record.time_s > 30.0, 1] = np.nan
    with pytest.raises(DataRejected, match="are needed"):
        even(replace(record, measured=measured), None)


def test_means_removed_are_zero_and_starts_are_ranked() -> None:
    used = without_means(even(record_of(calm()), None))
    assert np.nanmax(np.abs(np.nanmean(used.measured[:, :2], axis=0))) < 1e-12
    length, hull = ranked_starts(used)[0]
    # the Mariner is 161 m long
    assert 100.0 < length < 270.0
    np.testing.assert_array_equal(hull, mariner_like(length).array())
