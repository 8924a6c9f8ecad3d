"""Readings that leap away and are back a reading or two later, as nothing moves: dropouts of a sensor."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.robust_std import MAD_TO_STD
from kempf.pipeline.channels.series import Float, Mask, Series
from kempf.schemas.channels import CHANNELS
from kempf.schemas.instants import written
from kempf.schemas.units import SECOND_NS, as_read

#: readings on either side of one: a leap of up to so many is none of their median
_BESIDE = 2
#: in so long, s, a ship can turn and a rudder be put over and back: what takes longer is no leap
_BRIEF_S = 10.0
#: times the farthest that the rest of the channel goes from one reading to the next, and robust standard deviations
_FARTHER, _SPREADS = 4.0, 8.0
#: the channels of which leaps are looked for, and what cannot have made them
LEAPING = {"yaw_rate": "no ship turns", "rudder_angle": "no steering gear moves"}
#: what does go away and back in a log without hard manoeuvres: rad and rad a second for a rudder, which SOLAS II-1/29
#: wants to move by 2.3 deg/s and faster ones move by four times that, rad/s for a ship
_GEAR_RAD, _GEAR_RAD_S, _TURN_RAD_S = np.deg2rad(5.0), np.deg2rad(10.0), np.deg2rad(1.0)


def leaps(series: Series, name: str) -> Mask:
    """Find readings that are away and back as the rest of the channel shows that it cannot be.

    What the channel follows is the running median of five readings, which a leap of one or two leaves alone. The
    farthest that it goes from one reading to the next is what a ship or a steering gear does; a leap goes several
    times as far, and back. Where that would be the whole range of the channel, the readings do not show its motion, as
    those of an order that jumps or of a slow log, and nothing can be said.

    Parameters
    ----------
    series : Series
        The channel.
    name : str
        Which one, of `LEAPING`.

    Returns
    -------
    ndarray of bool, shape (n,)

    References
    ----------
    Tukey (1977), Exploratory data analysis, Addison-Wesley, ch. 7: the running median.

    Examples
    --------
    >>> time = np.arange(300)
    >>> rate = np.sin(time / 20.0)
    >>> rate[[100, 101, 222]] = -16.6
    >>> np.flatnonzero(leaps(Series(time * 1_000_000_000, rate), "yaw_rate")).tolist()
    [100, 101, 222]
    """
    found = np.zeros(len(series), dtype=np.bool_)
    if len(series) <= 2 * _BESIDE or (_BESIDE + 1) * series.period_s > _BRIEF_S:
        return found
    followed = _running_median(series.value)
    away = np.abs(series.value[_BESIDE:-_BESIDE] - followed)
    gone = np.abs(np.diff(followed))
    # beside a leap the median makes up for what it missed of a motion: no step of the channel itself
    own = np.maximum(away[1:], away[:-1]) <= gone
    farthest = _FARTHER * float(np.max(gone, initial=0.0, where=own))
    if farthest == 0.0 or farthest > float(np.ptp(followed)):
        return found
    usual = _TURN_RAD_S if name == "yaw_rate" else max(_GEAR_RAD, _GEAR_RAD_S * series.period_s)
    limit = max(farthest, _SPREADS * MAD_TO_STD * float(np.median(away)), usual)
    at = np.flatnonzero(away > limit) + _BESIDE
    # across a gap anything may have happened
    step = np.diff(series.time_utc_ns)
    longest = np.max([step[at + k] for k in range(-_BESIDE, _BESIDE)], axis=0, initial=0)
    found[at[longest <= gap_limit_s(series) * SECOND_NS]] = True
    return found


def _running_median(value: Float) -> Float:
    """Return the median of every five values that follow each other, shape (n - 4,), without a copy for each."""
    a, b, c, d, e = (value[k : value.size - 2 * _BESIDE + k] for k in range(2 * _BESIDE + 1))
    # the least and the largest of the first four cannot be the median of five, nor can those of what is left
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    middle: Float = np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), e))
    return middle


def counted(name: str, count: int) -> str:
    """Return how many readings of a channel were left out, and why, in words.

    Examples
    --------
    >>> counted("yaw_rate", 1)
    '1 reading of yaw_rate left out: it leaps away and back as no ship turns'
    """
    return (
        f"1 reading of {name} left out: it leaps away and back as {LEAPING[name]}"
        if count == 1
        else f"{count} readings of {name} left out: they leap away and back as {LEAPING[name]}"
    )


def said(name: str, series: Series, found: Mask) -> str:
    """Return how many readings of a channel leap, with the first of them, in one sentence."""
    first = int(np.argmax(found))
    factor, unit = as_read(CHANNELS[name].unit)
    shown = f"{factor * series.value[first]:.4g} {unit} at {written(series.time_utc_ns[first])}"
    return f"{counted(name, int(np.count_nonzero(found)))}; the first is {shown}"
