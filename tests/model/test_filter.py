"""The filter (3)-(5) against the joint normal density and against the equations as they are printed."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from kempf.pipeline.estimate.filters.kalman_filter import run_filter

Float = NDArray[np.float64]


class System:
    """A random stable system with a record drawn from it."""

    def __init__(self, seed: int, *, n: int = 15, with_gaps: bool = False) -> None:
        random = np.random.default_rng(seed)
        self.A = 0.4 * random.standard_normal((4, 4))
        self.B = random.standard_normal((4, 1))
        self.G = random.standard_normal((4, 2))
        self.H = np.array([[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]])
        self.R = np.diag([0.3, 0.2])
        self.u = random.standard_normal((n, 1))
        self.Y = random.standard_normal((n, 2))
        if with_gaps:
            self.Y[[3, 4, 9]] = np.nan
            self.Y[6, 1] = np.nan
        self.x0 = random.standard_normal(4)
        root = random.standard_normal((4, 4))
        self.P0 = root @ root.T

    def arguments(self) -> tuple[Float, ...]:
        return self.A, self.B, self.G, self.H, self.R, self.Y, self.u, self.x0, self.P0

    def conditional_mean(self, k: int, *, until: int) -> Float:
        """E[x_k | Y_0 .. Y_{until-1}] by inversion of the joint covariance; rows with a NaN left out."""
        means, cov = [self.x0], {(0, 0): self.P0}
        for i in range(1, k + 1):
            means.append(self.A @ means[-1] + self.B @ self.u[i - 1])
            for j in range(i):
                cov[i, j] = self.A @ cov[i - 1, j]
                cov[j, i] = cov[i, j].T
            cov[i, i] = self.A @ cov[i - 1, i - 1] @ self.A.T + self.G @ self.G.T
        rows = [i for i in range(until) if np.all(np.isfinite(self.Y[i]))]
        if not rows:
            return means[k]
        C = np.block([[self.H @ cov[i, j] @ self.H.T + (self.R if i == j else 0.0) for j in rows] for i in rows])
        cross = np.hstack([cov[k, i] @ self.H.T for i in rows])
        error = np.concatenate([self.Y[i] - self.H @ means[i] for i in rows])
        result: Float = means[k] + cross @ np.linalg.solve(C, error)
        return result


@pytest.mark.parametrize("with_gaps", [False, True])
def test_predictions_and_updates_are_conditional_means(with_gaps: bool) -> None:
    system = System(3, with_gaps=with_gaps)
    found = run_filter(*system.arguments())
    for k in range(15):
        np.testing.assert_allclose(found.predicted[k], system.conditional_mean(k, until=k), rtol=1e-8, atol=1e-10)
        np.testing.assert_allclose(found.updated[k], system.conditional_mean(k, until=k + 1), rtol=1e-8, atol=1e-10)


def test_the_equations_as_printed() -> None:
    s = System(5)
    found = run_filter(*s.arguments())
    x, P = s.x0, s.P0
    for k in range(15):
        np.testing.assert_allclose(found.predicted[k], x, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found.innovation[k], s.Y[k] - s.H @ x, rtol=1e-9, atol=1e-12)
        S = np.linalg.inv(s.H @ P @ s.H.T + s.R)
        K = s.A @ P @ s.H.T @ S
        x = s.A @ x + s.B @ s.u[k] + K @ (s.Y[k] - s.H @ x)
        P = s.A @ P @ s.A.T + s.G @ s.G.T - s.A @ P @ s.H.T @ S @ s.H @ P @ s.A.T


def test_a_row_with_a_nan_is_bridged_and_arguments_are_left_alone() -> None:
    system = System(7, with_gaps=True)
    before = [a.copy() for a in system.arguments()]
    found = run_filter(*system.arguments())
    for k in (3, 4, 6, 9):
        assert np.all(np.isnan(found.innovation[k]))
        np.testing.assert_array_equal(found.predicted[k], found.updated[k])
    assert np.all(np.isfinite(found.updated))
    for old, new in zip(before, system.arguments(), strict=True):
        np.testing.assert_array_equal(old, new)
    np.testing.assert_array_equal(run_filter(*system.arguments()).updated, found.updated)
