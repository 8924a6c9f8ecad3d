"""The standard deviation of Gaussian values from the median of their sizes, which outliers hardly move."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float

#: Standard deviation of a Gaussian over the median of its absolute value (Hampel 1974, "The influence curve and its
#: role in robust estimation", Journal of the American Statistical Association 69), rounded.
MAD_TO_STD = 1.4826


def robust_std(deviations: Float) -> float:
    """Return the standard deviation of deviations from their middle, in their unit.

    Parameters
    ----------
    deviations : ndarray, shape (n,)
        At least one, without NaN.

    Examples
    --------
    >>> round(robust_std(np.array([-2.0, -1.0, 0.0, 1.0, 500.0])), 4)
    1.4826
    """
    return MAD_TO_STD * float(np.median(np.abs(deviations)))
