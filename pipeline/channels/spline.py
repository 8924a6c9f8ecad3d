"""The smoothing spline at its own knots, cubic or straight, of several columns at once.

scipy's `make_smoothing_spline` gives the same values and a curve in between, which nobody asks for here, in fifty times
the time: its loop over the knots is Python.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.linalg.lapack import dtbtrs

from kempf.pipeline.channels.series import Float

#: Least step, in median ones, that instants are taken to be apart.
_LEAST = 0.01


class Smoother:
    """Smooths columns given at the same instants.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Rising, n >= 3. Steps shorter than a hundredth of their median count as that.
    columns : ndarray, shape (n, k)
    order : int, optional
        Derivative that is kept small: 2 of a cubic spline, 1 of one of straight lines.

    References
    ----------
    Reinsch (1967), "Smoothing by spline functions", Numerische Mathematik 10; Green & Silverman (1994), Nonparametric
    Regression and Generalized Linear Models, sect. 2.3.
    """

    def __init__(self, time_s: Float, columns: Float, order: int = 2) -> None:
        h = np.diff(time_s)
        # messages that waited and were logged within microseconds: their squared steps would swamp double precision
        h = np.maximum(h, _LEAST * np.median(h))
        # divided differences of that order are Q' y: two or three numbers a row
        if order == 1:
            self._q = np.stack([-np.ones(h.size), np.ones(h.size)])
            ribs = [h]
        else:
            self._q = np.stack([1.0 / h[:-1], -1.0 / h[:-1] - 1.0 / h[1:], 1.0 / h[1:]])
            ribs = [(h[:-1] + h[1:]) / 3.0, h[1:-1] / 6.0]
        self._columns = columns
        #: Divided differences of the columns, shape (n - order, k).
        self.differences: Float = np.asfortranarray(
            sum(row[:, None] * self._shifted(k) for k, row in enumerate(self._q))
        )
        # the upper diagonals, the main one last
        self._squares, self._ribs = np.zeros((order + 1, h.size + 1 - order)), np.zeros((order + 1, h.size + 1 - order))
        for k in range(order + 1):
            self._squares[order - k, k:] = sum(
                self._q[i + k, : self._q.shape[1] - k] * self._q[i, k:] for i in range(order + 1 - k)
            )
        for k, row in enumerate(ribs):
            self._ribs[order - k, k:] = row
        # the last factor of every difference: what turns readings into differences
        self._log_scale = float(np.sum(np.log(self._q[-1])))

    def smooth(self, penalty: float) -> Float:
        """Return the columns g with the least sum of (y - g)^2 + ``penalty`` times the integral of g''^2 (or g'^2).

        Parameters
        ----------
        penalty : float
            s^3, s of order 1.

        Returns
        -------
        ndarray, shape (n, k)
        """
        bent = cho_solve_banded((self._factor(penalty), False), self.differences)
        taken = np.zeros_like(self._columns)
        for k, row in enumerate(self._q):
            taken[k : k + row.size] += row[:, None] * bent
        result: Float = self._columns - penalty * taken
        return result

    def whitened(self, penalty: float) -> tuple[Float, float]:
        """Return the differences of the columns with their covariance taken out, and the logarithm of that.

        Of the readings' noise, white and of variance 1, and of a derivative (the one that is kept small) that is white
        noise of a density of 1 / ``penalty`` (Wahba 1978, "Improper priors, spline smoothing and the problem of
        guarding against model errors in regression", JRSS B 40).

        Returns
        -------
        whitened : ndarray, shape (n - order, k)
            The product of two of its columns is that of their differences, weighed by the inverse covariance.
        log_determinant : float
            Of the covariance of the readings after the first ones, as many as the order, given these.
        """
        factor = self._factor(penalty)
        log_determinant = 2.0 * float(np.sum(np.log(factor[-1]))) - factor.shape[1] * np.log(penalty)
        # half of a solution by the factor: for products the other half is not needed
        half, _ = dtbtrs(factor, self.differences, uplo="U", trans="T")
        return np.sqrt(penalty) * half, log_determinant - 2.0 * self._log_scale

    def _factor(self, penalty: float) -> Float:
        factor: Float = cholesky_banded(self._ribs + penalty * self._squares)
        return factor

    def _shifted(self, by: int) -> Float:
        return self._columns[by : by + self._q.shape[1]]
