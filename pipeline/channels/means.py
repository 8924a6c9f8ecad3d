"""A channel whose values are means over a time: what a curve means over it, and the curve that has such means."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS

#: times between two means beyond which some are lost
_LOST = 1.5


def mean_about(series: Series, instants: Nanoseconds, over_s: float) -> Float:
    """Return the mean of a series about some instants, shape (n,).

    Parameters
    ----------
    series : Series
        Straight between its values, and nothing but its ends beyond them.
    instants : ndarray, shape (n,)
        UTC ns.
    over_s : float
        The time about each instant that its mean goes over, s.
    """
    origin = int(series.time_utc_ns[0])
    at = (instants - origin).astype(np.float64) / SECOND_NS
    return mean_of_line(series.seconds_since(origin), series.value, at, over_s)


def mean_of_line(own: Float, value: Float, at: Float, over: float) -> Float:
    """Return the mean of a line about some places, shape (n,); what it is there where a mean goes over nothing.

    Parameters
    ----------
    own, value : ndarray, shape (m,)
        Its corners; nothing but its ends beyond them.
    at : ndarray, shape (n,)
    over : float
        What each mean goes over about its place, in the unit of the places.
    """
    there = np.interp(at, own, value)
    if not over > 0.0:
        return there
    total = np.concatenate([[0.0], np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(own))])
    first, last = np.clip(at - 0.5 * over, own[0], own[-1]), np.clip(at + 0.5 * over, own[0], own[-1])
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (np.interp(last, own, total) - np.interp(first, own, total)) / (last - first)
    return np.where(last > first, mean, there)


def curve_of_means(means: Series, instants: Nanoseconds) -> Float:
    """Return the smooth curve that has these means, at some instants, shape (n,).

    A straight line between means flattens what rises and sinks within a few of them, by the mean and by the line. The
    sum of the means is known where one ends and the next begins; the curve is the slope of a cubic spline through it.
    Where some are lost, the means on either side have curves of their own.

    Parameters
    ----------
    means : Series
        Each about its instant, from half way to the one before to half way to the next.
    instants : ndarray, shape (n,)
        UTC ns; beyond the time of a last mean the curve stays where it is.

    References
    ----------
    Boneva, Kendall & Stefanov (1971), "Spline transformations: three new diagnostic aids for the statistical
    data-analyst", JRSS B 33: the histospline.
    """
    origin = int(means.time_utc_ns[0])
    own, at = means.seconds_since(origin), (instants - origin).astype(np.float64) / SECOND_NS
    step, curve = means.period_s, np.empty(at.size)
    ends = np.flatnonzero(np.diff(own) > _LOST * step) + 1
    first_of = np.concatenate([[-np.inf], 0.5 * (own[ends - 1] + own[ends]), [np.inf]])
    for k, part in enumerate(np.split(np.arange(own.size), ends)):
        middle, value = own[part], means.value[part]
        edge = np.concatenate([[middle[0] - 0.5 * step], 0.5 * (middle[1:] + middle[:-1]), [middle[-1] + 0.5 * step]])
        total = np.concatenate([[0.0], np.cumsum(value * np.diff(edge))])
        near = (at >= first_of[k]) & (at < first_of[k + 1])
        curve[near] = CubicSpline(edge, total).derivative()(np.clip(at[near], edge[0], edge[-1]))
    return curve
