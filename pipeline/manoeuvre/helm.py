"""What lies between the rudder's reading and the hull, step by step: the rudder courses of effects in a closed loop.

`pipeline.model.effects` maps a whole course of the rudder, which a helmsman who watches the heading has not got yet.
Here the same four answers go on from one instant to the next, along a straight line of what goes in.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, njit
from kempf.schemas.effect import RudderCourse

BACKLASH, DEAD_TIME, RATE_LIMIT, RUDDER_LAG = 0, 1, 2, 3
KINDS: dict[RudderCourse, int] = {
    "backlash": BACKLASH,
    "dead_time": DEAD_TIME,
    "rate_limit": RATE_LIMIT,
    "rudder_lag": RUDDER_LAG,
}


@njit(**FILLING)
def pass_through(before, after, h, t, kinds, sizes, out, gone, past, held):  # type: ignore[no-untyped-def]
    """Return the rudder that the hull feels after a step in which its reading went from ``before`` to ``after``.

    Parameters
    ----------
    before, after : float
        Reading, rad.
    h, t : float
        Length of the step, s, and the instant at its end.
    kinds, sizes : ndarray, shape (m,)
        Parts in their order, and the size of each; 0 is absent.
    out, gone : ndarray, shape (m,)
        What each part gave before, and gives now (filled).
    past : ndarray, shape (2 m, k)
        Of each part: instants and what went in, of which a dead time needs the past.
    held : int
        How many of them there are.
    """
    for i in range(kinds.size):
        size, last = sizes[i], out[i]
        gone[i] = after
        if size > 0.0 and h > 0.0:
            if kinds[i] == RUDDER_LAG:
                # the response to a straight line is exact
                behind = (after - before) * size / h
                gone[i] = after - behind + (last - before + behind) * np.exp(-h / size)
            elif kinds[i] == BACKLASH:
                gone[i] = min(max(last, after - 0.5 * size), after + 0.5 * size)
            elif kinds[i] == RATE_LIMIT:
                gone[i] = last + min(max(after - last, -h / size), h / size)
            else:
                gone[i] = _earlier(t - size, t, after, past[2 * i], past[2 * i + 1], held)
        elif size > 0.0:
            gone[i] = last
        before, after = last, gone[i]
    return after


@njit(**FILLING)
def _earlier(wanted, now, value, times, values, held):  # type: ignore[no-untyped-def]
    """Return what went in at an earlier instant, linear between those that are held and now."""
    if wanted <= times[0]:
        return values[0]
    k = held - 1
    while times[k] > wanted:
        k -= 1
    end, at = (times[k + 1], values[k + 1]) if k + 1 < held else (now, value)
    if end <= times[k]:
        return at
    return values[k] + (at - values[k]) * (wanted - times[k]) / (end - times[k])
