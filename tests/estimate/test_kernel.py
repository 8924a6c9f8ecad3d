"""The compiled likelihood against the joint normal density, central differences and the exact information."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kempf.pipeline.estimate.filters.linear_kernel import N_STATE, N_THETA, likelihood, no_trace
from tests.estimate.joint_gaussian import ORDER, Case, Float, fisher, log_density, make_case, moments, values

UNSTABLE = (-0.5, -0.45, -4.5, -1.2, -0.1, 1.0)
CASES = {
    "earth current": make_case(seed=1),
    "lateral current": make_case(seed=2, current="lateral"),
    "no arm": make_case(seed=3, arm=0.0),
    "unstable ship": make_case(seed=4, prime=UNSTABLE),
    "boat of 3 m": make_case(seed=5, length_m=3.0, speed_m_s=2.0, mean_interval_s=0.4, arm=0.3),
    "tanker, long gaps": make_case(seed=6, length_m=320.0, mean_interval_s=25.0, arm=0.0025),
    "eigenvalues that circle": make_case(seed=7, prime=(-0.6, 0.8, -3.0, -0.7, -0.1, 1.0)),
}


def evaluate(case: Case, *, derivatives: bool = True, trace: tuple[Float, ...] = ()) -> tuple[float, Float, Float]:
    compiled: Any = likelihood
    result: tuple[float, Float, Float] = compiled(case.theta, derivatives, *case.arguments(), trace or no_trace())
    return result


def value(case: Case, theta: Float | None = None) -> float:
    return evaluate(case if theta is None else replace(case, theta=theta), derivatives=False)[0]


@pytest.mark.parametrize("name", CASES)
def test_log_likelihood_is_the_joint_normal_density_of_all_measurements(name: str) -> None:
    case = CASES[name]
    assert value(case) == pytest.approx(log_density(case, case.theta), rel=1e-9, abs=1e-8)


def test_the_unstable_case_is_unstable_and_the_circling_one_circles() -> None:
    a11, a12, a21, a22, _, _ = CASES["unstable ship"].theta[:6]
    assert a11 * a22 - a12 * a21 < 0
    a11, a12, a21, a22, _, _ = CASES["eigenvalues that circle"].theta[:6]
    assert np.iscomplexobj(np.linalg.eigvals([[a11, a12], [a21, a22]]))


@pytest.mark.parametrize("name", CASES)
def test_score_is_the_slope_of_the_joint_density(name: str) -> None:
    case = CASES[name]
    _, score, _ = evaluate(case)
    for j in range(N_THETA):
        # fourth order, so that the step may be large beside the rounding of the log-likelihood
        h = 1e-3 * max(abs(case.theta[j]), 1e-7)
        e = np.eye(N_THETA)[j] * h
        near = value(case, case.theta + e) - value(case, case.theta - e)
        far = value(case, case.theta + 2 * e) - value(case, case.theta - 2 * e)
        slope = (8.0 * near - far) / (12.0 * h)
        assert score[j] == pytest.approx(slope, rel=1e-6, abs=1e-10 / h), (name, j)


def test_last_filtered_state_is_the_conditional_mean_of_the_joint_density() -> None:
    for case in CASES.values():
        n = case.time_s.size
        innovation, variance = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
        states, spread, scores = np.empty((n, N_STATE)), np.empty((n, N_STATE)), np.zeros((n, 3, N_THETA))
        _, score, _ = evaluate(case, trace=(innovation, variance, states, spread, scores))
        mean, covariance, last, cross = moments(case, case.theta)
        expected = last + cross @ np.linalg.solve(covariance, values(case) - mean)
        np.testing.assert_allclose(states[-1], expected[ORDER], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(scores.sum(axis=(0, 1)), score, rtol=1e-9, atol=1e-9 * np.abs(score).max())
        np.testing.assert_array_equal(np.isfinite(innovation), np.isfinite(case.measured))
        # the whitened innovations are the rotated errors: same quadratic form
        error = values(case) - mean
        assert np.nansum(innovation**2 / variance) == pytest.approx(
            error @ np.linalg.solve(covariance, error), rel=1e-8
        )


def test_information_averages_to_the_exact_one_and_to_the_outer_product_of_scores() -> None:
    case = make_case(n=40, seed=11, same_instant=False)
    exact = fisher(case, case.theta)
    mean, covariance, _, _ = moments(case, case.theta)
    root = np.linalg.cholesky(covariance)
    random = np.random.default_rng(5)
    scale = np.sqrt(np.diag(exact))
    scores, informations = [], []
    for _ in range(600):
        drawn = case.measured.copy()
        drawn[np.isfinite(drawn)] = mean + root @ random.standard_normal(mean.size)
        _, score, information = evaluate(replace(case, measured=drawn))
        scores.append(score / scale)
        informations.append(information / np.outer(scale, scale))
    normal = exact / np.outer(scale, scale)
    for found in (np.array(informations), np.einsum("ki,kj->kij", np.array(scores), np.array(scores))):
        error = np.mean(found, axis=0) - normal
        standard = np.std(found, axis=0) / np.sqrt(len(found))
        assert np.max(np.abs(error) / (standard + 1e-6)) < 4.5
    assert np.max(np.abs(np.mean(scores, axis=0))) < 4.5 / np.sqrt(len(scores))


def test_information_is_symmetric_and_positive_definite() -> None:
    for case in CASES.values():
        information = evaluate(case)[2]
        np.testing.assert_array_equal(information, information.T)
        scale = np.sqrt(np.diag(information))
        assert np.linalg.eigvalsh(information / np.outer(scale, scale))[0] > 0.0


def test_a_long_interval_is_several_short_ones() -> None:
    case = replace(make_case(seed=8, mean_interval_s=30.0), speed=np.full(24, 7.0))
    # instants between, where nothing is measured
    time = np.unique(np.concatenate([case.time_s, *(case.time_s[:-1] + f * np.diff(case.time_s) for f in (0.2, 0.7))]))
    first = [int(np.searchsorted(time, t)) for t in np.unique(case.time_s)]
    whole = np.flatnonzero(np.diff(case.time_s, append=np.inf) > 0)  # of two equal instants the second
    measured, row = np.full((time.size, 3), np.nan), np.zeros((time.size, 2))
    measured[first], row[first] = case.measured[whole], case.current_row[whole]
    once = replace(
        case,
        rudder_noise=np.zeros(whole.size),
        error_gain=np.zeros(whole.size),
        **{name: getattr(case, name)[whole] for name in ("time_s", "speed", "rudder", "measured", "current_row")},
    )
    fine = replace(
        once,
        time_s=time,
        rudder_noise=np.zeros(time.size),
        error_gain=np.zeros(time.size),
        speed=np.full(time.size, 7.0),
        rudder=np.interp(time, once.time_s, once.rudder),
        measured=measured,
        current_row=row,
    )
    coarse_value, coarse_score, coarse_information = evaluate(once)
    fine_value, fine_score, fine_information = evaluate(fine)
    assert fine_value == pytest.approx(coarse_value, rel=1e-10)
    np.testing.assert_allclose(fine_score, coarse_score, rtol=1e-7, atol=1e-7 * np.max(np.abs(coarse_score)) * 1e-6)
    np.testing.assert_allclose(
        fine_information, coarse_information, rtol=1e-7, atol=1e-10 * np.abs(coarse_information).max()
    )


def test_two_calls_give_the_same_bits_and_leave_their_arguments_alone() -> None:
    case = make_case(seed=9)
    before = [np.copy(a) for a in case.arguments()]
    first = evaluate(case)
    second = evaluate(case)
    assert first[0] == second[0]
    np.testing.assert_array_equal(first[1], second[1])
    np.testing.assert_array_equal(first[2], second[2])
    for one, other in zip(before, case.arguments(), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("absent", [[2], [3], [7], [5, 6], [2, 3, 5, 6, 7], [4]])
def test_states_without_variance_are_left_out_and_their_noise_levels_say_nothing(absent: list[int]) -> None:
    whole = make_case(seed=10)
    x0, P0 = whole.x0.copy(), whole.P0.copy()
    x0[absent] = 0.0
    P0[absent], P0[:, absent] = 0.0, 0.0
    measured = whole.measured.copy()
    if 4 in absent:
        measured[:, 2] = np.nan
    nothing = whole.theta.copy()
    levels = {2: 6, 3: 7, 5: 8}
    silent = [levels[i] for i in absent if i in levels]
    nothing[silent] = -400.0
    case = replace(whole, x0=x0, P0=P0, measured=measured, theta=nothing)
    value_, score, information = evaluate(case)
    assert value_ == pytest.approx(log_density(case, nothing), rel=1e-9)
    assert not np.any(score[silent]) and not np.any(information[silent])


@pytest.mark.parametrize("count", [1, 2, 7])
def test_nothing_jumps_where_the_number_of_substeps_changes(count: int) -> None:
    case = make_case(seed=12, n=8, same_instant=False, rudder_noise=0.0, error_gain=0.0)
    V = 7.0
    hull = case.theta[:6]
    size = V * (abs(hull[0]) + abs(hull[3]) + np.sqrt(abs(hull[1] * hull[2]))) + case.moment_rate
    results = []
    for side in (1.0 - 1e-12, 1.0 + 1e-12):
        span = count * 0.5 / size * side
        moved = replace(case, time_s=np.arange(8) * span, speed=np.full(8, V))
        results.append(evaluate(moved))
    (value_below, score_below, information_below), (value_above, score_above, information_above) = results
    assert value_above == pytest.approx(value_below, rel=1e-9)
    np.testing.assert_allclose(score_above, score_below, rtol=1e-7)
    np.testing.assert_allclose(information_above, information_below, rtol=1e-6, atol=1e-12 * information_below.max())


def test_parameters_beyond_any_vessel_have_no_likelihood() -> None:
    case = make_case(seed=13)
    for index, wrong in ((0, -50.0), (1, np.nan), (0, np.inf), (9, np.nan)):
        theta = case.theta.copy()
        theta[index] = wrong
        value_, score, information = evaluate(replace(case, theta=theta))
        assert value_ == -np.inf
        assert np.all(np.isfinite(score)) and np.all(np.isfinite(information))


def test_instants_without_measurements_add_nothing() -> None:
    case = make_case(seed=14)
    empty = replace(case, measured=np.full_like(case.measured, np.nan))
    value_, score, information = evaluate(empty)
    assert value_ == 0.0
    assert not np.any(score) and not np.any(information)
