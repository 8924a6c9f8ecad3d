"""Eq. (14) against textbook least squares, and on records without noise."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.estimate.paper.least_squares import Regression, regress, whole_pairs
from kempf.pipeline.estimate.record.sampled import Sampled
from kempf.pipeline.model.ship import continuous_from_discrete, discrete_from_continuous, mariner_like


def stacked(found: Regression) -> np.ndarray:
    return np.hstack([found.A, found.B])


def test_full_rank_is_ordinary_least_squares_with_its_standard_errors() -> None:
    random = np.random.default_rng(1)
    states, inputs = random.standard_normal((200, 2)) * [1.0, 0.01], random.standard_normal((200, 1))
    targets = random.standard_normal((200, 2))
    found = regress(states, inputs, targets)
    X = np.hstack([states, inputs])
    solution, residues, rank, _ = np.linalg.lstsq(X, targets, rcond=None)
    assert found.rank == rank == 3
    np.testing.assert_allclose(stacked(found), solution.T, rtol=1e-10)
    # the formula as eq. (14) has it, columns of Z0 the samples
    Z0, YN = X.T, targets.T
    np.testing.assert_allclose(stacked(found), YN @ Z0.T @ np.linalg.inv(Z0 @ Z0.T), rtol=1e-8)
    expected = np.sqrt(np.outer(residues / (200 - 3), np.diag(np.linalg.inv(X.T @ X))))
    np.testing.assert_allclose(found.std, expected, rtol=1e-9)


def test_singular_gives_the_minimum_norm_solution_in_the_units_of_the_matrices() -> None:
    random = np.random.default_rng(2)
    base = random.standard_normal((100, 2))
    # the third regressor is a multiple of the first: rank 2; the scales differ, so that a scaled norm would be seen
    states, inputs = np.column_stack([base[:, 0], 0.05 * base[:, 1]]), 3.0 * base[:, :1]
    targets = random.standard_normal((100, 2))
    found = regress(states, inputs, targets)
    X = np.hstack([states, inputs])
    assert found.rank == 2
    np.testing.assert_allclose(stacked(found), (np.linalg.pinv(X, rcond=1e-10) @ targets).T, rtol=1e-9, atol=1e-12)
    assert np.all(np.isfinite(found.std))


def test_nothing_measured_but_zero_gives_zero() -> None:
    found = regress(np.zeros((50, 2)), np.zeros((50, 1)), np.zeros((50, 2)))
    assert found.rank == 0
    assert not np.any(stacked(found))
    assert not np.any(found.std)


@pytest.mark.parametrize("step_s", [0.5, 2.0])
def test_exact_recovery_without_noise_and_disturbance(step_s: float) -> None:
    hull, V = mariner_like(120.0), 6.0
    A, B = discrete_from_continuous(hull, V, step_s)
    u = 0.3 * np.sign(np.sin(0.05 * np.arange(400)))[:, None]
    x = np.zeros((400, 2))
    for k in range(399):
        x[k + 1] = A @ x[k] + B @ u[k]
    found = regress(x[:-1], u[:-1], x[1:])
    np.testing.assert_allclose(found.A, A, rtol=1e-9)
    np.testing.assert_allclose(found.B, B, rtol=1e-9)
    back = continuous_from_discrete(found.A, found.B, V, step_s)
    assert back is not None
    np.testing.assert_allclose(back.array(), hull.array(), rtol=1e-7)


def test_pairs_skip_every_gap() -> None:
    measured = np.ones((8, 2))
    measured[3, 0] = np.nan
    measured[6, 1] = np.nan
    now, after = whole_pairs(Sampled(1.0, measured, np.zeros(8), 5.0))
    assert now.tolist() == [0, 1, 4]
    assert after.tolist() == [1, 2, 5]
