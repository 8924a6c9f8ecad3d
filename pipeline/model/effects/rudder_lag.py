"""First-order lag between the rudder reading and the rudder that the hull feels.

Between two instants the reading is a straight line, to which the response of a first-order lag is known exactly:
there is no error of integration that could pass for a lag of its own.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit


def rudder_course(time_s: Float, rudder_rad: Float, tau: float) -> Float:
    """Return the response of a first-order lag to the rudder, which stood still before the first instant.

    ``tau``: time constant, s.
    """
    followed: Float = _followed(np.ascontiguousarray(rudder_rad), np.diff(time_s) / tau)
    return followed


@njit(cache=True, nogil=True)
def _followed(rudder, ratios):  # type: ignore[no-untyped-def]
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        ratio = ratios[k - 1]
        behind = (rudder[k] - rudder[k - 1]) / ratio
        out[k] = rudder[k] - behind + (out[k - 1] - rudder[k - 1] + behind) * np.exp(-ratio)
    return out
