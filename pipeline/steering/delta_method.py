"""How the covariance of the parameters becomes the uncertainty of what is computed from them.

First order (the delta method) with derivatives by a complex step, which are exact to the last bits and need no choice
of a step (Squire and Trapp 1998, "Using complex variables to estimate derivatives of real functions", SIAM Review 40);
for quotients also the interval of Fieller (1954), "Some problems in interval estimation", Journal of the Royal
Statistical Society B 16, which stays true where the denominator is not well away from zero.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.schemas.confidence import NORMAL_95

_STEP = 1e-30


def gradient(function: Callable[[Float], Float], p: Float) -> Float:
    """Return the derivatives of an analytic function of real parameters.

    Parameters
    ----------
    function : callable
        From complex p, shape (n,), to values, shape (m,); analytic, so no absolute values.
    p : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (m, n)
    """
    columns = []
    for j in range(p.size):
        moved = p.astype(np.complex128)
        moved[j] += 1j * _STEP
        columns.append(np.imag(function(moved)) / _STEP)  # type: ignore[arg-type]
    return np.column_stack(columns)


def quotient(
    function: Callable[[Float], tuple[Float, Float]], p: Float, covariance: Float
) -> tuple[float, float, tuple[float, float] | None]:
    """Return a quotient of two functions of the parameters with its uncertainty.

    Parameters
    ----------
    function : callable
        From p, shape (n,), to numerator and denominator; analytic.
    p : ndarray, shape (n,)
    covariance : ndarray, shape (n, n)
        NaN where unknown.

    Returns
    -------
    value, std : float
        ``std`` by the delta method, NaN where the covariance is unknown.
    interval_95 : tuple of float or None
        Of Fieller; None where it is unbounded or the covariance is unknown.
    """
    above, below = (float(np.real(part)) for part in function(p))
    value = above / below
    if not np.all(np.isfinite(covariance)):
        return value, float("nan"), None
    slopes = gradient(lambda q: np.array(function(q)), p)
    (s_aa, s_ab), (_, s_bb) = slopes @ covariance @ slopes.T
    std = float(np.sqrt(max(0.0, s_aa - 2.0 * value * s_ab + value**2 * s_bb)) / abs(below))
    z2 = NORMAL_95**2
    # all theta with (above - theta below)^2 <= z^2 var(above - theta below)
    a, b, c = below**2 - z2 * s_bb, above * below - z2 * s_ab, above**2 - z2 * s_aa
    if a <= 0.0:
        return value, std, None
    half = float(np.sqrt(max(0.0, b * b - a * c)))
    return value, std, (float((b - half) / a), float((b + half) / a))
