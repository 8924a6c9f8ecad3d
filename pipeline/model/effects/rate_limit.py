"""The rudder turns no faster than its steering engine can.

The parameter is the time that a radian takes, so that 0 is an engine without limit. The answer to a straight line
between two instants is exact: approach at the full rate, then the line itself, or the full rate again where the line
is too steep.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit


def rudder_course(time_s: Float, rudder_rad: Float, values: Float) -> Float:
    """Return the rudder that follows its reading at a limited rate, and was there at the first instant.

    Parameters
    ----------
    time_s, rudder_rad : ndarray, shape (n,)
        Evenly spaced; the rudder is linear between them.
    values : ndarray, shape (1,)
        Time for one radian, s/rad.

    Returns
    -------
    ndarray, shape (n,)
        What the hull feels, rad.
    """
    slowness, step = float(values[0]), float(time_s[1] - time_s[0]) if time_s.size > 1 else 0.0
    if not slowness > 0.0 or step == 0.0:
        return rudder_rad
    chased: Float = _chased(np.ascontiguousarray(rudder_rad), step / slowness)
    return chased


@njit(cache=True, nogil=True)
def _chased(rudder, most):  # type: ignore[no-untyped-def]
    """Follow with at most ``most`` a step; a step is one unit of time here, and a rate is an angle a step."""
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        rate, gap, place, left = rudder[k] - rudder[k - 1], rudder[k - 1] - out[k - 1], out[k - 1], 1.0
        if gap != 0.0:
            side = np.sign(gap)
            closing = most - side * rate
            if closing <= 0.0 or abs(gap) >= closing:
                out[k] = place + side * most
                continue
            met = abs(gap) / closing
            place, left = place + side * most * met, 1.0 - met
        out[k] = rudder[k] if abs(rate) <= most else place + np.sign(rate) * most * left
    return out
