"""Probabilities and quantiles are those of scipy.stats."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from kempf.pipeline import distributions

ENDS = np.array([0.025, 0.5, 0.975])


@pytest.mark.parametrize("freedom", [1, 2, 7, 300])
@pytest.mark.parametrize("square", [-1e-9, 0.0, 0.3, 5.0, 50.0, 900.0])
def test_chi_square(square, freedom):
    assert distributions.chi2_tail(square, freedom) == stats.chi2.sf(square, freedom)
    wanted = stats.chi2.logsf(square, freedom)
    assert distributions.chi2_log_tail(square, freedom) == pytest.approx(wanted, rel=1e-9, abs=1e-15)
    assert np.array_equal(distributions.chi2_quantile(ENDS, freedom), stats.chi2.ppf(ENDS, freedom))


def test_what_is_too_small_for_a_number_has_no_logarithm_and_no_number_stays_none():
    assert distributions.chi2_log_tail(5000.0, 2) == -np.inf
    assert np.isnan(distributions.chi2_tail(float("nan"), 2))
    assert np.isnan(distributions.chi2_tail(2.0, 0)) and np.isnan(distributions.chi2_log_tail(2.0, 0))


def test_normal():
    assert np.array_equal(distributions.normal_quantile(ENDS), stats.norm.ppf(ENDS))
    assert np.array_equal(distributions.normal_up_to(ENDS), stats.norm.cdf(ENDS))


@pytest.mark.parametrize(("successes", "trials"), [(0, 12), (9, 12), (12, 12)])
def test_binomial(successes, trials):
    wanted = stats.binom.cdf(successes, trials, 0.95)
    assert distributions.binomial_up_to(successes, trials, 0.95) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("share", [-1e-12, 0.0, 0.2, 1.0, 1.0 + 1e-12])
def test_beta(share):
    assert distributions.beta_tail(share, 11, 70) == pytest.approx(stats.beta.sf(share, 11, 70), rel=1e-12)
    assert distributions.beta_quantile(ENDS, 11, 70) == pytest.approx(stats.beta.ppf(ENDS, 11, 70), rel=1e-12)
