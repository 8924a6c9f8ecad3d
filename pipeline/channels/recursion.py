"""Columns through a recursive filter, such as a lag of first order or a damped oscillator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg.lapack import dtbtrs

from kempf.pipeline.channels.series import Float


def filtered(numerator: Sequence[float] | Float, denominator: Sequence[float] | Float, columns: Float) -> Float:
    """Return columns through a rational filter that was at rest before them.

    Its difference equation is a banded triangular system, solved in one call: `scipy.signal.lfilter` gives the same and
    makes every command start three quarters of a second later, which is what importing it takes.

    Parameters
    ----------
    numerator, denominator : array_like, shape (k,) and (m,)
        In powers of the delay; the denominator begins with 1.
    columns : ndarray, shape (n,) or (n, c)

    Returns
    -------
    ndarray, shape of ``columns``

    Examples
    --------
    >>> filtered([0.5], [1.0, -0.5], np.ones(4))
    array([0.5   , 0.75  , 0.875 , 0.9375])
    """
    columns = np.asarray(columns, dtype=np.float64)
    if not columns.size:
        # LAPACK does not look before it writes
        return columns.copy()
    driven = np.zeros_like(columns)
    for delay, factor in enumerate(numerator[: len(columns)]):
        driven[delay:] += factor * columns[: len(columns) - delay]
    bands = np.repeat(np.asarray(denominator, dtype=np.float64)[:, None], len(columns), axis=1)
    solved, _ = dtbtrs(bands, driven, uplo="L", diag="U")
    return np.asarray(solved).reshape(columns.shape)
