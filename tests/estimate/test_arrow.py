"""The arrow's Schur complement against the dense matrix."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from kempf.pipeline.estimate.search.block_arrow import Arrow, ArrowSteps
from kempf.pipeline.estimate.search.scoring import bfgs, damped_step

SHARED, OWN = 6, 6


def arrow(members: int, seed: int = 0) -> Arrow:
    """Information of members whose scales lie far apart, as a hull's and logarithms of levels do."""
    random = np.random.default_rng(seed)
    scale = 10.0 ** random.uniform(-3, 3, SHARED + OWN)
    blocks = []
    for _ in range(members):
        root = random.standard_normal((SHARED + OWN, SHARED + OWN + 3)) * scale[:, None]
        blocks.append(root @ root.T)
    all_of = np.array(blocks)
    return Arrow(all_of[:, :SHARED, :SHARED].sum(axis=0), all_of[:, :SHARED, SHARED:], all_of[:, SHARED:, SHARED:])


def dense_of(one: Arrow) -> np.ndarray:
    """The arrow as one matrix, without what was shown."""
    n, (members, _, width) = one.shared.shape[0], one.coupling.shape
    matrix = np.zeros((n + members * width, n + members * width))
    matrix[:n, :n] = one.shared
    for i in range(members):
        here = slice(n + i * width, n + (i + 1) * width)
        matrix[:n, here], matrix[here, :n] = one.coupling[i], one.coupling[i].T
        matrix[here, here] = one.own[i]
    return matrix


def score_of(one: Arrow, seed: int = 1) -> np.ndarray:
    random = np.random.default_rng(seed)
    result: np.ndarray = np.sqrt(np.diag(dense_of(one))) * random.standard_normal(dense_of(one).shape[0])
    return result


def free_of(one: Arrow, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(size=dense_of(one).shape[0]) > 0.2


def scaled_difference(one: Arrow, a: np.ndarray, b: np.ndarray) -> float:
    scale = np.sqrt(np.diag(dense_of(one)))
    return float(np.max(np.abs((a - b) * scale)) / np.max(np.abs(b * scale)))


@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0])
@pytest.mark.parametrize("members", [1, 2, 7])
def test_steps_are_those_of_the_dense_matrix(members: int, damping: float) -> None:
    one = arrow(members)
    for seed in range(3):
        free = free_of(one, seed)
        expected = damped_step(score_of(one), dense_of(one), free, damping)
        found = ArrowSteps().damped(score_of(one), one, free, damping)
        assert scaled_difference(one, found, expected) < 1e-7
        assert np.all(found[~free] == 0.0)


def test_steps_shown_correct_it_as_bfgs_corrects_the_dense_matrix() -> None:
    one = arrow(3)
    free = free_of(one, 5)
    truth = dense_of(arrow(3, seed=9))  # another curvature, which the steps show
    steps, dense, shown = ArrowSteps(), dense_of(one), one
    for seed in range(4):
        step = np.where(free, score_of(one, seed) / np.diag(dense_of(one)), 0.0)
        fall = truth @ step
        dense, shown = bfgs(dense, step, fall, free), steps.updated(shown, step, fall, free)
        expected = damped_step(score_of(one), dense, free, 0.0)
        assert scaled_difference(one, steps.damped(score_of(one), shown, free, 0.0), expected) < 1e-6
    assert len(shown.shown) == 4
    # a step on which the score rose shows nothing that a maximum has
    assert steps.updated(shown, step, -fall, free) is shown


def test_the_complement_is_the_hulls_information_with_all_levels_unknown() -> None:
    one = arrow(5)
    free = np.ones(dense_of(one).shape[0], dtype=bool)
    free[[8, 20]] = False
    complement, carried = one.masked(free).eliminated()
    index = np.flatnonzero(free)
    covariance = np.linalg.inv(dense_of(one)[np.ix_(index, index)])[:SHARED, :SHARED]
    scale = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        np.linalg.inv(complement) / np.outer(scale, scale), covariance / np.outer(scale, scale), atol=1e-7
    )
    assert carried.shape == (5, SHARED, OWN)
    np.testing.assert_allclose(carried[0, :, 2] / np.abs(carried[0]).max(axis=1), 0.0, atol=1e-12)


def test_what_nothing_determines_gets_no_step() -> None:
    one = arrow(2)
    own, coupling = one.own.copy(), one.coupling.copy()
    own[1, 3], own[1, :, 3], coupling[1, :, 3] = 0.0, 0.0, 0.0
    loose = Arrow(one.shared, coupling, own)
    score = score_of(loose)
    step = ArrowSteps().damped(score, loose, np.ones(score.size, dtype=bool), 0.0)
    assert np.all(np.isfinite(step)) and step[SHARED + OWN + 3] == 0.0


def test_cost_is_linear_in_members() -> None:
    def of(members: int) -> Callable[[], object]:
        one = arrow(members)
        score, free = np.ones(SHARED + OWN * members), np.ones(SHARED + OWN * members, dtype=bool)
        return lambda: ArrowSteps().damped(score, one, free, 0.1)

    def fastest(call: Callable[[], object]) -> float:
        times = []
        for _ in range(7):
            start = time.process_time()
            call()
            times.append(time.process_time() - start)
        return min(times)

    # sixteen times the members: sixteen times the time and not 4096, with room for a busy machine
    assert fastest(of(3200)) < 100.0 * fastest(of(200))


def test_a_step_whose_curvature_is_beyond_numbers_corrects_nothing() -> None:
    huge = np.diag([1e200, 1.0])
    step, fall = np.array([1.0, 1e-3]), np.array([1e-3, 1e-3])
    assert np.array_equal(bfgs(huge, step, fall, np.ones(2, dtype=np.bool_)), huge)
