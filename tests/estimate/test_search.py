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
