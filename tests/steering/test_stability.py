"""The stability verdict against the eigenvalues themselves, draws, and its promised error rate."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.steering.stability import stability
from tests.steering.ships import covariance_of, draws_of, hull_of


def less_stable(share: float) -> Hull:
    """The tanker with her determinant at a share of what it is."""
    p = hull_of("tanker").array()
    determinant = p[0] * p[3] - p[1] * p[2]
    p[3] = (share * determinant + p[1] * p[2]) / p[0]
    return Hull(*p)


@pytest.mark.parametrize("name", HULLS)
def test_real_parts_are_the_eigenvalues(name):
    hull, V = hull_of(name), 5.0
    result = stability(hull, covariance_of(hull), V)
    exact = np.sort(np.real(np.linalg.eigvals(hull.continuous(V)[0])))[::-1]
    assert [v.value for v in result.real_parts] == pytest.approx(exact, rel=1e-9)
    assert result.determinant.value == pytest.approx(hull.a11 * hull.a22 - hull.a12 * hull.a21)


def test_standard_errors_and_probability_are_those_of_draws():
    hull, V = less_stable(0.4), 7.5
    covariance = covariance_of(hull, np.full(6, 0.02))
    result = stability(hull, covariance, V)
    drawn = draws_of(hull, covariance, 20000)
    matrices = drawn[:, :4].reshape(-1, 2, 2) * V
    parts = np.sort(np.real(np.linalg.eigvals(matrices)), axis=1)[:, ::-1]
    assert [v.std for v in result.real_parts] == pytest.approx(np.std(parts, axis=0), rel=0.05)
    assert result.determinant.std == pytest.approx(np.std(np.linalg.det(drawn[:, :4].reshape(-1, 2, 2))), rel=0.03)
    assert result.probability == pytest.approx(np.mean(parts[:, 0] < 0), abs=0.01)


def test_verdicts():
    stable, unstable = hull_of("mariner"), less_stable(-3.0)
    assert stability(stable, covariance_of(stable), 7.7).verdict == "stable"
    assert stability(unstable, covariance_of(unstable), 7.5).verdict == "unstable"
    near = less_stable(0.1)
    result = stability(near, covariance_of(near), 7.5)
    assert result.verdict == "cannot be determined from these data" and "too near to zero" in result.reason
    blind = stability(stable, np.full((6, 6), np.nan), 7.7)
    assert blind.verdict == "cannot be determined from these data" and np.isnan(blind.probability)


def test_a_ship_on_the_border_is_seldom_given_a_verdict():
    # both wrong verdicts together: 10 % at the border itself, as one-sided tests of 95 % have it
    border, n = less_stable(0.0), 1000
    covariance = covariance_of(border, np.full(6, 0.02))
    said = [stability(Hull(*p), covariance, 7.5).verdict for p in draws_of(border, covariance, n, seed=1)]
    for verdict in ("stable", "unstable"):
        assert 0.02 < said.count(verdict) / n < 0.08
