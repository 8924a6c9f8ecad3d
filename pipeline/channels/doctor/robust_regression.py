"""A straight fit that a few wild values do not bend, with standard errors that own up to correlated residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float

#: Huber's limit in robust standard deviations: 95 % as efficient as least squares on Gaussian noise.
_HUBER = 1.345
_ROUNDS = 12
#: Lags, in rows, over which the correlation of the residuals is summed.
_LAGS = 30


@dataclass(frozen=True, eq=False)
class Fit:
    """Coefficients of a linear fit.

    Attributes
    ----------
    value, std : ndarray, shape (n_columns,)
        Coefficients and their standard errors.
    left_over : float
        Size of the residuals over that of the observations.
    """

    value: Float
    std: Float
    left_over: float


def fit(columns: Float, observed: Float) -> Fit | None:
    """Fit observations by columns, Huber's way.

    Parameters
    ----------
    columns : ndarray, shape (n, n_columns)
    observed : ndarray, shape (n,)
        Rows that hold a NaN are left out.

    Returns
    -------
    Fit or None
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
        normal = (A * weight[:, None]).T @ A
        value = np.linalg.lstsq(normal, (A * weight[:, None]).T @ y, rcond=1e-12)[0]
        residual = y - A @ value
        scale = 1.4826 * float(np.median(np.abs(residual)))
        if not scale > 0.0:
            break
        weight = np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(residual), 1e-300))
    residual = y - A @ value
    inverse = np.linalg.pinv((A * weight[:, None]).T @ A, hermitian=True)
    score = A * (weight * residual)[:, None]
    meat = score.T @ score
    for lag in range(1, min(_LAGS, y.size // 4) + 1):
        step = score[lag:].T @ score[:-lag]
        meat += (1.0 - lag / (_LAGS + 1.0)) * (step + step.T)
    covariance = inverse @ meat @ inverse
    # Newey and West's sum can fall below nought by chance; what white residuals give is the least
    least = np.diag(inverse) * scale**2
    spread = float(np.sqrt(np.mean(y**2)))
    left = float(np.sqrt(np.average(residual**2, weights=weight))) / spread if spread > 0.0 else 1.0
    return Fit(value / unit, np.sqrt(np.maximum(np.diag(covariance), least)) / unit, left)


def posterior(columns: Float, observed: Float, noise_std: Float, prior_std: Float) -> Fit:
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
    covariance: Float = np.eye(columns.shape[1])
    more = 1.0
    weight = np.ones(observed.size)
    A, y = columns / noise_std[:, None], observed / noise_std
    for _ in range(_ROUNDS):
        precision: Float = (A * (weight / more**2)[:, None]).T @ A + np.diag(prior_std**-2.0)
        covariance = np.asarray(np.linalg.pinv(precision, hermitian=True), dtype=np.float64)
        value = covariance @ ((A * (weight / more**2)[:, None]).T @ y)
        residual = y - A @ value
        more = max(1.0, 1.4826 * float(np.median(np.abs(residual))))
        weight = np.minimum(1.0, _HUBER * more / np.maximum(np.abs(residual), 1e-300))
    spread = float(np.sqrt(np.mean(observed**2)))
    left = float(np.sqrt(np.average((observed - columns @ value) ** 2, weights=weight))) / max(spread, 1e-300)
    return Fit(value, np.sqrt(np.maximum(np.diag(covariance), 0.0)), left)
