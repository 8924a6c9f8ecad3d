"""Tail probabilities and quantiles of the distributions that tests go by.

`scipy.stats` has them too, and takes longer to import than half of the commands take to answer; these are of
`scipy.special`, and equal to it within rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, betaincc, betaincinv, chdtrc, gammaincinv, ndtr, ndtri

Float = NDArray[np.float64]

__all__ = [
    "beta_quantile",
    "beta_tail",
    "binomial_up_to",
    "chi2_log_tail",
    "chi2_quantile",
    "chi2_tail",
    "normal_quantile",
    "normal_up_to",
]


def chi2_tail(square: float, degrees_of_freedom: float) -> float:
    """Return the probability that chi-square exceeds a value; NaN without degrees of freedom."""
    if not degrees_of_freedom > 0:
        return float("nan")
    return float(chdtrc(degrees_of_freedom, max(square, 0.0)))


def chi2_log_tail(square: float, degrees_of_freedom: float) -> float:
    """Return the logarithm of `chi2_tail`; minus infinity where that is too small for a number."""
    with np.errstate(divide="ignore"):
        return float(np.log(chi2_tail(square, degrees_of_freedom)))


def chi2_quantile(probability: Float, degrees_of_freedom: float) -> Float:
    """Return the values that chi-square stays below with some probabilities, shape (n,)."""
    return 2.0 * np.asarray(gammaincinv(0.5 * degrees_of_freedom, probability))


def normal_up_to(value: Float | float) -> Float:
    """Return the probabilities that a standard normal number is at most some values, shape (n,)."""
    return np.asarray(ndtr(value))


def normal_quantile(probability: Float | float) -> Float:
    """Return the values that a standard normal number stays below with some probabilities, shape (n,)."""
    return np.asarray(ndtri(probability))


def binomial_up_to(successes: int, trials: int, probability: float) -> float:
    """Return the probability of so many successes or fewer."""
    return float(bdtr(float(successes), trials, probability))


def beta_quantile(probability: Float, a: float, b: float) -> Float:
    """Return the shares that a beta distributed one stays below with some probabilities, shape (n,)."""
    return np.asarray(betaincinv(a, b, probability))


def beta_tail(share: float, a: float, b: float) -> float:
    """Return the probability that a beta distributed share exceeds a value."""
    # a share of all is one but for its rounding
    return float(betaincc(a, b, min(max(share, 0.0), 1.0)))
