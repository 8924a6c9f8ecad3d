"""The statistics of change: for every direction in parameter space, how far a step or a drift stands out of scatter.

A direction is a parameter by itself or a principal axis of the sets' mean covariance. In each the sets are weighted by
1 / (their variance + the scatter between trials), the scatter being estimated in that very direction. Taking the
largest direction instead of their sum is what keeps the false alarms down whatever the scatter looks like: a load that
moves all six parameters together makes the directions dependent, and dependence makes a maximum smaller, not larger
(Sidak 1967, "Rectangular confidence regions for the means of multivariate normal distributions", JASA 62).

Scatter: DerSimonian and Laird (1986), "Meta-analysis in clinical trials", Controlled Clinical Trials 7, on differences
of neighbours (von Neumann 1941, Annals of Mathematical Statistics 12), so that a change adds to one difference only,
and the largest difference is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from kempf.pipeline.channels.series import Float

_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Statistics:
    """Squared t statistics of histories; leading axes are those of the histories."""

    #: Shape (..., n_split, n_direction). Of a step before set smallest_side, smallest_side + 1, ...
    step: Float
    #: Shape (..., n_direction). Of a straight line in time.
    drift: Float
    #: Shape (..., n_direction). Variance between trials beyond the sets' own.
    scatter: Float

    @property
    def largest_step(self) -> Float:
        """The largest over splits and directions, shape (...)."""
        largest: Float = self.step.max(axis=(-1, -2))
        return largest

    @property
    def largest_drift(self) -> Float:
        """The largest over directions, shape (...)."""
        largest: Float = self.drift.max(axis=-1)
        return largest


def axes(covariance: Float) -> Float:
    """Return the principal axes of the mean covariance as columns, shape (n_parameter, n_parameter).

    Parameters
    ----------
    covariance : ndarray, shape (n_set, n_parameter, n_parameter)
        Relative, so that the parameters can be compared.
    """
    U: Float = np.linalg.eigh(np.mean(covariance, axis=0))[1]
    # the sign of an eigenvector is the library's choice
    leading = U[np.argmax(np.abs(U), axis=0), np.arange(U.shape[1])]
    signed: Float = U * np.sign(leading)
    return signed


def directions(covariance: Float) -> Float:
    """Return the principal axes, then the parameters themselves, as columns, shape (n_parameter, 2 n_parameter)."""
    return np.hstack([axes(covariance), np.eye(covariance.shape[-1])])


def variances(covariance: Float, along: Float) -> Float:
    """Return the variances of the sets along directions, shape (n_set, n_direction)."""
    variance: Float = np.einsum("ac,iab,bc->ic", along, covariance, along)
    return variance


@lru_cache(maxsize=512)
def _kept(count: int) -> float:
    """Return what is expected of ``count`` squared standard normals without the largest of them."""
    from scipy.integrate import quad

    from kempf.pipeline.distributions import chi2_tail

    return count - float(quad(lambda x: 1.0 - (1.0 - chi2_tail(x, 1)) ** count, 0.0, 80.0)[0])


def scatter(z: Float, variance: Float) -> Float:
    """Return the variance between trials in every direction, shape (..., 1, n_direction).

    Parameters
    ----------
    z : ndarray, shape (..., n_set, n_direction)
        Sets along the directions; three sets at least.
    variance : ndarray, shape (n_set, n_direction)
        Their own variances.
    """
    squares, own = np.diff(z, axis=-2) ** 2, variance[1:] + variance[:-1]
    expected = _kept(own.shape[0])
    tau2 = np.zeros((*z.shape[:-2], 1, z.shape[-1]))
    for _ in range(_ROUNDS):
        precision = 1.0 / (own + 2.0 * tau2)
        share = squares * precision
        excess = np.sum(share, axis=-2, keepdims=True) - np.max(share, axis=-2, keepdims=True) - expected
        slope = 2.0 * np.mean(precision, axis=-2, keepdims=True) * (own.shape[0] - 1)
        tau2 = np.maximum(0.0, tau2 + excess / slope)
    return tau2


def _windows(n: int, smallest_side: int) -> list[tuple[int, int]]:
    """Return where a step is looked for: in the whole, and in halves that overlap by half.

    In the whole a load that is taken on and discharged again nearly cancels (Kovacs et al. 2023, "Seeded binary
    segmentation", Biometrika 110).
    """
    half = n // 2
    if half < 2 * smallest_side:
        return [(0, n)]
    return [(0, n), (0, half), ((n - half) // 2, (n - half) // 2 + half), (n - half, n)]


def _steps(W: Float, B: Float, smallest_side: int) -> Float:
    """Return the most that a step at each split takes off the sum of squares, whatever the window.

    Parameters
    ----------
    W, B : ndarray, shape (..., n_set, n_direction)
        Cumulated weights and weighted values.

    Returns
    -------
    ndarray, shape (..., n_split, n_direction)
    """
    n = W.shape[-2]
    gains = np.zeros((*W.shape[:-2], n - 2 * smallest_side + 1, W.shape[-1]))
    for first, last in _windows(n, smallest_side):
        w0, b0 = (x[..., first - 1 : first, :] if first else 0.0 for x in (W, B))
        w, b = (x[..., last - 1 : last, :] - x0 for x, x0 in ((W, w0), (B, b0)))
        inner = slice(first + smallest_side - 1, last - smallest_side)
        before = W[..., inner, :] - w0
        gain = (B[..., inner, :] - b0 - before * (b / w)) ** 2 * w / (before * (w - before))
        place = gains[..., first : last - 2 * smallest_side + 1, :]
        np.maximum(place, gain, out=place)
    return gains


def statistics(z: Float, variance: Float, time: Float, smallest_side: int, prior_dof: float) -> Statistics:
    """Return the squared t statistics of every step and of a drift.

    With weights w = 1 / (variance + scatter), Q0 the weighted sum of squares round the mean and L what a step takes off
    it, t^2 = L / ((prior_dof + Q) / (prior_dof + n - 2)), Q being Q0 - L or what neighbours say, whichever is less: a
    likelihood ratio whose variance is moderated between what the sets say of themselves and how they scatter (Smyth
    2004, Statistical Applications in Genetics 3), and in which a second change does not hide the first.

    Parameters
    ----------
    z : ndarray, shape (..., n_set, n_direction)
        Sets along the directions.
    variance : ndarray, shape (n_set, n_direction)
        Their own variances.
    time : ndarray, shape (n_set,)
        Any unit.
    smallest_side : int
        Sets that must lie on either side of a step.
    prior_dof : float
        How many degrees of freedom the sets' own variances are worth.
    """
    n = z.shape[-2]
    tau2 = scatter(z, variance)
    w = 1.0 / (variance + tau2)
    W, B = np.cumsum(w, axis=-2), np.cumsum(w * z, axis=-2)
    mean = B[..., -1:, :] / W[..., -1:, :]
    Q0 = np.sum(w * (z - mean) ** 2, axis=-2, keepdims=True)
    L = _steps(W, B, smallest_side)
    dof = prior_dof + n - 2
    # what neighbours differ by, another measure of the same scatter: a second change hardly adds to it
    own = variance[1:] + variance[:-1] + 2.0 * tau2
    neighbours = np.sum(np.diff(z, axis=-2) ** 2 / own, axis=-2, keepdims=True) * (n - 2) / (n - 1)
    centred = time[:, None] - np.sum(w * time[:, None], axis=-2, keepdims=True) / W[..., -1:, :]
    D = np.sum(w * centred * z, axis=-2) ** 2 / np.sum(w * centred**2, axis=-2)
    step = L * dof / (prior_dof + np.minimum(Q0 - L, neighbours))
    drift = D * dof / (prior_dof + np.minimum(Q0 - D[..., None, :], neighbours)[..., 0, :])
    return Statistics(step, drift, tau2[..., 0, :])
