"""The parameter sets of one vessel in their order of time, as arrays; what is compared must be comparable.

No estimation here and no table: which sets belong together is decided where they are stored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float, Mask, Nanoseconds
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS


@dataclass(frozen=True, eq=False)
class ParameterHistory:
    """Parameter vectors of one vessel, one model and one estimator, each from data of its own.

    Raises
    ------
    DataRejected
        ``history_shape``, ``history_not_in_order``, ``covariance_unusable``.
    """

    #: names, units: Length n_parameter.
    names: tuple[str, ...]
    units: tuple[str, ...]
    #: Shape (n_set,). Never decreasing.
    time_utc_ns: Nanoseconds
    #: Shape (n_set, n_parameter). In the units of the parameters.
    value: Float
    #: Shape (n_set, n_parameter, n_parameter). Of each set, in products of the units; positive definite.
    covariance: Float

    def __post_init__(self) -> None:
        n, p = self.time_utc_ns.size, len(self.names)
        shapes = (self.value.shape, self.covariance.shape, len(self.units))
        if shapes != ((n, p), (n, p, p), p):
            raise DataRejected(
                "history_shape",
                f"{n} instants and {p} names come with values, covariances and units of shape {shapes}.",
                "Give one value and one covariance a set, one unit a parameter.",
            )
        if bool(np.any(np.diff(self.time_utc_ns) < 0)):
            raise DataRejected(
                "history_not_in_order", "The parameter sets are not in the order of time.", "Sort them by their start."
            )
        bad = np.flatnonzero(~usable(self.value, self.covariance))
        if bad.size:
            raise DataRejected(
                "covariance_unusable",
                f"{bad.size} of {n} parameter sets have no finite values or no positive definite covariance.",
                "Leave them out, see `usable`.",
                {"sets": bad.tolist()},
            )

    def __len__(self) -> int:
        return int(self.time_utc_ns.size)


def usable(value: Float, covariance: Float) -> Mask:
    """Return which sets have finite values and a positive definite covariance, shape (n_set,).

    Parameters
    ----------
    value : ndarray, shape (n_set, n_parameter)
    covariance : ndarray, shape (n_set, n_parameter, n_parameter)
    """
    finite = np.all(np.isfinite(value), axis=1) & np.all(np.isfinite(covariance), axis=(1, 2))
    std = np.sqrt(np.maximum(np.einsum("ijj->ij", np.where(finite[:, None, None], covariance, 0.0)), 0.0))
    good: Mask = finite & np.all(std > 0, axis=1)
    for i in np.flatnonzero(good):
        # of the correlations, because the units of the parameters differ by orders of magnitude
        good[i] = np.linalg.eigvalsh(covariance[i] / np.outer(std[i], std[i]))[0] > 1e-12
    return good


def occasions(history: ParameterHistory, within_s: float) -> ParameterHistory:
    """Merge sets begun within a time of the first of them into one.

    Trials of one day share draught, trim, sea state and water: as evidence of how well trials repeat they count once.
    The mean is weighted by one number a set, the inverse of its average variance, not by its whole covariance: matrix
    weights lean on combinations that the sets claim to know far better than trials repeat.

    Parameters
    ----------
    within_s : float
        s; 0 merges only what begins at one instant.
    """
    time = history.time_utc_ns
    if not time.size:
        return history
    label, first = np.zeros(time.size, dtype=np.int64), 0
    for i in range(1, time.size):
        if time[i] - time[first] > within_s * SECOND_NS:
            first = i
        label[i] = label[i - 1] + (first == i)
    variance = np.einsum("ijj->ij", history.covariance)
    weight = 1.0 / np.mean(variance / np.mean(variance, axis=0), axis=1)
    groups = [np.flatnonzero(label == g) for g in range(int(label[-1]) + 1)]
    shares = [weight[g] / np.sum(weight[g]) for g in groups]
    value = [w @ history.value[g] for w, g in zip(shares, groups, strict=True)]
    covariance = [np.einsum("i,ijk->jk", w**2, history.covariance[g]) for w, g in zip(shares, groups, strict=True)]
    return ParameterHistory(
        history.names,
        history.units,
        np.array([time[g[0]] for g in groups], dtype=np.int64),
        np.array(value),
        np.array(covariance),
    )
