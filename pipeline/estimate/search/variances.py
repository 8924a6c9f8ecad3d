"""Variances for logarithms of noise levels: the coordinates in which the likelihood of a pool is climbed.

Near nothing a log-likelihood is a parabola of a disturbance's variance, and flat in its logarithm: a level that rises
from nothing, or sinks to it, takes one step by its variance and a dozen by its logarithm. The variance of a
measurement is found in one step of Fisher scoring from anywhere (Harvey 1990, Forecasting, Structural Time Series
Models and the Kalman Filter, sect. 4.5).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.estimate.search.block_arrow import Arrow, ArrowSteps
from kempf.pipeline.estimate.search.climb import Pass, Search, climb_by, nobody
from kempf.schemas.model_spec import N_HULL

#: share of itself by which a variance falls at most in a step far from the top: of several that are too large together
#: the quadratic model says that each is nothing
_SHARE = 1.0 - float(np.exp(-2.0))


class Pool(Protocol):
    """A log-likelihood of several runs; theta begins with the six hull parameters, then effects."""

    #: Shape (n_theta,) each. What may move; logarithms of noise levels; bounds.
    active: Mask
    logarithms: Mask
    low: Float
    high: Float

    def full(self, theta: Float) -> tuple[float, Float, Arrow]:
        """Log-likelihood, score and expected information."""


def climb_in_variances(
    pool: Pool,
    start: Float,
    max_iterations: int,
    decrement: float,
    wanted: float = -np.inf,
    report: Callable[[Pass], None] = nobody,
) -> Search[Arrow]:
    """Climb from one start; see `kempf.pipeline.estimate.search.climb.climb_by`. All that is given is by logarithms.

    Parameters
    ----------
    start : ndarray, shape (n_theta,)
    """
    inside = _InVariances(pool)

    def by_logarithms(step: Pass) -> Pass:
        return replace(step, theta=inside.logarithms_of(step.theta))

    search = climb_by(
        ArrowSteps(),
        inside,
        inside.variances(start),
        max_iterations,
        decrement,
        wanted,
        lambda step: report(by_logarithms(step)),
    )
    factors = 1.0 / inside.factors(search.theta)
    return replace(
        search,
        theta=inside.logarithms_of(search.theta),
        score=search.score * factors,
        information=search.information.scaled(factors),
        passes=tuple(by_logarithms(step) for step in search.passes),
    )


class _InVariances:
    """The objective."""

    def __init__(self, pool: Pool) -> None:
        self._pool, self.active = pool, pool.active
        # a level that the data do not have stays the logarithm that it is
        self._levels: Mask = pool.logarithms & pool.active
        self._effects: Mask = ~pool.logarithms & (np.arange(pool.logarithms.size) >= N_HULL)
        self.logarithms: Mask = np.zeros_like(self._levels)
        self.low, self.high = self.variances(pool.low), self.variances(pool.high)

    def variances(self, theta: Float) -> Float:
        """Return theta with variances for logarithms."""
        moved = theta.copy()
        moved[self._levels] = np.exp(2.0 * theta[self._levels])
        return moved

    def logarithms_of(self, moved: Float) -> Float:
        """Return theta with logarithms again, exactly at its bounds where it has ended at them."""
        theta = moved.copy()
        theta[self._levels] = 0.5 * np.log(moved[self._levels])
        theta = np.where(moved <= self.low, self._pool.low, theta)
        return np.where(moved >= self.high, self._pool.high, theta)

    def factors(self, moved: Float) -> Float:
        """Return the derivatives of the logarithms by the variances, 1 for the rest, shape (n_theta,)."""
        factors = np.ones(moved.size)
        factors[self._levels] = 0.5 / moved[self._levels]
        return factors

    def full(self, moved: Float) -> tuple[float, Float, Arrow]:
        """Log-likelihood, score and expected information by variances."""
        value, score, information = self._pool.full(self.logarithms_of(moved))
        factors = self.factors(moved)
        return value, score * factors, information.scaled(factors)

    def room(self, theta: Float, *, far: bool) -> tuple[Float, Float]:
        """Return the way to the bounds, and no more than one unit for an effect."""
        down, up = self.low - theta, self.high - theta
        down[self._effects] = np.maximum(down[self._effects], -1.0)
        up[self._effects] = np.minimum(up[self._effects], 1.0)
        if far:
            down[self._levels] = np.maximum(down[self._levels], -_SHARE * theta[self._levels])
        return down, up
