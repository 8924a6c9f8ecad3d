"""Play between the rudder's sensor and the rudder: hysteresis."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit


def rudder_course(time_s: Float, rudder_rad: Float, width: float) -> Float:
    """Return the rudder behind a play, in whose middle it was at the first instant.

    ``width``: whole width of the play, rad.
    """
    course: Float = _taken(np.ascontiguousarray(rudder_rad), 0.5 * width)
    return course


@njit(cache=True, nogil=True)
def _taken(rudder, half):  # type: ignore[no-untyped-def]
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        out[k] = min(max(out[k - 1], rudder[k] - half), rudder[k] + half)
    return out
