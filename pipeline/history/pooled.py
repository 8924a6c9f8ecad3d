"""May several parameter sets be pooled? Their precision-weighted mean, and the test whether they are one.

The generalised Q of Cochran (1954), "The combination of estimates from different experiments", Biometrics 10, for
vectors: Jackson, White and Riley (2012), "Quantifying the impact of between-study heterogeneity in multivariate
meta-analyses", Statistics in Medicine 31.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.history.sets import usable
from kempf.schemas.errors import DataRejected


@dataclass(frozen=True, eq=False)
class Pooled:
    """Parameter sets taken together."""

    #: Shape (n_parameter,). Precision-weighted mean.
    value: Float
    #: Shape (n_parameter, n_parameter). Of it, if the sets are one and their covariances true.
    covariance: Float
    #: q, dof: Int. Cochran's Q and its degrees of freedom, n_parameter (n_set - 1).
    q: float
    dof: int
    #: Probability of so large a Q if the sets are one and their covariances true; NaN for one set.
    p_value: float
    #: sqrt(Q / dof), the Birge ratio: by how much the standard errors would have to be larger for the sets to agree;
    #: NaN for one set.
    scale: float
    #: Shape (n_set,). Whether one set agrees with the mean of the others, Bonferroni's correction included; NaN for one
    #: set.
    set_p_value: Float

    def poolable(self, level: float = 0.05) -> bool | None:
        """Return whether nothing speaks against pooling at this level; None where there is nothing to compare."""
        return None if self.dof == 0 else self.p_value > level


def pool(value: Float, covariance: Float) -> Pooled:
    """Pool parameter vectors and test whether they are one.

    Parameters
    ----------
    value : ndarray, shape (n_set, n_parameter)
    covariance : ndarray, shape (n_set, n_parameter, n_parameter)

    Raises
    ------
    DataRejected
        ``nothing_to_pool``: no set, or one without a positive definite covariance.

    Examples
    --------
    >>> both = pool(np.array([[1.0], [3.0]]), np.array([[[1.0]], [[1.0]]]))
    >>> both.value.tolist(), round(both.q, 6), both.dof
    ([2.0], 2.0, 1)
    """
    from kempf.pipeline.distributions import chi2_tail

    if not value.size or not bool(np.all(usable(value, covariance))):
        raise DataRejected(
            "nothing_to_pool",
            f"{len(value)} parameter sets were given, with or without positive definite covariances; expected at least "
            "one, all with.",
            "Leave out the sets that have none.",
        )
    n, p = value.shape
    scale = np.sqrt(np.mean(np.einsum("ijj->ij", covariance), axis=0))
    y, S = value / scale, covariance / np.outer(scale, scale)
    J = np.linalg.inv(S)
    total = np.sum(J, axis=0)
    h = np.einsum("ijk,ik->ij", J, y)
    mean = np.linalg.solve(total, np.sum(h, axis=0))
    apart = y - mean
    q, dof = float(np.einsum("ij,ijk,ik", apart, J, apart)), p * (n - 1)
    one_out = np.full(n, np.nan)
    for i in range(n if n > 1 else 0):
        # against the mean of the others, whose covariance is that of an independent estimate
        rest = np.linalg.inv(total - J[i])
        gap = y[i] - rest @ (np.sum(h, axis=0) - h[i])
        one_out[i] = min(1.0, n * chi2_tail(float(gap @ np.linalg.solve(S[i] + rest, gap)), p))
    return Pooled(
        mean * scale,
        np.linalg.inv(total) * np.outer(scale, scale),
        q,
        dof,
        chi2_tail(q, dof) if dof else float("nan"),
        float(np.sqrt(q / dof)) if dof else float("nan"),
        one_out,
    )
