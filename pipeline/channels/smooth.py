"""A slow channel without its noise: a cubic smoothing spline, softer than the one with the least error.

The speed of a ship changes over minutes, her log reads it with noise every second. The speed multiplies every term of
the model, so that noise would shake the rudder's force as if the rudder itself shook.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.spline import Smoother

#: each width that is tried is so many times the next one
_STEP = 10.0**0.25
#: the widest is this part of the series: a straight line through all of it would know its error for nothing
_WIDTHS = 8.0
#: weight of a reading in its own smoothed value, in periods by width
_WEIGHT = 0.5**1.5
#: the width that is taken, by the one with the least error: what is left of the noise is known in size and time, what
#: smoothing takes away of the channel itself is not, and sinks much faster with the width than the noise grows
_SOFTER = 0.25
_FEWEST = 12
#: half width, in readings, and limit, in robust standard deviations, of the search for spikes
_NEIGHBOURS = 5
_SPIKE = 8.0
#: integral of 1 / (1 + x^4)^2 over all x, divided by 2 pi
_PASSED = 0.2652


@dataclass(frozen=True, eq=False)
class SmoothedSpeed:
    """A series without its noise, and what of it is left."""

    #: At its own instants.
    series: Series
    #: Standard deviation of the noise that is left, in the series' unit.
    error_std: float
    #: Its correlation time: that of the first-order process with as much variance and as much power at frequency 0.
    error_time_s: float


def smoothed(series: Series, noise_std: float, shapes: Sequence[Float] = ()) -> SmoothedSpeed:
    """Take the noise out of a series.

    Parameters
    ----------
    noise_std : float
        Standard deviation of the noise of one reading, in the series' unit.
    shapes : sequence of ndarray, shape (n,), optional
        What the series may go with, at its instants. Some multiple of one of them, the one that helps most, may come
        on top of the spline, which then has less to follow.

    Returns
    -------
    SmoothedSpeed
        With the same series where there is no noise to speak of, or fewer than 12 readings.

    References
    ----------
    Craven and Wahba (1978), "Smoothing noisy data with spline functions", Numerische Mathematik 31: where the noise is
    known, what is left over and the weight of a reading in its own value give the error of each stiffness.
    Silverman (1984), "Spline smoothing: the equivalent variable kernel method", Annals of Statistics 12: a spline of
    penalty h^4 passes the share 1 / (1 + (h w)^4) of what swings at w.
    Speckman (1988), "Kernel smoothing in partial linear models", Journal of the Royal Statistical Society B 50: the
    multiple is that of what is left of both when the spline is taken away.
    """
    if len(series) < _FEWEST:
        return SmoothedSpeed(series, noise_std, 0.0)
    as_it_is = SmoothedSpeed(series, noise_std, 0.5 * series.period_s)
    if not noise_std > 1e-6 * max(1e-12, float(np.max(np.abs(series.value)))):
        return as_it_is
    time_s = series.seconds_since(int(series.time_utc_ns[0]))
    columns = np.column_stack([series.value, *shapes])
    smoother = Smoother(time_s, columns)

    @cache
    def splines(over_s: float) -> Float:
        # the sum of squares grows with the readings: per second of them the penalty means one width for all rates
        return smoother.smooth(over_s**4 / series.period_s)

    def beside(over_s: float, shape: int) -> tuple[Float, float]:
        """Return the series smoothed beside a shape (0: beside none), and the variance that its multiple brings in."""
        spline = splines(over_s)
        if not shape:
            return spline[:, 0], 0.0
        rough = columns[:, shape] - spline[:, shape]
        share = float(rough @ columns[:, shape])
        if not share > 0.0:
            return spline[:, 0], 0.0
        multiple = float(rough @ series.value) / share
        return spline[:, 0] + multiple * rough, noise_std**2 * float(np.mean(rough**2)) / share

    def width(power: int) -> float:
        return series.period_s * float(_STEP**power)

    @cache
    def risk(power: int, shape: int) -> float:
        left_over = series.value - beside(width(power), shape)[0]
        own = _WEIGHT * series.period_s / width(power) + (1.0 if shape else 0.0) / len(series)
        return float(np.mean(left_over**2)) + 2.0 * noise_std**2 * own

    # by large steps and at last by single ones
    widest = max(int(np.log(time_s[-1] / _WIDTHS / series.period_s) / np.log(_STEP)), 0)
    kinds = range(columns.shape[1])
    best = min(product(range(0, widest + 1, 4), kinds), key=lambda one: risk(*one))
    for step in (2, 1):
        near = (best[0] - step, best[0], best[0] + step)
        best = min(product(near, kinds), key=lambda one: risk(*one))
    over_s = _SOFTER * width(best[0])
    value, around = beside(over_s, best[1])
    left = min(noise_std * float(np.sqrt(_PASSED * series.period_s / over_s)), noise_std)
    # narrower than its readings lie apart no spline is: then it is the readings themselves
    slowness = max(0.5 / _PASSED * over_s, 0.5 * series.period_s)
    return SmoothedSpeed(Series(series.time_utc_ns, value), float(np.hypot(left, np.sqrt(around))), slowness)


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
