"""Standard errors from scores that resemble each other, against the textbook case where they are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from kempf.pipeline.estimate.uncertainty import from_information, sandwich


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.9])
def test_the_mean_of_an_autoregressive_series(correlation: float) -> None:
    n, ratios = 4000, []
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal(n + 200)
        y = lfilter([np.sqrt(1 - correlation**2)], [1.0, -correlation], noise)[200:]
        # the score of the mean, taken for independent values of variance 1: y - mean; information n
        scores = (y - y.mean())[:, None]
        found = sandwich(np.array([[1.0 / n]]), scores, np.arange(n, dtype=float))
        ratios.append(found[0, 0] * n)
    # the variance of the mean is larger by (1 + rho) / (1 - rho)
    expected = (1.0 + correlation) / (1.0 - correlation)
    assert np.mean(ratios) == pytest.approx(expected, rel=0.12)


def test_what_is_not_free_stays_unknown() -> None:
    information = np.diag([4.0, 0.0, 9.0])
    known = from_information(information, np.array([0, 2]))
    np.testing.assert_allclose(np.diag(known.covariance)[[0, 2]], [0.25, 1.0 / 9.0])
    assert np.isnan(known.covariance[1]).all() and np.isnan(known.covariance[:, 1]).all()
    wide = sandwich(known.covariance, np.random.default_rng(0).standard_normal((100, 3)), np.arange(100.0))
    assert np.isnan(wide[1]).all() and np.isfinite(wide[0, 0])


def test_a_weak_direction_is_named_and_a_singular_one_has_no_covariance() -> None:
    nearly = np.array([[1.0, 1.0 - 1e-6], [1.0 - 1e-6, 1.0]])
    known = from_information(nearly, np.arange(2))
    assert len(known.weak) == 1
    np.testing.assert_allclose(np.abs(known.weak[0][1]), np.sqrt([0.5, 0.5]))
    assert np.isnan(from_information(np.ones((2, 2)), np.arange(2)).covariance).all()
    assert known.condition == pytest.approx(2e6, rel=1e-3)
