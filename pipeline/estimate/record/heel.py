"""The roll of a manoeuvre without the noise of its instrument: what her turning heels her, and the rolling beside it.

A turn heels a ship by the centrifugal force, and she comes to that heel as a damped oscillator does. Her yaw rate and
speed are read more often and better than the roll: what they say of it need not be found in the roll's readings again.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.recursion import filtered
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.signal import signal
from kempf.pipeline.estimate.record.record import MEASUREMENTS, Record
from kempf.pipeline.estimate.record.water_speed import heading_rate
from kempf.schemas.units import SECOND_NS

#: natural periods of roll that are tried, s: a boat's to a large ship's, so close that a damped one is not missed
_PERIODS_S = np.geomspace(0.5, 40.0, 25)
#: and parts of critical damping: bare hulls under way have 0.05 to 0.2, with bilge keels more (Himeno 1981)
_DAMPINGS = (0.05, 0.15, 0.4)
#: instants at which the turn is laid down, in periods of the roll's readings and in the shortest natural periods
_OF_READING, _OF_PERIOD = 0.25, 0.1
#: and no finer than this, s: the differences of a ramp's response lose their digits
_FINEST_S = 0.0025
#: readings by which the oscillator is chosen
_MOST = 4000


def rolling(roll: Series, record: Record) -> Series:
    """Return the roll at its own instants as its readings and the turn let expect it.

    Parameters
    ----------
    roll : Series
        rad, within the manoeuvre.
    record : Record
        Of the manoeuvre.

    Returns
    -------
    Series
        The same where its readings show no noise.

    References
    ----------
    Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., sect. 6.5: the heel of a turn and
    roll as a damped oscillator. Himeno (1981), "Prediction of ship roll damping: state of the art", Univ. of Michigan
    report 239: the damping.
    """
    if len(roll) < 2:
        return roll
    shapes, every = _responses(roll, record), -(-len(roll) // _MOST)
    if every > 1:
        some = Series(roll.time_utc_ns[::every], roll.value[::every])
        best = signal(some, [shape[::every] for shape in shapes]).shape
        shapes = [] if best is None else [shapes[best]]
    return signal(roll, shapes).series


def _responses(roll: Series, record: Record) -> list[Float]:
    """Return the heel that the turn brings, at once and by every oscillator, at the instants of the roll."""
    step_s = max(min(_OF_READING * roll.period_s, _OF_PERIOD * float(_PERIODS_S[0])), _FINEST_S)
    at = roll.seconds_since(record.start_utc_ns)
    time = np.arange(min(at[0], 0.0), at[-1] + step_s, step_s)
    push = np.interp(time, record.time_s, record.speed_m_s) * _yaw_rate(record, time)
    # at rest in the mean: what came before is left to the wandering signal
    push = push - np.mean(push)
    if not np.ptp(push) > 0.0:
        return []
    before = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
    share = (at - time[before]) / step_s
    moved = [
        push,
        *(
            filtered(*oscillator(float(period), damping, step_s), push)
            for period in _PERIODS_S[2.0 * roll.period_s <= _PERIODS_S]
            for damping in _DAMPINGS
        ),
    ]
    return [course[before] + share * (course[before + 1] - course[before]) for course in moved]


def oscillator(period_s: float, damping: float, step_s: float) -> tuple[Float, Float]:
    """Return a damped oscillator as a filter of what pushes it, in straight lines between the instants.

    Parameters
    ----------
    period_s : float
        Natural period.
    damping : float
        Part of critical damping, below 1.

    Returns
    -------
    numerator, denominator : ndarray, shape (3,)
        As `filtered` takes them. A steady push comes out as it is.

    References
    ----------
    Franklin, Powell & Workman (1998), Digital Control of Dynamic Systems, 3rd ed., sect. 6.3.2: the triangle-hold
    equivalent, the second difference of the response to a ramp.
    """
    w = 2.0 * np.pi / period_s
    damped, t = w * np.sqrt(1.0 - damping**2), step_s * np.arange(4.0)
    swing = 2.0 * damping / w * np.cos(damped * t) + (2.0 * damping**2 - 1.0) / damped * np.sin(damped * t)
    ramp = t - 2.0 * damping / w + np.exp(-damping * w * t) * swing
    impulse = np.diff(np.concatenate([[0.0], ramp]), n=2) / step_s
    decay = np.exp(-damping * w * step_s)
    below = np.array([1.0, -2.0 * decay * np.cos(damped * step_s), decay**2])
    return np.convolve(impulse, below)[:3], below


def _yaw_rate(record: Record, time_s: Float) -> Float:
    """Return the yaw rate without its noise, rad/s: as it was measured, or of the heading."""
    yaw_rate, heading = (_measured(record, of) for of in ("yaw_rate", "heading"))
    if len(yaw_rate):
        rate = signal(yaw_rate).series
    elif len(heading) > 1:
        rate = heading_rate(heading)
    else:
        return np.zeros(time_s.size)
    result: Float = np.interp(time_s, rate.seconds_since(record.start_utc_ns), rate.value)
    return result


def _measured(record: Record, of: str) -> Series:
    column = record.measured[:, MEASUREMENTS.index(of)]
    known = np.isfinite(column)
    time_ns = record.start_utc_ns + np.round(record.time_s[known] * SECOND_NS).astype(np.int64)
    return Series(time_ns, column[known])
