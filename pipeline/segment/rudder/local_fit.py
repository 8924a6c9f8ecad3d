"""The heading and its rate at one instant, from a cubic laid through the measurements around it."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float


def value_and_rate(time_s: Float, values: Float, instant_s: float, half_window_s: float) -> tuple[float, float]:
    """Return a smooth series' value and first derivative at one instant.

    A cubic keeps the peak of a swing where it is: a straight mean of noisy headings would lower it.

    Parameters
    ----------
    time_s, values : ndarray, shape (n,)
        Samples; angles unwrapped.
    instant_s : float
        Where it is asked for, s; inside the series, else both results are NaN.
    half_window_s : float
        Samples nearer than this take part; at least five do where there are five.

    Returns
    -------
    tuple of float
        Value, and derivative per second.
    """
    if time_s.size < 2 or not time_s[0] <= instant_s <= time_s[-1]:
        return float("nan"), float("nan")
    first, last = np.searchsorted(time_s, [instant_s - half_window_s, instant_s + half_window_s])
    if last - first < 5:
        middle = int(np.searchsorted(time_s, instant_s))
        first, last = max(middle - 3, 0), min(middle + 3, time_s.size)
    t = time_s[first:last] - instant_s
    scale = float(np.max(np.abs(t))) or 1.0
    degree = min(3, t.size - 1)
    basis = np.vander(t / scale, degree + 1, increasing=True)
    coefficients = np.linalg.lstsq(basis, values[first:last], rcond=None)[0]
    return float(coefficients[0]), float(coefficients[1]) / scale


def peak(
    time_s: Float, values: Float, start_s: float, end_s: float, *, side: int, half_window_s: float
) -> tuple[float, float] | None:
    """Return where a smooth series turns back between two instants.

    Parameters
    ----------
    time_s, values : ndarray, shape (n,)
        Samples; angles unwrapped.
    start_s, end_s : float
        Interval searched, s.
    side : int
        +1 for a maximum, -1 for a minimum.
    half_window_s : float
        Half width of the local cubic, s.

    Returns
    -------
    tuple of float or None
        Instant and value of the turning point; None where the series has not turned back by the end.
    """
    first, last = np.searchsorted(time_s, [start_s, end_s + 1e-9])
    if last - first < 3:
        return None
    best = first + int(np.argmax(side * values[first:last]))
    instant = float(time_s[best])
    # the fitted rate is bisected: the raw maximum of noisy samples is early or late
    low, high = max(instant - half_window_s, start_s), min(instant + half_window_s, end_s, float(time_s[-1]))
    rate_low = side * value_and_rate(time_s, values, low, half_window_s)[1]
    rate_high = side * value_and_rate(time_s, values, high, half_window_s)[1]
    if rate_high > 0:
        return None
    if rate_low <= 0:
        return low, value_and_rate(time_s, values, low, half_window_s)[0]
    for _ in range(30):
        middle = (low + high) / 2
        if side * value_and_rate(time_s, values, middle, half_window_s)[1] > 0:
            low = middle
        else:
            high = middle
    return high, value_and_rate(time_s, values, high, half_window_s)[0]
