"""When the rudder starts to move and when it is over: the two ends of the ramp between two held angles.

A rudder sampled at 1 Hz moves several degrees between two samples, so the first sample that moved is late by up to a
second. The start is where the straight line through the moving samples meets the angle held before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float

#: Part of the movement through which the line is laid: the end of it is bent where the servo slows down.
_FIT_UP_TO = 0.7


@dataclass(frozen=True)
class Ramp:
    """One movement of the rudder."""

    #: start_s, end_s: Instants at which it leaves the angle held before and arrives at the one held after, s.
    start_s: float
    end_s: float
    #: Half the interval that the samples leave open, s.
    start_uncertainty_s: float
    #: held_before, held_after: The two angles, rad.
    held_before: float
    held_after: float
    #: Rudder rate along the fitted line, rad/s; NaN where fewer than two samples lie on the ramp.
    rate: float


def measure_ramp(
    time_s: Float,
    rudder: Float,
    first_held: int,
    *,
    held_after: float,
    held_before: float,
    earliest: int,
    noise: float,
    known_rate: float = float("nan"),
) -> Ramp | None:
    """Measure the ramp that ends where a leg begins.

    Parameters
    ----------
    time_s, rudder : ndarray, shape (n,)
        Samples, s and rad.
    first_held : int
        First held sample after the ramp.
    held_after, held_before : float
        Angle held after the ramp, and a first guess of the one before, rad.
    earliest : int
        First sample that may belong to what came before the ramp.
    noise : float
        Standard deviation of the rudder's noise, rad.
    known_rate : float, optional
        Rate of the steering gear, rad/s, used where the samples on the ramp are too few to determine it.

    Returns
    -------
    Ramp or None
        None where no sample before the ramp exists: the log begins with the rudder over.
    """
    before = held_before
    resting = None
    for _ in range(6):
        resting = _last_resting(rudder, earliest, first_held, before=before, after=held_after, noise=noise)
        if resting is None:
            # the guess lies beyond all samples: start from the sample farthest away from the leg
            window = rudder[earliest : first_held + 1]
            farthest = float(window[np.argmax(np.abs(window - held_after))])
            if abs(farthest - before) < 1e-12:
                return None
            before = farthest
            continue
        spell = max(time_s[first_held] - time_s[resting], 4 * _step(time_s, resting))
        begin = max(int(np.searchsorted(time_s, time_s[resting] - spell)), earliest)
        refined = float(np.median(rudder[begin : resting + 1]))
        if abs(refined - before) <= 1e-9:
            break
        before = refined
    if resting is None or resting >= first_held:
        return None
    if abs(held_after - before) <= max(6.0 * noise, 0.2 * abs(held_after)):
        return None
    return _fit(
        time_s, rudder, resting, first_held, before=before, after=held_after, noise=noise, known_rate=known_rate
    )


def _step(time_s: Float, index: int) -> float:
    after = min(index + 1, time_s.size - 1)
    return float(time_s[after] - time_s[after - 1])


def _last_resting(
    rudder: Float, earliest: int, first_held: int, *, before: float, after: float, noise: float
) -> int | None:
    """Return the last sample before the leg that has not left the angle held before."""
    travel = after - before
    if travel == 0:
        return None
    left = (rudder[earliest:first_held] - before) / travel
    threshold = max(3.0 * noise / abs(travel), 0.02)
    resting = np.flatnonzero(left <= threshold)
    return earliest + int(resting[-1]) if resting.size else None


def _fit(
    time_s: Float,
    rudder: Float,
    resting: int,
    first_held: int,
    *,
    before: float,
    after: float,
    noise: float,
    known_rate: float,
) -> Ramp:
    """Lay the line through the moving samples and cut it with both held angles."""
    travel = after - before
    moved = np.arange(resting + 1, first_held + 1)
    share = (rudder[moved] - before) / travel
    on_ramp = moved[share <= _FIT_UP_TO]
    low = float(time_s[max(resting - 1, 0)])
    high = float(time_s[resting + 1])
    rate, open_s = float("nan"), (high - float(time_s[resting])) / 2
    if on_ramp.size >= 2:
        rate = float(np.polyfit(time_s[on_ramp] - high, rudder[on_ramp], 1)[0])
    if on_ramp.size < 2 or rate * travel <= 0:
        rate = known_rate if known_rate * travel > 0 else -known_rate
        if on_ramp.size and np.isfinite(rate):
            start = float(time_s[on_ramp[0]]) - (float(rudder[on_ramp[0]]) - before) / rate
        else:
            start = (float(time_s[resting]) + high) / 2
        low = float(time_s[resting])
    else:
        middle = float(np.mean(time_s[on_ramp]))
        start = middle - (float(np.mean(rudder[on_ramp])) - before) / rate
        open_s = min(open_s, max(noise / abs(rate), 1e-3))
    start = float(np.clip(start, low, high))
    end = float(time_s[first_held])
    if np.isfinite(rate) and rate != 0:
        end = float(np.clip(start + travel / rate, high, max(end, high)))
    return Ramp(start, max(end, start), open_s, before, after, rate)


def approach_before(
    time_s: Float, rudder: Float, first_held: int, *, held_after: float, earliest: int, noise: float, rate: float
) -> tuple[int, float]:
    """Find the rudder of the approach, going back from the first leg for as long as the rudder moves at its full rate.

    An autopilot moves the rudder too, but slowly: what it held just before the execute is looked for.

    Parameters
    ----------
    time_s, rudder : ndarray, shape (n,)
        Samples, s and rad.
    first_held : int
        First held sample of the leg.
    held_after : float
        Angle of the leg, rad.
    earliest : int
        How far back to look.
    noise : float
        Standard deviation of the rudder's noise, rad.
    rate : float
        Rate of the steering gear, rad/s, positive; NaN where it is too quick to be sampled.

    Returns
    -------
    int
        First sample of the stretch just before the movement.
    float
        Its rudder angle, rad.
    """
    step = float(np.median(np.diff(time_s[earliest : first_held + 1]))) if first_held > earliest else 0.0
    back = max(2.5 * step, 10.0 * noise / rate) if np.isfinite(rate) else step
    index = first_held
    while index > earliest:
        before = max(int(np.searchsorted(time_s, time_s[index] - back)), earliest)
        before = min(before, index - 1)
        slope = (rudder[index] - rudder[before]) / (time_s[index] - time_s[before])
        share = 0.3 * rate if np.isfinite(rate) else 0.1 * abs(held_after) / max(step, 1e-9)
        if abs(slope) < share and abs(rudder[index] - held_after) > 0.15 * abs(held_after):
            break
        index -= 1
    spell = max(time_s[first_held] - time_s[index], 4 * step)
    begin = max(int(np.searchsorted(time_s, time_s[index] - spell)), earliest)
    return begin, float(np.median(rudder[begin : index + 1]))
