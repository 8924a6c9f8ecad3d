"""The climb where a parameter begins at nothing."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.search.climb import climb

TOP = np.array([-1.0, 0.5, -2.0, -1.5, 0.3, 2.0])


class Hill:
    """A parabola over the six hull parameters."""

    active, logarithms = np.ones(6, dtype=np.bool_), np.zeros(6, dtype=np.bool_)
    low, high = np.full(6, -np.inf), np.full(6, np.inf)

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        away = theta - TOP
        return float(-0.5 * away @ away), -away, np.eye(6)

    def room(self, theta: Float, *, far: bool) -> tuple[Float, Float]:
        return self.low, self.high


def test_a_parameter_that_begins_at_nothing_may_leave_it() -> None:
    start = TOP.copy()
    start[4] = 0.0
    found = climb(Hill(), start, 200, 1e-8)
    # warnings are errors here: there is no reach to divide by
    assert found.converged
    np.testing.assert_allclose(found.theta, TOP, atol=1e-3)


class Cliff(Hill):
    """The same parabola, but that there is no likelihood where the first two parameters together exceed -2."""

    def __init__(self) -> None:
        self.asked = 0

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        self.asked += 1
        value, score, information = super().full(theta)
        return value if theta[0] + theta[1] < -2.0 else -np.inf, score, information


def test_a_climb_that_comes_to_where_the_likelihood_ends_says_so_soon() -> None:
    cliff = Cliff()
    found = climb(cliff, np.array([-3.0, -1.0, -1.0, -1.0, 1.0, 1.0]), 200, 1e-8)
    assert not found.converged and found.reason == "it still rises where the likelihood ends"
    assert -2.01 < found.theta[0] + found.theta[1] < -2.0 and cliff.asked < 100
