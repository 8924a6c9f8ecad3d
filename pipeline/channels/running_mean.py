"""The running mean of values at equal steps."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float


def running_mean(values: Float, width: int) -> Float:
    """Return means about each value; beyond either end the last value is taken to go on.

    Parameters
    ----------
    values : ndarray, shape (n,)
        At least one, without NaN.
    width : int
        Over how many values each mean goes, at least one.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> running_mean(np.array([0.0, 3.0, 0.0, 0.0]), 3).round(6).tolist()
    [1.0, 1.0, 1.0, 0.0]
    """
    padded = np.pad(values, (width // 2, width - 1 - width // 2), mode="edge")
    mean: Float = np.convolve(padded, np.ones(width) / width, mode="valid")
    return mean
