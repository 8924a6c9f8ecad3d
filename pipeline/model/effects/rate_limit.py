"""The rudder turns no faster than its steering engine can.

The parameter is the time that a radian takes, so that 0 is an engine without limit. The answer to a straight line
between two instants is exact: approach at the full rate, then the line itself, or the full rate again where the line
is too steep.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit


def rudder_course(time_s: Float, rudder_rad: Float, slowness: float) -> Float:
    """Return the rudder that follows its reading at a limited rate, and was there at the first instant.

    ``slowness``: time for one radian, s/rad.
    """
    chased: Float = _chased(np.ascontiguousarray(rudder_rad), np.diff(time_s) / slowness)
    return chased


@njit(cache=True, nogil=True)
def _chased(rudder, mosts):  # type: ignore[no-untyped-def]
    """Follow with at most so much a step; a step is one unit of time here, and a rate is an angle a step."""
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        most = mosts[k - 1]
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
