"""The speed through the water without a log: its pieces against closed forms, the whole against simulated trials."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm

from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.filters.smoother import LinearSystem, last_state, smooth
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.no_log.companions import Passage, check_engine, companions_of, has_log
from kempf.pipeline.estimate.no_log.identify import SPEED_POWER, NoLogSettings, identify_without_log
from kempf.pipeline.estimate.no_log.lateral_steps import SlowForces, lateral_steps
from kempf.pipeline.estimate.no_log.longitudinal import PATH, SPEED, Surge, discretise_surge
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.estimate.search.starts import thinned
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest
from kempf.pipeline.simulate.plant import STATE
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS
from tests.estimate.simulated import instruments_of, truth_of, without

SETTINGS = MaximumLikelihoodSettings()
SPEC = ModelSpec()


def van_loan(A: np.ndarray, G: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    n = A.shape[0]
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A, G @ G.T, A.T
    exponential = expm(block * h)
    Phi = exponential[n:, n:].T
    return Phi, Phi @ exponential[:n, n:]


def test_smoother_is_the_joint_normal() -> None:
    random = np.random.default_rng(3)
    n, n_state, n_measurement = 6, 4, 2
    Phi = np.eye(n_state) + 0.2 * random.standard_normal((n, n_state, n_state))
    root = 0.3 * random.standard_normal((n, n_state, n_state))
    # one state is a constant, one is known exactly at first
    root[:, 3], Phi[:, 3] = 0.0, np.eye(n_state)[3]
    g, H = random.standard_normal((n, n_state)), random.standard_normal((n, n_measurement, n_state))
    R, x0 = random.uniform(0.1, 1.0, (n, n_measurement)), random.standard_normal(n_state)
    P0 = np.diag([1.0, 2.0, 0.0, 3.0])
    Q = root @ root.transpose(0, 2, 1)
    Y = random.standard_normal((n, n_measurement))
    Y[2, 0], Y[4] = np.nan, np.nan
    mean, covariance = np.zeros((n, n_state)), np.zeros((n, n, n_state, n_state))
    mean[0], covariance[0, 0] = x0, P0
    for k in range(1, n):
        mean[k] = Phi[k] @ mean[k - 1] + g[k]
        for j in range(k):
            covariance[k, j] = Phi[k] @ covariance[k - 1, j]
            covariance[j, k] = covariance[k, j].T
        covariance[k, k] = Phi[k] @ covariance[k - 1, k - 1] @ Phi[k].T + Q[k]
    rows = [(k, i) for k in range(n) for i in range(n_measurement) if np.isfinite(Y[k, i])]
    big = np.zeros((len(rows), n * n_state))
    for row, (k, i) in enumerate(rows):
        big[row, k * n_state : (k + 1) * n_state] = H[k, i]
    C = covariance.transpose(0, 2, 1, 3).reshape(n * n_state, -1)
    S = big @ C @ big.T + np.diag([R[k, i] for k, i in rows])
    error = np.array([Y[k, i] for k, i in rows]) - big @ mean.ravel()
    gain = np.linalg.solve(S, big @ C).T
    expected, spread = mean.ravel() + gain @ error, C - gain @ big @ C
    value = -0.5 * (error @ np.linalg.solve(S, error) + np.linalg.slogdet(2 * np.pi * S)[1])
    system = LinearSystem(Phi, g, Q, Y, H, R, x0, P0)
    found, last = smooth(system), last_state(system)
    assert found.log_likelihood == pytest.approx(value, rel=1e-12)
    assert last.log_likelihood == found.log_likelihood
    np.testing.assert_allclose(found.mean.ravel(), expected, atol=1e-12)
    for k in range(n):
        block = slice(k * n_state, (k + 1) * n_state)
        np.testing.assert_allclose(found.covariance[k], spread[block, block], atol=1e-12)
    np.testing.assert_allclose(last.mean, found.mean[-1])


@pytest.mark.parametrize("step_s", [0.01, 0.2, 5.0, 400.0])
def test_surge_steps_are_exact(step_s: float) -> None:
    T, wander, rate = 80.0, 0.02, 4e-4
    A = np.array([[-1 / T, 1 / T, -rate, 0], [0, 0, 0, 0], [0, 0, 0, 0], [1, 0, 0, 0]])
    Phi, Q = van_loan(A, np.array([[wander], [0], [0], [0]]), step_s)
    found_Phi, found_Q = discretise_surge(Surge(T, wander), np.array([step_s]), np.array([rate]))
    np.testing.assert_allclose(found_Phi[0], Phi, rtol=1e-9, atol=1e-14)
    scale = np.sqrt(np.diag(Q)) + 1e-30
    np.testing.assert_allclose(found_Q[0] / np.outer(scale, scale), Q / np.outer(scale, scale), atol=1e-6)
    assert found_Q[0, PATH, PATH] > 0 and found_Q[0, SPEED, SPEED] > 0


@pytest.mark.parametrize(("step_s", "length_m"), [(0.1, 100.0), (1.0, 100.0), (8.0, 30.0)])
def test_lateral_steps_are_exact(step_s: float, length_m: float) -> None:
    hull, V, rudder = mariner_like(length_m), 7.0, np.array([0.3, -0.1])
    forces = SlowForces(0.01, 2e-3, 1 / 300.0, 1e-4, 1 / 30.0)
    A = np.zeros((5, 5))
    A[:2, :2], B = hull.continuous(V)
    A[0, 3], A[1, 3], A[1, 4], A[2, 1] = 1.0, forces.arm_per_m, 1.0, 1.0
    A[3, 3], A[4, 4] = -forces.force_rate_per_s, -forces.moment_rate_per_s
    G = np.zeros((5, 2))
    G[3, 0] = forces.force_m_s2 * np.sqrt(2 * forces.force_rate_per_s)
    G[4, 1] = forces.moment_rad_s2 * np.sqrt(2 * forces.moment_rate_per_s)
    Phi, Q = van_loan(A, G, step_s)
    enters = np.concatenate([B[:, 0], np.zeros(3)])

    def integrand(s: float) -> np.ndarray:
        return np.asarray(expm(A * (step_s - s)) @ enters * (rudder[0] + (rudder[1] - rudder[0]) * s / step_s))

    g = quad_vec(integrand, 0.0, step_s, epsabs=1e-15)[0]
    found = lateral_steps(hull, forces, np.array([step_s]), np.array([V]), rudder[None, :])
    for one, expected in zip(found, (Phi, g, Q), strict=True):
        np.testing.assert_allclose(one[0], expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())


@lru_cache(maxsize=4)
def sailed(current_m_s: float, heading_deg: float = 40.0, seed: int = 3) -> tuple[Trial, tuple[Record, ...]]:
    """Two zigzags on opposite headings in a stream along the course, without the log, thinned for the tests' sake."""
    north, east = (current_m_s * f(np.deg2rad(heading_deg)) for f in (np.cos, np.sin))
    environment = Environment(
        wind_force=Disturbance(5e-3, 1e-3),
        current_north=Disturbance(float(north)),
        current_east=Disturbance(float(east)),
    )
    settings = zigzag_settings("mariner", seed=seed, environment=environment)
    zigzag = ZigzagTest(20.0, 20.0, duration_s=600.0)
    programme = (SteadyCourse(120.0), zigzag, SteadyCourse(400.0, heading_deg + 180.0), zigzag)
    trial = simulate_trial(replace(settings, programme=programme, heading_deg=heading_deg))
    blind = without(instruments_of(trial), "speed_through_water")
    start = trial.settings.start_utc_ns
    records = (
        make_record(blind, start + round((z.start_s - 20) * SECOND_NS), start + round(z.end_s * SECOND_NS))
        for z in trial.truth.zigzags
    )
    return trial, tuple(thinned(record, 400) for record in records)


@lru_cache(maxsize=16)
def found(
    no_log: NoLogSettings | None = None, current: str = "earth", *, pair: bool = False, along_m_s: float = 0.6
) -> Estimate:
    trial, (first, second) = sailed(along_m_s)
    spec = ModelSpec.model_validate({"current": current})
    arm = trial.truth.wind_arm_per_m
    return identify_without_log(first, spec, arm, SETTINGS, no_log, (second,) if pair else ())


def true_speed(trial: Trial, record: Record) -> float:
    since = (record.start_utc_ns - trial.settings.start_utc_ns) / SECOND_NS + record.time_s
    return float(np.mean(trial.truth.trajectory.at(since).state[:, STATE.index("V")]))


def test_current_along_the_course_is_taken_off_the_speed() -> None:
    trial, (record, _) = sailed(0.6)
    speed, truth = found().report["speed"], true_speed(trial, record)
    assert record.mean_speed_m_s - truth > 0.5, "GNSS along the bow is right already: this test shows nothing"
    assert abs(speed["mean_m_s"] - truth) < 3.0 * speed["std_m_s"]
    assert 0.005 * truth < speed["std_m_s"] < 0.05 * truth
    assert speed["converged"] and found().converged
    # what is not speed is current: their errors are one and the same
    assert speed["correlation_with_current_along"] < -0.8
    along = float(np.mean(0.6 * np.cos(record.heading_rad - np.deg2rad(40.0))))
    assert abs(speed["current_along_m_s"] - along) < 3.0 * speed["std_m_s"]


def test_parameters_lie_within_their_errors_and_these_hold_the_speed() -> None:
    trial, (record, _) = sailed(0.6)
    estimate = found()
    std = np.array([p.std for p in estimate.parameters])
    assert np.max(np.abs(estimate.hull.array() - truth_of(trial)) / std) < 3.0
    arm = trial.truth.wind_arm_per_m
    plain = maximum_likelihood.identify(record, SPEC, arm, SETTINGS)
    wrong = np.abs(plain.hull.b2 / truth_of(trial)[5] - 1.0)
    assert wrong > 2.0 * np.abs(estimate.hull.b2 / truth_of(trial)[5] - 1.0)
    speed = estimate.report["speed"]
    # b2 goes with the square of the speed and is otherwise known best
    assert std[5] / estimate.hull.b2 > 1.5 * speed["std_m_s"] / speed["mean_m_s"]
    assert estimate.estimator == "ml-no-log"
    assert any(w.startswith("no water log: speed") for w in estimate.warnings)
    json.dumps(estimate.report)


def test_the_lateral_model_cannot_tell_the_speed() -> None:
    trial, (record, _) = sailed(0.6)
    arm = trial.truth.wind_arm_per_m
    one = maximum_likelihood.identify(record, SPEC, arm, SETTINGS)
    other = maximum_likelihood.identify(replace(record, speed_m_s=1.1 * record.speed_m_s), SPEC, arm, SETTINGS)
    np.testing.assert_allclose(other.hull.array(), one.hull.array() / 1.1**SPEED_POWER, rtol=2e-3)
    assert other.report["log_likelihood"] == pytest.approx(one.report["log_likelihood"], abs=1e-3)


def test_a_run_on_the_opposite_heading_and_a_trial_speed_make_it_better() -> None:
    trial, (record, _) = sailed(0.6)
    truth, alone = true_speed(trial, record), found().report["speed"]["std_m_s"]
    known = NoLogSettings(trial_speed_m_s=trial.settings.hull.trial_speed_m_s, trial_speed_std_m_s=0.05)
    for estimate in (found(pair=True), found(known)):
        speed = estimate.report["speed"]
        assert abs(speed["mean_m_s"] - truth) < 3.0 * speed["std_m_s"]
        assert speed["std_m_s"] < 0.9 * alone
    assert found(pair=True).report["speed"]["runs"] == 2


def test_without_an_earth_current_only_a_trial_speed_helps() -> None:
    trial, (record, _) = sailed(0.6)
    vague = found(current="lateral")
    assert vague.report["speed"]["std_m_s"] > 1.0
    known = NoLogSettings(trial_speed_m_s=trial.settings.hull.trial_speed_m_s, trial_speed_std_m_s=0.1)
    speed = found(known, current="lateral").report["speed"]
    # a stream fixed in the earth taken for lateral is a wrong model: its errors are not white and all is widened
    assert speed["std_m_s"] < 0.7 * vague.report["speed"]["std_m_s"]
    assert abs(speed["mean_m_s"] - true_speed(trial, record)) < 3.0 * speed["std_m_s"]


def test_in_still_water_the_gnss_speed_is_the_speed() -> None:
    trial, (record, _) = sailed(0.0)
    estimate = found(current="none", along_m_s=0.0)
    speed = estimate.report["speed"]
    assert speed["mean_m_s"] == pytest.approx(true_speed(trial, record), abs=0.02)
    assert speed["std_m_s"] < 0.02
    assert any("no current" in warning for warning in estimate.warnings)


def test_a_drift_that_no_linear_hull_has_is_not_taken_for_a_current() -> None:
    trial, (record, _) = sailed(0.0)
    measured = record.measured.copy()
    measured[:, 0] -= 1.0 * np.sin(record.heading_rad - np.nanmean(record.heading_rad))
    bent, arm = replace(record, measured=measured), trial.truth.wind_arm_per_m
    truth = true_speed(trial, record)
    wary = identify_without_log(bent, SPEC, arm, SETTINGS)
    speed = wary.report["speed"]
    assert abs(speed["mean_m_s"] - truth) < 3.0 * speed["std_m_s"]
    assert speed["hull_misfit_m_s"][0] > 0.5
    assert any("unmodelled hull force" in warning for warning in wary.warnings)
    trusting = identify_without_log(bent, SPEC, arm, SETTINGS, NoLogSettings(hull_misfit=0.0)).report["speed"]
    assert abs(trusting["mean_m_s"] - truth) > 5.0 * trusting["std_m_s"]


def test_what_one_run_lacks_is_not_laid_upon_another() -> None:
    trial, (record, other) = sailed(0.0)
    measured = other.measured.copy()
    measured[:, 0] -= 0.6 * np.sin(other.heading_rad - np.nanmean(other.heading_rad))
    bent = replace(other, measured=measured)
    estimate = identify_without_log(record, SPEC, trial.truth.wind_arm_per_m, SETTINGS, None, (bent,))
    speed = estimate.report["speed"]
    assert speed["runs"] == 2
    assert abs(speed["mean_m_s"] - true_speed(trial, record)) < 3.0 * speed["std_m_s"]
    assert abs(speed["hull_misfit_m_s"][0]) < 3.0 * speed["hull_misfit_m_s"][1]


def test_a_hull_without_standard_errors_leaves_the_speed_without_one(monkeypatch: pytest.MonkeyPatch) -> None:
    trial, (record, _) = sailed(0.6)
    identify = maximum_likelihood.identify

    def blind(*given: Any) -> Estimate:
        return replace(identify(*given), covariance=np.full((6, 6), np.nan))

    monkeypatch.setattr(maximum_likelihood, "identify", blind)
    estimate = identify_without_log(record, SPEC, trial.truth.wind_arm_per_m, SETTINGS, NoLogSettings(max_rounds=1))
    assert np.isnan(estimate.report["speed"]["std_m_s"])
    assert all(np.isnan(p.std) and np.isfinite(p.value) for p in estimate.parameters)
    assert not estimate.converged and any("still moved" in warning for warning in estimate.warnings)


def test_two_calls_give_the_same_bits() -> None:
    trial, (record, _) = sailed(0.6)
    again = identify_without_log(record, SPEC, trial.truth.wind_arm_per_m, SETTINGS)
    assert again.hull == found().hull
    np.testing.assert_array_equal(again.covariance, found().covariance)


@pytest.mark.parametrize(("speed", "std"), [(None, 0.1), (5.0, 0.0), (-5.0, 0.1), (0.0, None)])
def test_half_a_trial_speed_is_refused(speed: float | None, std: float | None) -> None:
    trial, (record, _) = sailed(0.6)
    with pytest.raises(UsageError) as refused:
        identify_without_log(record, SPEC, trial.truth.wind_arm_per_m, SETTINGS, NoLogSettings(speed, std))
    assert refused.value.code == "trial_speed"


def test_a_trial_speed_of_unknown_worth_counts_little_and_only_near_it() -> None:
    trial, _ = sailed(0.6)
    trial_speed = trial.settings.hull.trial_speed_m_s
    near = found(NoLogSettings(trial_speed), current="lateral")
    assert near.report["speed"]["settings"]["trial_speed_std_m_s"] == pytest.approx(0.1 * trial_speed)
    vague, sure = found(current="lateral"), found(NoLogSettings(trial_speed, 0.1), current="lateral")
    assert sure.report["speed"]["std_m_s"] < near.report["speed"]["std_m_s"] < vague.report["speed"]["std_m_s"]
    assert any("known to 10 %" in warning for warning in near.warnings)
    far = found(NoLogSettings(2.0 * trial_speed), current="lateral")
    assert far.report["speed"]["settings"]["trial_speed_m_s"] is None
    assert far.report["speed"]["mean_m_s"] == vague.report["speed"]["mean_m_s"]
    assert any("is not used" in warning for warning in far.warnings)


def test_a_companion_that_fails_stops_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    trial, (record, other) = sailed(0.6)
    identify = maximum_likelihood.identify

    def failing(one: Record, *given: Any) -> Estimate:
        if one.start_utc_ns == other.start_utc_ns:
            raise DataRejected("no_ship_explains_it", "It does not.", "Look.")
        return identify(one, *given)

    monkeypatch.setattr(maximum_likelihood, "identify", failing)
    estimate = identify_without_log(record, SPEC, trial.truth.wind_arm_per_m, SETTINGS, None, (other,))
    assert estimate.hull == found().hull
    assert "1 of 1 other manoeuvres left out: no_ship_explains_it" in estimate.warnings


def test_the_rudder_in_the_race_follows_the_speed_that_is_found() -> None:
    trial, (record, _) = sailed(0.6)
    spec, arm = SPEC.model_copy(update={"rudder_speed_exponent": 1.2}), trial.truth.wind_arm_per_m
    seen: list[Record] = []
    with pytest.MonkeyPatch.context() as patch:
        identify = maximum_likelihood.identify

        def watched(one: Record, *given: Any) -> Estimate:
            seen.append(one)
            return identify(one, *given)

        patch.setattr(maximum_likelihood, "identify", watched)
        identify_without_log(record, spec, arm, SETTINGS, NoLogSettings(max_rounds=2))
    assert len(seen) == 2 and np.any(seen[0].rudder_rad != seen[1].rudder_rad)
    for one in seen:
        expected = with_rudder_inflow(replace(record, speed_m_s=one.speed_m_s), spec)
        np.testing.assert_array_equal(one.rudder_rad, expected.rudder_rad)


HOUR = 3600 * SECOND_NS


def passage(hours: float, heading_deg: float, **changes: Any) -> Passage:
    start = round(hours * HOUR)
    return replace(Passage(start, start + 600 * SECOND_NS, heading_deg, 1.5), **changes)


def test_companions_are_soon_and_on_other_headings() -> None:
    run = passage(0.0, 350.0)
    others = [
        run,
        passage(0.1, 10.0),  # the same heading
        passage(0.05, 170.0),  # overlaps
        passage(1.0, 80.0),
        passage(1.0, 170.0),  # at the same time as the one before, and makes more of the stream
        passage(9.0, 170.0),
        passage(14.0, 170.0),  # another day
        passage(0.5, 170.0, shaft_speed_per_s=1.4),
        passage(1.05, 175.0, shaft_speed_per_s=None),  # overlaps with a better one
    ]
    assert companions_of(run, others) == (4, 5)
    assert companions_of(run, others[:4]) == (3,)
    assert companions_of(run, others[:2]) == ()
    assert companions_of(run, [passage(-0.5, 170.0), passage(0.5, 170.0)]) == (0, 1)


@pytest.mark.parametrize(("ordered", "refused"), [(1.0, False), (0.9, False), (0.7, True), (-1.0, True)])
def test_an_engine_set_anew_is_refused(ordered: float, refused: bool) -> None:
    trial, _ = sailed(0.6)
    instruments = instruments_of(trial)
    shaft = instruments.series["shaft_speed"]
    start, end = int(shaft.time_utc_ns[0]), int(shaft.time_utc_ns[-1])
    late = shaft.time_utc_ns > start + 0.8 * (end - start)
    anew = replace(shaft, value=np.where(late, ordered, 1.0) * shaft.value)
    instruments = replace(instruments, series={**instruments.series, "shaft_speed": anew})
    if not refused:
        check_engine(instruments, start, end)
        return
    with pytest.raises(DataRejected, match="rpm") as said:
        check_engine(instruments, start, end)
    assert said.value.code == "engine_changed"
    # before it was set anew, and where nobody knows, nothing speaks against it
    check_engine(instruments, start, start + round(0.7 * (end - start)))
    # stopped for the most of it, so that the median is none of her speeds
    early = shaft.time_utc_ns < start + 0.6 * (end - start)
    stopped = replace(shaft, value=np.where(early, 0.0, shaft.value))
    with pytest.raises(DataRejected, match="from 0 to"):
        check_engine(replace(instruments, series={**instruments.series, "shaft_speed": stopped}), start, end)
    nowhere = {k: v for k, v in instruments.series.items() if k != "shaft_speed"}
    check_engine(replace(instruments, series=nowhere), start, end)


@pytest.mark.parametrize("readings", [0, 19, 20, 200])
def test_the_log_counts_where_the_record_takes_it(readings: int) -> None:
    trial, _ = sailed(0.6)
    instruments = instruments_of(trial)
    start = trial.settings.start_utc_ns + round((trial.truth.zigzags[0].start_s - 20) * SECOND_NS)
    end = trial.settings.start_utc_ns + round(trial.truth.zigzags[0].end_s * SECOND_NS)
    log = instruments.series["speed_through_water"].between(start - 5 * SECOND_NS, end + 5 * SECOND_NS)
    rows = np.linspace(0, len(log) - 1, readings).astype(int)
    series = {**instruments.series, "speed_through_water": Series(log.time_utc_ns[rows], log.value[rows])}
    instruments = replace(instruments, series=series)
    taken = not any(w.startswith("no water log") for w in make_record(instruments, start, end).warnings)
    assert has_log(instruments, start, end) is taken is (readings >= 20)
