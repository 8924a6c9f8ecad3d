"""The smoothing spline against that of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

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


def test_without_a_penalty_it_is_the_readings_and_with_all_of_it_a_straight_line() -> None:
    time = np.arange(50.0)
    y = np.column_stack([0.3 * time + np.random.default_rng(4).standard_normal(50)])
    np.testing.assert_allclose(Smoother(time, y).smooth(0.0), y)
    line = np.polyval(np.polyfit(time, y[:, 0], 1), time)
    np.testing.assert_allclose(Smoother(time, y).smooth(1e12)[:, 0], line, atol=1e-5)
