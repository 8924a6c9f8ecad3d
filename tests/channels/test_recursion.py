"""A recursive filter solved as a triangle is the filter of scipy.signal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from kempf.pipeline.channels.recursion import filtered
from kempf.pipeline.estimate.record.heel import oscillator

LAG = [0.1], [1.0, -0.9]
SWING = oscillator(9.0, 0.1, 0.1)


@pytest.mark.parametrize("shape", [(1,), (2,), (3,), (5000,), (400, 3), (0,), (0, 2), (4, 0)])
@pytest.mark.parametrize(("numerator", "denominator"), [LAG, SWING, ([1.0], [1.0, -0.3])])
def test_it_is_that_of_scipy(numerator, denominator, shape):
    columns = np.random.default_rng(1).standard_normal(shape)
    wanted = lfilter(numerator, denominator, columns, axis=0)
    before = columns.copy()
    largest = np.abs(wanted).max(initial=0.0)
    assert np.allclose(filtered(numerator, denominator, columns), wanted, rtol=0.0, atol=1e-12 * largest)
    assert np.array_equal(columns, before)


def test_integers_are_numbers_too():
    assert np.allclose(filtered(*LAG, np.arange(5)), lfilter(*LAG, np.arange(5.0)))


def test_a_steady_push_comes_out_of_a_lag_as_it_is():
    assert filtered(*LAG, np.ones(500))[-1] == pytest.approx(1.0)
