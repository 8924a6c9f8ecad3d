"""The cubic smoothing spline at its own knots, of several columns at once.

scipy's `make_smoothing_spline` gives the same values and a curve in between, which nobody asks for here, in fifty times
the time: its loop over the knots is Python.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from kempf.pipeline.channels.series import Float


class Smoother:
    """Smooths columns given at the same instants.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Rising, n >= 3.
    columns : ndarray, shape (n, k)

    References
    ----------
    Reinsch (1967), "Smoothing by spline functions", Numerische Mathematik 10; Green & Silverman (1994), Nonparametric
    Regression and Generalized Linear Models, sect. 2.3.
    """

    def __init__(self, time_s: Float, columns: Float) -> None:
        h = np.diff(time_s)
        # second divided differences are Q' y: three numbers a row
        self._q = np.stack([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]])
        self._columns, self._bent = columns, self._differences(columns)
        a, b, c = self._q
        m = a.size
        self._squares, self._ribs = np.zeros((3, m)), np.zeros((3, m))
        self._squares[2] = a * a + b * b + c * c
        self._squares[1, 1:] = b[:-1] * a[1:] + c[:-1] * b[1:]
        self._squares[0, 2:] = c[:-2] * a[2:]
        self._ribs[2] = (h[:-1] + h[1:]) / 3.0
        self._ribs[1, 1:] = h[1:-1] / 6.0

    def smooth(self, penalty: float) -> Float:
        """Return the columns g with the least sum of (y - g)^2 + ``penalty`` times the integral of g''^2.

        Parameters
        ----------
        penalty : float
            s^3.

        Returns
        -------
        ndarray, shape (n, k)
        """
        curvature = solveh_banded(self._ribs + penalty * self._squares, self._bent)
        a, b, c = (row[:, None] for row in self._q)
        taken = np.zeros_like(self._columns)
        taken[:-2] += a * curvature
        taken[1:-1] += b * curvature
        taken[2:] += c * curvature
        result: Float = self._columns - penalty * taken
        return result

    def _differences(self, y: Float) -> Float:
        a, b, c = (row[:, None] for row in self._q)
        result: Float = a * y[:-2] + b * y[1:-1] + c * y[2:]
        return result
