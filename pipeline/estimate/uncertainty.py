"""Standard errors: from the expected information, and from what the prediction errors really did.

Where a model lacks something, its prediction errors are not independent and the information promises too much. The
sandwich covariance J^-1 S J^-1 takes S, the covariance of the score, from the data: from sums over stretches of time
long enough to be independent of each other. References: White (1982), "Maximum likelihood estimation of misspecified
models", Econometrica 50; Carlstein (1986), "The use of subseries values", Annals of Statistics 14.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float

#: stretches of time that the scores are summed over: as many are needed to tell a spread, as few leave them long
STRETCHES = 24
_SINGULAR = 1e-12
_WEAK = 1e-4


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """What is known of the errors of an estimate."""

    #: Shape (n_theta, n_theta). Inverse of the information; NaN for elements that are not free, and everywhere where it
    #: is singular.
    covariance: Float
    #: Shape (n_free,). Of the information scaled to a unit diagonal, ascending.
    eigenvalues: Float
    #: Eigenvalue and direction of what the data hardly determine.
    weak: tuple[tuple[float, Float], ...]

    @property
    def condition(self) -> float:
        """Of the scaled information."""
        return float(self.eigenvalues[-1] / max(self.eigenvalues[0], 1e-300))


def from_information(information: Float, index: NDArray[np.intp]) -> Uncertainty:
    """Invert the information of the free parameters.

    Parameters
    ----------
    information : ndarray, shape (n_theta, n_theta)
    index : ndarray of int, shape (n_free,)
        Elements that are free.
    """
    block = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    correlation = block / np.outer(scale, scale)
    eigenvalues, directions = np.linalg.eigh(correlation)
    covariance = np.full(information.shape, np.nan)
    if eigenvalues[0] > _SINGULAR:
        covariance[np.ix_(index, index)] = np.linalg.inv(correlation) / np.outer(scale, scale)
    weak = tuple((float(e), d) for e, d in zip(eigenvalues, directions.T, strict=True) if e < _WEAK)
    return Uncertainty(covariance, eigenvalues, weak)


def sandwich(covariance: Float, scores: Float, time_s: Float, stretches: int = STRETCHES) -> Float:
    """Return J^-1 S J^-1.

    Parameters
    ----------
    covariance : ndarray, shape (n_theta, n_theta)
        J^-1, NaN where not free.
    scores : ndarray, shape (n, n_theta)
        Score of each instant.
    time_s : ndarray, shape (n,)
        Instants, rising.
    stretches : int, optional
        Stretches of equal duration.

    Returns
    -------
    ndarray, shape (n_theta, n_theta)
        NaN where ``covariance`` is.
    """
    edges = np.linspace(time_s[0], time_s[-1], stretches + 1)[1:-1]
    number = np.searchsorted(edges, time_s, side="right")
    sums = np.zeros((stretches, scores.shape[1]))
    np.add.at(sums, number, scores)
    # at the maximum the scores add up to nothing, which takes one degree of freedom from the stretches
    sums -= sums.mean(axis=0)
    S = sums.T @ sums * stretches / (stretches - 1)
    filled = np.nan_to_num(covariance)
    result: Float = np.where(np.isnan(covariance), np.nan, filled @ S @ filled)
    return result
