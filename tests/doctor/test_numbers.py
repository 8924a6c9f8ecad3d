"""The numbers behind the checks against oracles: normal equations, known lags, the joint Gaussian."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.doctor.align import align
from kempf.pipeline.channels.doctor.robust_regression import fit, posterior
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS


def test_fit_is_least_squares_where_nothing_is_wild_and_forgets_what_is() -> None:
    random = np.random.Generator(np.random.PCG64(2))
    columns = np.column_stack([random.standard_normal(400), np.ones(400)])
    observed = columns @ [2.0, -1.0] + 0.1 * random.uniform(-1.0, 1.0, 400)
    found = fit(columns, observed)
    assert found is not None
    assert found.value == pytest.approx(np.linalg.lstsq(columns, observed, rcond=None)[0], abs=2e-3)
    assert np.all(np.abs(found.value - [2.0, -1.0]) < 4.0 * found.std)
    observed[:40] += 50.0
    wild = fit(columns, observed)
    assert wild is not None
    assert wild.value == pytest.approx([2.0, -1.0], abs=0.05)
    assert fit(columns[:7], observed[:7]) is None


def test_posterior_is_the_joint_gaussians() -> None:
    random = np.random.Generator(np.random.PCG64(3))
    A, noise, prior = random.standard_normal((5, 2)), np.full(5, 0.5), np.array([0.3, np.inf])
    y = A @ [0.1, 2.0] + 0.05 * random.standard_normal(5)
    precision = A.T @ A / 0.25 + np.diag([1 / 0.09, 0.0])
    found = posterior(A, y, noise, prior)
    assert found.value == pytest.approx(np.linalg.solve(precision, A.T @ y / 0.25))
    assert found.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(precision))))


@pytest.mark.parametrize(
    ("lag_s", "rate", "slope"), [(0.0, 0.0, 1.0), (7.3, 0.0, 1.0), (-3.2, 0.0, -2.0), (0.0, 8e-3, 1.0)]
)
def test_align_finds_lag_growth_and_slope(lag_s: float, rate: float, slope: float) -> None:
    t = np.arange(0.0, 1500.0, 0.5)

    def motion(at: np.ndarray) -> np.ndarray:
        return (
            np.sin(2 * np.pi * at / 90.0) + 0.5 * np.sin(2 * np.pi * at / 41.0) + 0.6 * np.sin(2 * np.pi * at / 523.0)
        )

    random = np.random.Generator(np.random.PCG64(4))
    first = Series(np.rint(t * SECOND_NS).astype(np.int64), motion(t) + 1e-3 * random.standard_normal(t.size))
    stamps = t + lag_s + rate * (t - 750.0)
    noisy = slope * motion(t) + 1e-3 * random.standard_normal(t.size)
    second = Series(np.rint(stamps * SECOND_NS).astype(np.int64), noisy)
    found = align(first, second)
    assert found is not None
    assert found.slope == pytest.approx(slope, abs=0.02)
    assert found.lag_s == pytest.approx(lag_s, abs=0.1)
    assert found.rate == pytest.approx(rate, abs=2e-4)
    assert found.left_over < 0.05
