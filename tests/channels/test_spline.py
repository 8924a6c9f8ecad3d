"""The smoothing spline against that of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline
from scipy.stats import multivariate_normal

from kempf.pipeline.channels.spline import Smoother


@pytest.mark.parametrize("penalty", [1e-4, 1.0, 1e5])
def test_it_is_the_spline_of_scipy_at_the_knots(penalty: float) -> None:
    random = np.random.default_rng(3)
    time = np.cumsum(random.uniform(0.2, 2.0, 300))
    columns = np.column_stack([np.sin(0.1 * time) + 0.1 * random.standard_normal(300), random.standard_normal(300)])
    found = Smoother(time, columns).smooth(penalty)
    for k in range(2):
        expected = make_smoothing_spline(time, columns[:, k], lam=penalty)(time)
        np.testing.assert_allclose(found[:, k], expected, atol=1e-7)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("gap_s", [1e-9, 1e-6, 1e-4])
def test_readings_that_came_within_a_microsecond_of_each_other_are_smoothed_like_the_others(
    order: int, gap_s: float
) -> None:
    time = np.arange(300.0)
    held_up = time.copy()
    held_up[[40, 41, 42, 200]] = [43.0 - 3 * gap_s, 43.0 - 2 * gap_s, 43.0 - gap_s, 201.0 - gap_s]
    y = np.column_stack([np.sin(0.05 * time) + 0.1 * np.random.default_rng(6).standard_normal(300)])
    found = Smoother(held_up, y, order)
    smooth = found.smooth(30.0)
    assert np.isfinite(found.whitened(30.0)[1])
    away = np.abs(smooth - Smoother(time, y, order).smooth(30.0))
    assert np.max(away[60:190]) < 1e-3 and np.max(away) < 0.2


def test_without_a_penalty_it_is_the_readings_and_with_all_of_it_a_straight_line() -> None:
    time = np.arange(50.0)
    y = np.column_stack([0.3 * time + np.random.default_rng(4).standard_normal(50)])
    np.testing.assert_allclose(Smoother(time, y).smooth(0.0), y)
    line = np.polyval(np.polyfit(time, y[:, 0], 1), time)
    np.testing.assert_allclose(Smoother(time, y).smooth(1e12)[:, 0], line, atol=1e-5)


def covariance_of(time: np.ndarray, order: int) -> np.ndarray:
    """Of a random walk, or of an integrated one, that starts at the first instant with 0, of unit density."""
    less, more = np.minimum.outer(time, time), np.maximum.outer(time, time)
    return less if order == 1 else less**2 * (3.0 * more - less) / 6.0


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("penalty", [0.05, 2.0, 300.0])
def test_it_is_the_expected_path_of_a_random_walk_and_as_likely_as_its_density_says(order: int, penalty: float) -> None:
    random = np.random.default_rng(5)
    time = np.concatenate([[0.0], np.cumsum(random.uniform(0.5, 1.5, 29))])
    y = random.standard_normal(30).cumsum()
    # where it starts, and how steeply, is anything: a great variance
    start = np.vander(time, order, increasing=True)
    path = covariance_of(time, order) / penalty + 1e7 * start @ start.T
    whole = path + np.eye(30)
    smoother = Smoother(time, y[:, None], order)
    np.testing.assert_allclose(smoother.smooth(penalty)[:, 0], path @ np.linalg.solve(whole, y), atol=1e-4)
    white, log_determinant = smoother.whitened(penalty)
    square = float(white[:, 0] @ white[:, 0])
    count = 30 - order
    found = -0.5 * (square + log_determinant + count * np.log(2.0 * np.pi))
    rest, first = slice(order, None), slice(0, order)
    slope = np.linalg.solve(whole[first, first], whole[first, rest]).T
    given = multivariate_normal(slope @ y[first], whole[rest, rest] - slope @ whole[first, rest])
    assert found == pytest.approx(given.logpdf(y[rest]), abs=1e-3)
