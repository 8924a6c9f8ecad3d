"""Pooling against closed forms and against the distribution that Cochran's Q has."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from kempf.pipeline.history.pooled import pool
from kempf.schemas.errors import DataRejected
from tests.history.made import TRUTH, history, relative_covariance


def test_one_parameter_is_the_textbook() -> None:
    y, s = np.array([1.0, 2.0, 4.0]), np.array([0.5, 1.0, 2.0])
    w = 1.0 / s**2
    found = pool(y[:, None], (s**2)[:, None, None])
    mean = np.sum(w * y) / np.sum(w)
    assert found.value[0] == pytest.approx(mean)
    assert found.covariance[0, 0] == pytest.approx(1.0 / np.sum(w))
    assert found.q == pytest.approx(np.sum(w * (y - mean) ** 2))
    assert (found.dof, found.p_value) == (2, pytest.approx(stats.chi2.sf(found.q, 2)))
    assert found.scale == pytest.approx(np.sqrt(found.q / 2))


def test_two_vectors_are_the_wald_test() -> None:
    h = history(2)
    found = pool(h.value, h.covariance)
    gap = h.value[1] - h.value[0]
    wald = gap @ np.linalg.inv(h.covariance.sum(axis=0)) @ gap
    assert found.q == pytest.approx(wald, rel=1e-6)
    assert found.dof == 6
    # leaving one of two out is the same test, counted twice
    assert found.set_p_value == pytest.approx(np.full(2, min(1.0, 2 * stats.chi2.sf(wald, 6))), rel=1e-5)


def test_q_is_chi_squared_where_the_covariances_are_true() -> None:
    p = [pool(h.value, h.covariance).p_value for h in (history(5, scatter=0.0, seed=k) for k in range(300))]
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_the_mean_is_as_good_as_it_says() -> None:
    means = [pool(h.value, h.covariance) for h in (history(4, scatter=0.0, seed=k) for k in range(300))]
    z2 = [(m.value - TRUTH) @ np.linalg.solve(m.covariance, m.value - TRUTH) for m in means]
    assert stats.kstest(z2, stats.chi2(6).cdf).pvalue > 0.01


def test_trials_that_repeat_worse_than_they_say_are_not_one() -> None:
    h = history(8, scatter=0.03)
    found = pool(h.value, h.covariance)
    assert found.poolable() is False
    assert found.scale > 3
    agreeing = history(8, scatter=0.0)
    assert pool(agreeing.value, agreeing.covariance).poolable() is True


def test_the_set_that_disagrees_is_named() -> None:
    h = history(6, scatter=0.0)
    h.value[4, 5] *= 1.05
    found = pool(h.value, h.covariance)
    assert int(np.argmin(found.set_p_value)) == 4
    assert found.set_p_value[4] < 0.01


def test_one_set_is_itself_and_none_is_refused() -> None:
    h = history(1)
    found = pool(h.value, h.covariance)
    assert found.value == pytest.approx(h.value[0])
    assert found.covariance == pytest.approx(h.covariance[0], rel=1e-6)
    assert found.poolable() is None
    for value, covariance in (
        (np.empty((0, 6)), np.empty((0, 6, 6))),
        (h.value, np.full((1, 6, 6), np.nan)),
        (h.value, -relative_covariance()[None]),
    ):
        with pytest.raises(DataRejected) as caught:
            pool(value, covariance)
        assert caught.value.code == "nothing_to_pool"
