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
    """The same, a hundred times as high, with a fall to nothing before its top is reached."""

    asked = 0

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        self.asked += 1
        value, score, information = super().full(theta)
        return 100.0 * value - 1e6 * (theta[0] > -1.5), 100.0 * score, 100.0 * information


def test_a_climb_that_a_cliff_holds_up_is_given_up() -> None:
    cliff = Cliff()
    found = climb(cliff, np.array([-2.0, 0.5, -2.0, -1.5, 0.3, 2.0]), 200, 1e-8)
    assert not found.converged and "next to nothing" in found.reason
    assert found.theta[0] < -1.5 and found.log_likelihood > -50.0
    # 200 iterations of five tries each, without that
    assert cliff.asked < 100
