"""The statistics of change against least squares written out, and the scatter against what was put in."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.history.contrasts import axes, directions, scatter, statistics
from tests.history.made import relative_covariance


def test_the_largest_step_is_the_two_sample_t_test_where_all_sets_weigh_the_same() -> None:
    # neighbours far apart, so that the scatter is measured round the means; too few sets for windows
    z = np.random.default_rng(1).standard_normal((7, 2)) + 2.0 * (-1.0) ** np.arange(7)[:, None]
    found = statistics(z, np.full((7, 2), 1e-12), np.arange(7.0), 2, 0.0)
    for k in range(2, 6):
        for c in range(2):
            one, other = z[:k, c], z[k:, c]
            pooled = (np.sum((one - one.mean()) ** 2) + np.sum((other - other.mean()) ** 2)) / 5
            t2 = (other.mean() - one.mean()) ** 2 / pooled / (1 / k + 1 / (7 - k))
            assert found.step[k - 2, c] == pytest.approx(t2, rel=1e-9)


def test_the_drift_is_the_t_test_of_a_slope() -> None:
    random = np.random.default_rng(2)
    z, t = random.standard_normal((12, 1)) + 2.0 * (-1.0) ** np.arange(12)[:, None], np.sort(random.uniform(0, 5, 12))
    found = statistics(z, np.full((12, 1), 1e-12), t, 2, 0.0)
    from scipy.stats import linregress

    line = linregress(t, z[:, 0])
    assert found.drift[0] == pytest.approx((line.slope / line.stderr) ** 2, rel=1e-9)


def test_without_scatter_known_variances_tend_to_the_likelihood_ratio() -> None:
    s2 = np.random.default_rng(3).uniform(0.5, 2.0, (10, 1))
    z = np.zeros((10, 1))
    z[4:] = 0.1  # too little to look like scatter
    found = statistics(z, s2, np.arange(10.0), 2, 1e9)
    w = 1 / s2[:, 0]
    ratio = 0.01 / (1 / w[:4].sum() + 1 / w[4:].sum())
    assert found.step[2, 0] == pytest.approx(ratio, rel=1e-6)
    assert found.scatter[0] == 0.0


@pytest.mark.parametrize("tau", [0.0, 1.0, 4.0])
def test_scatter_is_found_and_a_step_is_not_taken_for_it(tau: float) -> None:
    random = np.random.default_rng(4)
    own = random.uniform(0.5, 2.0, (40, 1))
    z = np.sqrt(own + tau**2) * random.standard_normal((400, 40, 1))
    without, with_step = (scatter(z + jump * (np.arange(40) >= 20)[:, None], own)[:, 0, 0] for jump in (0.0, 8.0))
    whole = np.mean(own) + tau**2
    assert np.mean(without) == pytest.approx(tau**2, abs=0.15 * whole)
    # the step takes the place of the largest difference that is left out, no more: a naive variance would be 16 larger
    assert np.mean(with_step) == pytest.approx(tau**2, abs=0.3 * whole)


def test_directions_are_orthonormal_axes_and_the_parameters() -> None:
    S = np.array([relative_covariance(s) for s in (1.0, 2.0)])
    U = axes(S)
    assert np.allclose(U.T @ U, np.eye(6), atol=1e-12)
    assert np.allclose(U.T @ S[0] @ U, np.diag(np.diag(U.T @ S[0] @ U)), atol=1e-12)
    assert directions(S)[:, 6:] == pytest.approx(np.eye(6))
