"""The speed through the water without the noise of its log: what changes slowly, and what turning costs.

A ship loses speed in a turn with the square of her yaw rate and wins it back with a time of her own: the longitudinal
equation of Nomoto and of Norrbin, (d/dt + 1 / T) V = (...) - k r^2. The heading shows r far better than the log shows
the loss. So the loss has one number to find, and what is left for the spline changes slowly.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.means import curve_of_means, mean_about
from kempf.pipeline.channels.recursion import filtered
from kempf.pipeline.channels.series import Float, Mask, Nanoseconds, Series
from kempf.pipeline.channels.signal import Signal, signal
from kempf.pipeline.estimate.record.moves import moves
from kempf.schemas.units import SECOND_NS

#: times in which a ship wins her speed back that are tried, in legs of the manoeuvre
_LEGS = (0.3, 1.0, 3.0)
#: instants of the speed between means, in the time that each goes over
_STEP = 0.1
#: of what the curve between means departs from straight lines, the part by which it misses a swing over three of them;
#: of slower ones it misses less
_MISSED = 1.0 / 3.0


def water_speed(log: Series, heading: Series, rudder: Series, mean_s: float = 0.0) -> Signal:
    """Return the speed, and how large and how slow its error is.

    Parameters
    ----------
    log : Series
        m/s, without spikes.
    heading, rudder : Series
        rad.
    mean_s : float, optional
        Time over which each value of the log is a mean, about its instant, s; 0 where it is of the instant.

    Returns
    -------
    Signal
        At the log's instants; where its values are means, at ten instants of each.

    References
    ----------
    Norrbin (1971), "Theory and observations on the use of a mathematical model for ship manoeuvring in deep and
    confined waters", SSPA 68: the speed lost in a turn goes with v r and r^2.
    """
    turns = moves(rudder.value)
    if len(log) < 2:
        return signal(log)
    leg_s = (log.time_utc_ns[-1] - log.time_utc_ns[0]) * 1e-9 / turns if turns else 0.0
    instants = _between(log, mean_s) if mean_s > 0.0 else log.time_utc_ns
    shapes = _lost(heading, instants, leg_s) if turns else []
    if not mean_s > 0.0:
        return signal(log, shapes)
    means = [mean_about(Series(instants, shape), log.time_utc_ns, mean_s) for shape in shapes]
    mean_signal = signal(log, means)
    turning = 0.0 if mean_signal.shape is None else mean_signal.multiple * means[mean_signal.shape]
    slow_means = mean_signal.series.value - turning
    slow = curve_of_means(Series(log.time_utc_ns, slow_means), instants)
    whole = slow if mean_signal.shape is None else slow + mean_signal.multiple * shapes[mean_signal.shape]
    known = _within(instants, log, mean_s)
    straight = np.interp(instants.astype(np.float64), log.time_utc_ns.astype(np.float64), slow_means)
    missed = _MISSED * float(np.sqrt(np.mean((slow - straight)[known] ** 2)))
    error_std = float(np.hypot(mean_signal.error_std, missed))
    return replace(mean_signal, series=Series(instants[known], whole[known]), error_std=error_std)


def _lost(heading: Series, instants: Nanoseconds, leg_s: float) -> list[Float]:
    """Return what turning takes from the speed, but for its size: one shape for every time to win it back."""
    square = _yaw_rate(heading, instants) ** 2
    period_s = float(np.median(np.diff(instants))) / SECOND_NS
    shapes = []
    for legs in _LEGS:
        decay = float(np.exp(-period_s / (legs * leg_s)))
        # at rest in the mean: what came before the segment is the spline's
        shapes.append(filtered([1.0 - decay], [1.0, -decay], square - np.mean(square)))
    return [shape for shape in shapes if np.ptp(shape) > 0.0]


def _between(log: Series, mean_s: float) -> Nanoseconds:
    """Return instants from the first to the last that means of a log say something of."""
    half, step = (round(part * mean_s * SECOND_NS) for part in (0.5, _STEP))
    return np.arange(log.time_utc_ns[0] - half, log.time_utc_ns[-1] + half + 1, step)


def _within(instants: Nanoseconds, log: Series, mean_s: float) -> Mask:
    """Return which instants some mean of a log goes over: none of where it has a gap."""
    later = np.clip(np.searchsorted(log.time_utc_ns, instants), 1, len(log) - 1)
    beside = np.stack([log.time_utc_ns[later - 1], log.time_utc_ns[later]])
    known: Mask = np.min(np.abs(beside - instants), axis=0) <= 0.5 * mean_s * SECOND_NS + 1.0
    return known


def _yaw_rate(heading: Series, instants: Nanoseconds) -> Float:
    """Return the heading's rate at some instants, rad/s, its noise smoothed away."""
    if len(heading) < 2:
        return np.zeros(instants.size)
    rate, origin = heading_rate(heading), int(heading.time_utc_ns[0])
    at = (instants - origin).astype(np.float64) / SECOND_NS
    result: Float = np.interp(at, rate.seconds_since(origin), rate.value)
    return result


def heading_rate(heading: Series) -> Series:
    """Return the heading's rate at its own instants, rad/s, its noise smoothed away; of two readings or more."""
    still = signal(heading).series
    own = still.seconds_since(int(still.time_utc_ns[0]))
    return Series(still.time_utc_ns, np.gradient(still.value, own))
