"""Robust statistics: quantiles, and Huber's regression with standard errors that allow for correlated residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.robust_std import MAD_TO_STD
from kempf.pipeline.channels.series import Float

#: Huber's limit in robust standard deviations: 95 % as efficient as least squares on Gaussian noise.
_HUBER = 1.345
_ROUNDS = 12
#: Change of the scaled coefficients, as a share of the residuals' spread, that ends the rounds.
_SETTLED = 1e-3
#: Lags, in rows, over which the correlation of the residuals is summed.
_LAGS = 30


@dataclass(frozen=True, eq=False)
class RobustLine:
    """Coefficients of a linear fit."""

    #: value, std: Shape (n_columns,). Coefficients and their standard errors.
    value: Float
    std: Float
    #: Size of the residuals over that of the observations.
    left_over: float


def quantile(values: Float, share: float) -> float:
    """Return the value below which a share of some values lie, not interpolated: these are asked for often."""
    place = round(share * (values.size - 1))
    return float(np.partition(values, place)[place])


def reach(values: Float) -> float:
    """Return how far values range, one in a hundred at either end left out."""
    low, high = round(0.01 * (values.size - 1)), round(0.99 * (values.size - 1))
    ordered = np.partition(values, (low, high))
    return float(ordered[high] - ordered[low])


def fit(columns: Float, observed: Float) -> RobustLine | None:
    """Fit observations by columns, Huber's way.

    Parameters
    ----------
    columns : ndarray, shape (n, n_columns)
    observed : ndarray, shape (n,)
        Rows that hold a NaN are left out.

    Returns
    -------
    RobustLine or None
        None for fewer rows than four a column.

    References
    ----------
    Huber (1964), "Robust estimation of a location parameter", Annals of Mathematical Statistics 35. Newey and West
    (1987), Econometrica 55: standard errors under correlated residuals.
    """
    good = np.isfinite(observed) & np.all(np.isfinite(columns), axis=1)
    A, y = columns[good], observed[good]
    if y.size < 4 * A.shape[1]:
        return None
    weight = np.ones(y.size)
    value, scale = np.zeros(A.shape[1]), 0.0
    unit = np.maximum(np.sqrt(np.mean(A**2, axis=0)), 1e-300)
    A = A / unit
    for _ in range(_ROUNDS):
        last = value
        normal = (A * weight[:, None]).T @ A
        value = np.linalg.lstsq(normal, (A * weight[:, None]).T @ y, rcond=1e-12)[0]
        residual = y - A @ value
        scale = _spread(residual)
        if not scale > 0.0 or np.max(np.abs(value - last)) < _SETTLED * scale:
            break
        weight = np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(residual), 1e-300))
    residual = y - A @ value
    inverse = np.linalg.pinv((A * weight[:, None]).T @ A, hermitian=True)
    covariance = inverse @ _summed_products(A * (weight * residual)[:, None], min(_LAGS, y.size // 4)) @ inverse
    # the sum of correlated products can be small by chance; what white residuals give is the least
    least = np.diag(inverse) * scale**2
    spread = float(np.sqrt(np.mean(y**2)))
    left = float(np.sqrt(np.average(residual**2, weights=weight))) / spread if spread > 0.0 else 1.0
    return RobustLine(value / unit, np.sqrt(np.maximum(np.diag(covariance), least)) / unit, left)


def _spread(residual: Float) -> float:
    """Return the standard deviation of Gaussian residuals, from their median size."""
    return MAD_TO_STD * quantile(np.abs(residual), 0.5)


def _summed_products(score: Float, lags: int) -> Float:
    """Return Newey and West's sum over lags with Bartlett's weights: products of running sums over lags + 1 rows."""
    padded = np.zeros((score.shape[0] + 2 * lags + 1, score.shape[1]))
    padded[lags + 1 : lags + 1 + score.shape[0]] = score
    total = np.cumsum(padded, axis=0)
    running = total[lags + 1 :] - total[: -lags - 1]
    summed: Float = running.T @ running / (lags + 1.0)
    return summed


def posterior(columns: Float, observed: Float, noise_std: Float, prior_std: Float) -> RobustLine:
    """Fit few observations whose error is known, with what is known of the coefficients beforehand.

    Parameters
    ----------
    columns : ndarray, shape (n, n_columns)
    observed : ndarray, shape (n,)
    noise_std : ndarray, shape (n,)
        Of each observation; where the residuals are larger, all are larger in the same ratio.
    prior_std : ndarray, shape (n_columns,)
        Standard deviation about nought that is known of each coefficient; infinite for nothing.
    """
    value: Float = np.zeros(columns.shape[1])
    more = 1.0
    weight = np.ones(observed.size)
    A, y, prior = columns / noise_std[:, None], observed / noise_std, np.diag(prior_std**-2.0)
    for _ in range(_ROUNDS):
        last = value
        weighted = (A * (weight / more**2)[:, None]).T
        precision = weighted @ A + prior
        value = np.asarray(np.linalg.lstsq(precision, weighted @ y, rcond=1e-15)[0], dtype=np.float64)
        if np.max(np.abs(value - last)) < _SETTLED * np.max(np.abs(value)):
            break
        residual = y - A @ value
        more = max(1.0, _spread(residual))
        weight = np.minimum(1.0, _HUBER * more / np.maximum(np.abs(residual), 1e-300))
    covariance = np.linalg.pinv(precision, hermitian=True)
    spread = float(np.sqrt(np.mean(observed**2)))
    left = float(np.sqrt(np.average((observed - columns @ value) ** 2, weights=weight))) / max(spread, 1e-300)
    return RobustLine(value, np.sqrt(np.maximum(np.diag(covariance), 0.0)), left)
