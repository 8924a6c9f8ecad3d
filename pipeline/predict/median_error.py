"""The middle error of several free runs, some of which may leave the measured course."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, isnan, nan
from statistics import median

#: Error of a free run, as a share of the motion, from which it has left the measured course.
LEFT_THE_COURSE = 1.0


def median_error(errors: Iterable[float]) -> float:
    """Return the median, a run that diverges (NaN) being worse than any other.

    Returns
    -------
    float
        NaN where half of the runs or more diverge.

    Raises
    ------
    statistics.StatisticsError
        There are no runs.

    Examples
    --------
    >>> median_error([0.1, float("nan"), 0.3]), median_error([0.1, float("nan")])
    (0.3, nan)
    """
    middle = float(median(inf if isnan(error) else error for error in errors))
    return nan if middle == inf else middle
