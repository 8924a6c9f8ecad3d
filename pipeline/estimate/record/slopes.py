"""How fast one channel changes when another does: increments over windows, and their slope despite gross errors.

What a slope other than 1 means is said where it is asked for, `kempf.pipeline.estimate.record.agreement`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Float, Nanoseconds, Series

#: windows that a segment is cut into, and the shortest in periods of the slower instrument
_WINDOWS = 60
_SHORTEST_PERIODS = 3.0
_FEWEST = 8
#: what the slopes leave over, as a share of what there was, below which two channels go together
_TOGETHER = 0.5


@dataclass(frozen=True)
class Slope:
    """How the changes of one channel go with those of another.

    Attributes
    ----------
    value : float
        Change of the one for a change of 1 in the other; their constant drift apart is left out.
    left_over : float
        Median absolute deviation of what the slope does not explain over that of all of it; 1 where the two have
        nothing in common.
    """

    value: float
    left_over: float

    @property
    def together(self) -> bool:
        """Whether the two channels go together at all, so that the slope means something."""
        return self.left_over < _TOGETHER


def windows(*series: Series, most: int = _WINDOWS) -> Nanoseconds:
    """Return the edges of equal windows over what the series have in common, shape (n,); empty where that is little.

    Parameters
    ----------
    *series : Series
        Not empty.
    most : int, optional
        Windows at most.
    """
    start = max(int(one.time_utc_ns[0]) for one in series)
    end = min(int(one.time_utc_ns[-1]) for one in series)
    shortest = max(_SHORTEST_PERIODS * one.period_s for one in series)
    count = int(min(most, (end - start) * 1e-9 / shortest)) if end > start else 0
    if count < _FEWEST:
        return np.empty(0, dtype=np.int64)
    edges: Nanoseconds = np.linspace(0, end - start, count + 1).astype(np.int64) + start
    return edges


def integral_at(series: Series, time_utc_ns: Nanoseconds) -> Float:
    """Integrate a series by the trapezium rule and return the integral's increments between instants.

    Parameters
    ----------
    series : Series
    time_utc_ns : ndarray, shape (n,)
        Rising.

    Returns
    -------
    ndarray, shape (n - 1,)
        NaN where a gap of the series lies in between.
    """
    step = np.diff(series.time_utc_ns) * 1e-9
    total = np.concatenate([[0.0], np.cumsum(0.5 * (series.value[1:] + series.value[:-1]) * step)])
    gaps = np.concatenate([[0.0], np.cumsum(step > gap_limit_s(series))])
    increments: Float = np.diff(Series(series.time_utc_ns, total).at(time_utc_ns, np.inf))
    increments[np.diff(np.interp(time_utc_ns, series.time_utc_ns, gaps)) > 0.0] = np.nan
    return increments


def slope(x: Float, y: Float) -> Slope | None:
    """Return the slope of y on x, constant left free: the weighted median of the slopes between all pairs.

    Half of the pairs may be wrong before it breaks down; a third of the points or so.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        NaN are left out.

    Returns
    -------
    Slope or None
        None for fewer than 8 points, or where x does not change.

    References
    ----------
    Jaeckel (1972), "Estimating regression coefficients by minimizing the dispersion of the residuals", Annals of
    Mathematical Statistics 43; Sievers (1978), "Weighted rank statistics for simple linear regression", JASA 73.
    """
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if x.size < _FEWEST:
        return None
    first, second = np.triu_indices(x.size, k=1)
    run, rise = x[second] - x[first], y[second] - y[first]
    apart = run != 0.0
    if not apart.any():
        return None
    slopes, weights = rise[apart] / run[apart], np.abs(run[apart])
    order = np.argsort(slopes, kind="stable")
    total = np.cumsum(weights[order])
    value = float(slopes[order][np.searchsorted(total, 0.5 * total[-1])])
    spread = _deviation(y)
    return Slope(value, _deviation(y - value * x) / spread if spread > 0.0 else 0.0)


def _deviation(values: Float) -> float:
    return float(np.median(np.abs(values - np.median(values))))
