"""A slow channel without its noise: a cubic smoothing spline that leaves over what the instrument's noise is.

The speed of a ship changes over minutes, her log reads it with noise every second. The speed multiplies every term of
the model, so that noise would shake the rudder's force as if the rudder itself shook.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_smoothing_spline

from pipeline.normalise.series import Series

#: penalties on the curvature that are tried, s^3
_PENALTIES = 10.0 ** np.arange(-1.0, 6.0)
#: the spline may leave over so much of the noise: less than all of it, as it follows some, and as a ship whose speed is
#: smoothed too far is worse off than one whose log still trembles a little
_LEFT_OVER = 0.93
_FEWEST = 12
#: half width, in readings, and limit, in robust standard deviations, of the search for spikes
_NEIGHBOURS = 5
_SPIKE = 8.0


def smoothed(series: Series, noise_std: float) -> Series:
    """Return the series without its noise, at its own instants.

    Parameters
    ----------
    series : Series
    noise_std : float
        Standard deviation of the noise of one reading, in the series' unit.

    Returns
    -------
    Series
        The same where there is no noise to speak of, or fewer than 12 readings.

    References
    ----------
    Reinsch (1967), "Smoothing by spline functions", Numerische Mathematik 10: the residuals tell how far to smooth.
    """
    if len(series) < _FEWEST or not noise_std > 1e-6 * max(1e-12, float(np.max(np.abs(series.value)))):
        return series
    time_s = series.seconds_since(int(series.time_utc_ns[0]))

    def left_over(penalty: float) -> tuple[float, Series]:
        # the sum of squares grows with the readings: per second of them the penalty means one width for all rates
        spline = make_smoothing_spline(time_s, series.value, lam=float(penalty) / series.period_s)
        value = spline(time_s)
        return float(np.sqrt(np.mean((series.value - value) ** 2))), Series(series.time_utc_ns, value)

    low, high, best = 0, len(_PENALTIES) - 1, series
    while low <= high:
        middle = (low + high) // 2
        residual, candidate = left_over(_PENALTIES[middle])
        if residual <= _LEFT_OVER * noise_std:
            best, low = candidate, middle + 1
        else:
            high = middle - 1
    return best


def without_spikes(series: Series) -> tuple[Series, int]:
    """Return the series without single readings that leap away from their neighbours, and how many these were.

    References
    ----------
    Pearson (2002), "Outliers in process modeling and identification", IEEE Trans. Control Syst. Technol. 10: the
    Hampel filter.
    """
    n = len(series)
    if n < _FEWEST:
        return series, 0
    window = np.lib.stride_tricks.sliding_window_view(
        np.pad(series.value, _NEIGHBOURS, mode="reflect"), 2 * _NEIGHBOURS + 1
    )
    centre = np.median(window, axis=1)
    away = np.abs(series.value - centre)
    # the scale of the whole series: the neighbours alone may all be equal in a coarse channel
    scale = max(1.4826 * float(np.median(away)), 1e-2 * float(np.median(np.abs(series.value))))
    keep = away <= _SPIKE * scale
    return Series(series.time_utc_ns[keep], series.value[keep]), int(n - np.count_nonzero(keep))
