"""The speed through the water without the noise of its log: what changes slowly, and what turning costs.

A ship loses speed in a turn with the square of her yaw rate and wins it back with a time of her own: the longitudinal
equation of Nomoto and of Norrbin, (d/dt + 1 / T) V = (...) - k r^2. The heading shows r far better than the log shows
the loss. So the loss has one number to find, and what is left for the spline changes slowly.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.signal import Signal, signal
from kempf.pipeline.estimate.record.moves import moves

#: times in which a ship wins her speed back that are tried, in legs of the manoeuvre
_LEGS = (0.3, 1.0, 3.0)


def water_speed(log: Series, heading: Series, rudder: Series) -> Signal:
    """Return the speed at the log's instants, and how large and how slow its error is.

    Parameters
    ----------
    log : Series
        m/s, without spikes.
    heading, rudder : Series
        rad.

    References
    ----------
    Norrbin (1971), "Theory and observations on the use of a mathematical model for ship manoeuvring in deep and
    confined waters", SSPA 68: the speed lost in a turn goes with v r and r^2.
    """
    turns = moves(rudder.value)
    if not turns or len(log) < 2:
        return signal(log)
    leg_s = (log.time_utc_ns[-1] - log.time_utc_ns[0]) * 1e-9 / turns
    square = _yaw_rate(heading, log) ** 2
    shapes = []
    for legs in _LEGS:
        kept = float(np.exp(-log.period_s / (legs * leg_s)))
        # at rest in the mean: what came before the segment is the spline's
        shapes.append(np.asarray(lfilter([1.0 - kept], [1.0, -kept], square - np.mean(square))))
    return signal(log, [shape for shape in shapes if np.ptp(shape) > 0.0])


def _yaw_rate(heading: Series, log: Series) -> Float:
    """Return the heading's rate at the log's instants, rad/s, its noise smoothed away."""
    if len(heading) < 2:
        return np.zeros(len(log))
    rate, origin = heading_rate(heading), int(heading.time_utc_ns[0])
    result: Float = np.interp(log.seconds_since(origin), rate.seconds_since(origin), rate.value)
    return result


def heading_rate(heading: Series) -> Series:
    """Return the heading's rate at its own instants, rad/s, its noise smoothed away; of two readings or more."""
    still = signal(heading).series
    own = still.seconds_since(int(still.time_utc_ns[0]))
    return Series(still.time_utc_ns, np.gradient(still.value, own))
