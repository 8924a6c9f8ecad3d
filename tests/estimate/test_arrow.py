"""The arrow's Schur complement against the dense matrix."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

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
    scores = scale * random.standard_normal((members, SHARED + OWN))
    return Arrow(all_of[:, :SHARED, :SHARED], all_of[:, :SHARED, SHARED:], all_of[:, SHARED:, SHARED:], scores)


def dense_of(one: Arrow) -> np.ndarray:
    """The arrow as one matrix."""
    members, n, width = one.coupling.shape
    matrix = np.zeros((n + members * width, n + members * width))
    matrix[:n, :n] = one.shared.sum(axis=0)
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


def moved_by(one: Arrow, free: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A step of all, and what of it every member has."""
    step = np.where(free, score_of(one, seed) / np.diag(dense_of(one)), 0.0)
    members = one.coupling.shape[0]
    own = step[SHARED:].reshape(members, OWN)
    return step, np.concatenate([np.tile(step[:SHARED], (members, 1)), own], axis=1)


def test_every_member_is_corrected_by_what_a_step_showed_of_it() -> None:
    here, truth = arrow(3), arrow(3, seed=9)
    free = free_of(here, 5)
    step, moved = moved_by(here, free, 1)
    fall = np.einsum("mij,mj->mi", truth.blocks(), moved)
    before = replace(here, scores=here.scores + fall)
    steps = ArrowSteps()
    corrected = steps.corrected(here, before, here, step, np.zeros(step.size), free)
    shown = np.concatenate([np.tile(free[:SHARED], (3, 1)), free[SHARED:].reshape(3, OWN)], axis=1)
    scale = np.sqrt(np.diagonal(truth.blocks(), axis1=1, axis2=2))
    found = np.einsum("mij,mj->mi", corrected.blocks(), moved)
    convex = np.sum(moved * fall, axis=1) > 0.2 * np.sum(moved * np.einsum("mij,mj->mi", here.blocks(), moved), axis=1)
    assert convex.any()
    np.testing.assert_allclose((found / scale)[convex], (fall * shown / scale)[convex], rtol=1e-6, atol=1e-9)


def test_a_member_whose_score_rose_on_a_step_keeps_a_positive_definite_block() -> None:
    here = arrow(2)
    free = np.ones(SHARED + 2 * OWN, dtype=bool)
    step, moved = moved_by(here, free, 2)
    fall = np.einsum("mij,mj->mi", here.blocks(), moved) * np.array([[-1.0], [1.0]])
    corrected = ArrowSteps().corrected(here, replace(here, scores=here.scores + fall), here, step, step, free)
    blocks, scale = corrected.blocks(), np.sqrt(np.diagonal(here.blocks(), axis1=1, axis2=2))
    unit = blocks / scale[:, :, None] / scale[:, None, :]
    assert np.all(np.linalg.eigvalsh(unit) > 0.0)
    np.testing.assert_allclose(
        blocks[1] / np.outer(scale[1], scale[1]), here.blocks()[1] / np.outer(scale[1], scale[1])
    )
    # along the step a fifth of its curvature is left of the first
    along = [moved[0] @ block @ moved[0] for block in (blocks[0], here.blocks()[0])]
    assert along[0] == pytest.approx(0.2 * along[1])


def test_what_has_no_room_is_put_to_its_edge_and_the_rest_solved_anew() -> None:
    one = arrow(3)
    dense, score = dense_of(one), score_of(one)
    free = np.ones(score.size, dtype=bool)
    step = ArrowSteps().damped(score, one, free, 0.0)
    low, high = np.full(score.size, -np.inf), np.full(score.size, np.inf)
    put = SHARED + OWN + 2
    low[put], high[put] = -0.3 * abs(step[put]), 0.3 * abs(step[put])
    found = ArrowSteps().within(score, one, free, 0.0, (low, high))
    rest = np.arange(score.size) != put
    expected = np.zeros(score.size)
    expected[put] = 0.3 * step[put]
    expected = expected + damped_step(score - dense @ expected, dense, rest, 0.0)
    assert scaled_difference(one, found, expected) < 1e-7


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
    loose = replace(one, coupling=coupling, own=own)
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


def test_a_corrected_matrix_gives_what_the_step_showed() -> None:
    curvature, truth = dense_of(arrow(1)), dense_of(arrow(1, seed=9))
    step = 1.0 / np.sqrt(np.diag(truth))
    corrected = bfgs(curvature, step, truth @ step, np.ones(step.size, dtype=np.bool_))
    np.testing.assert_allclose(corrected @ step * step, truth @ step * step, rtol=1e-6)
    # a step on which the score rose shows nothing that a maximum has
    assert bfgs(curvature, step, -truth @ step, np.ones(step.size, dtype=np.bool_)) is curvature


def test_a_step_whose_curvature_is_beyond_numbers_corrects_nothing() -> None:
    huge = np.diag([1e200, 1.0])
    step, fall = np.array([1.0, 1e-3]), np.array([1e-3, 1e-3])
    assert np.array_equal(bfgs(huge, step, fall, np.ones(2, dtype=np.bool_)), huge)
