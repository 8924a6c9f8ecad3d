"""What effects make of the rudder's course, against closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.effects import RUDDER_COURSES
from kempf.pipeline.model.rudder_line import RudderLine
from kempf.schemas.effect import Effect
from kempf.schemas.effects import catalogue

Course = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
courses = pytest.mark.parametrize(
    ("effect", "course"),
    [(e, RUDDER_COURSES[e.rudder_course]) for e in catalogue().values() if e.rudder_course],
    ids=lambda one: getattr(one, "name", ""),
)


def zigzag(step: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """A rudder put over and back at 3 deg/s, on an even axis."""
    time = np.arange(0.0, 80.0 + step / 2, step)
    corners = [0.0, 5.0, 11.7, 30.0, 43.3, 60.0, 73.3, 80.0]
    return time, np.interp(time, corners, [0.0, 0.0, 0.35, 0.35, -0.35, -0.35, 0.35, 0.35])


def one(effect: Effect, k: int) -> np.ndarray:
    return np.array([p.steps[min(k, len(p.steps) - 1)] for p in effect.parameters])


@courses
def test_without_its_parameter_the_course_is_unchanged(effect: Effect, course: Course) -> None:
    time, rudder = zigzag()
    assert np.array_equal(course(time, rudder, np.zeros(1)), rudder)
    assert np.allclose(course(time, rudder, np.full(1, 1e-9)), rudder, atol=1e-8)


@courses
def test_a_course_is_deterministic_causal_and_leaves_its_input_alone(effect: Effect, course: Course) -> None:
    time, rudder = zigzag()
    kept = rudder.copy()
    for k in range(3):
        first = course(time, rudder, one(effect, k))
        assert first.shape == rudder.shape and np.all(np.isfinite(first))
        assert np.array_equal(first, course(time, rudder, one(effect, k)))
        later = rudder.copy()
        later[400:] = 0.1
        assert np.array_equal(course(time, later, one(effect, k))[:400], first[:400])
        assert np.max(np.abs(first)) <= np.max(np.abs(rudder)) + 1e-12
        assert np.allclose(course(time, -rudder, one(effect, k)), -first, atol=1e-15)
    assert np.array_equal(rudder, kept)
    still = np.full(time.size, 0.2)
    assert np.allclose(course(time, still, one(effect, 0)), still, atol=1e-15)
    assert course(time[:1], rudder[:1], one(effect, 0)).shape == (1,)


def test_lag_is_the_exact_response_to_a_ramp() -> None:
    course = RUDDER_COURSES["rudder_lag"]
    time = np.arange(0.0, 20.0, 0.25)
    for tau in (0.05, 0.7, 4.0):
        exact = 0.03 * (time - tau * (1.0 - np.exp(-time / tau)))
        assert np.allclose(course(time, 0.03 * time, np.array([tau])), exact, atol=1e-13)


def test_lag_does_not_depend_on_the_step() -> None:
    course = RUDDER_COURSES["rudder_lag"]
    fine, coarse = zigzag(0.025), zigzag(0.1)
    values = np.array([1.5])
    assert np.allclose(course(*fine, values)[::4], course(coarse[0], fine[1][::4], values), atol=1e-12)


def test_dead_time_shifts() -> None:
    course = RUDDER_COURSES["dead_time"]
    time, rudder = zigzag()
    late = course(time, rudder, np.array([1.2]))
    assert np.allclose(late[12:], rudder[:-12], atol=1e-12)
    assert np.all(late[:12] == rudder[0])


def test_backlash_is_a_play() -> None:
    course = RUDDER_COURSES["backlash"]
    time, rudder = zigzag()
    taken = course(time, rudder, np.array([0.05]))
    assert np.max(np.abs(taken - rudder)) == pytest.approx(0.025)
    assert taken[250] == pytest.approx(0.325) and taken[500] == pytest.approx(-0.325)
    small = 0.02 * np.sin(time)
    assert np.all(course(time, small, np.array([0.05])) == 0.0)


def test_rate_limit_is_exact_between_the_instants() -> None:
    course = RUDDER_COURSES["rate_limit"]
    rng = np.random.default_rng(7)
    knots = np.cumsum(rng.normal(0.0, 0.05, 40))
    coarse = np.arange(0.0, 40.0)
    fine = np.arange(0.0, 39.0 + 5e-4, 1e-3)
    slowness = np.array([20.0])
    reference = course(fine, np.interp(fine, coarse, knots), slowness)
    assert np.allclose(course(coarse, knots, slowness), reference[::1000], atol=1e-12)
    assert np.max(np.abs(np.diff(reference))) <= 1e-3 / 20.0 + 1e-15
    stepped = np.where(coarse < 5.0, 0.0, 0.3)
    assert course(coarse, stepped, slowness)[4:12] == pytest.approx([0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.3])


@courses
def test_what_the_rudder_did_before_a_run_decides_where_it_stands(effect: Effect, course: Course) -> None:
    time, rudder = zigzag()
    model, size = EffectModel((effect,)), one(effect, 1)
    cut = 350
    values = np.stack([np.zeros(size.size), size], axis=1)
    grid = time[cut:] if (time.size - cut) % 2 else time[cut:-1]
    found = model.rudders(RudderLine.through(time, rudder, grid), values)
    np.testing.assert_allclose(found[::2, 0], rudder[cut::2][: grid[::2].size], atol=1e-12)
    np.testing.assert_allclose(found[::2, 1], course(time, rudder, size)[cut::2][: grid[::2].size], atol=1e-12)
    alone = model.rudders(RudderLine.through(time[cut:], rudder[cut:], grid), values)
    assert np.max(np.abs(alone[:, 1] - found[:, 1])) > 1e-3


@courses
def test_an_effect_acts_on_the_corners_of_the_reading_not_on_those_of_the_grid(effect: Effect, course: Course) -> None:
    """Its course on a coarse grid is that of a fine one, its area over two steps with it."""
    fine = np.arange(0.0, 400.0, 0.01)
    size, fast = one(effect, 1), np.deg2rad(5.0)
    # executes between the instants of the grid, and a rudder that goes over within a step of it
    corners = np.array([0.0, 21.37, 21.37 + 0.35 / fast, 83.11, 83.11 + 0.7 / fast, 160.73, 160.73 + 0.7 / fast, 400.0])
    reading = np.array([0.0, 0.0, 0.35, 0.35, -0.35, -0.35, 0.35, 0.35])
    grid = np.arange(0.0, 399.0, 1.0)
    line = RudderLine.through(corners, reading, grid)
    exact = course(fine, np.interp(fine, corners, reading), size)
    laid = EffectModel((effect,)).rudders(line, size[:, None])[:, 0]
    np.testing.assert_allclose(laid[::2], np.interp(grid[::2], fine, exact), atol=2e-3)
    areas = (laid[:-1:2] + 4.0 * laid[1::2] + laid[2::2]) / 3.0
    whole = np.concatenate([[0.0], np.cumsum(0.5 * 0.01 * (exact[1:] + exact[:-1]))])
    expected = np.diff(np.interp(grid[::2], fine, whole))
    # on the whole it comes neither early nor late
    assert abs(np.sum((areas - expected) * np.sign(expected))) < 2e-3 * np.sum(np.abs(expected))
    np.testing.assert_allclose(areas, expected, atol=2e-2)
