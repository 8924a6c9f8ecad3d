"""Play between the rudder's sensor and the rudder: hysteresis."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit


def rudder_course(time_s: Float, rudder_rad: Float, values: Float) -> Float:
    """Return the rudder behind a play, in whose middle it was at the first instant.

    Parameters
    ----------
    time_s, rudder_rad : ndarray, shape (n,)
        Evenly spaced; the rudder is linear between them.
    values : ndarray, shape (1,)
        Whole width of the play, rad.

    Returns
    -------
    ndarray, shape (n,)
        What the hull feels, rad.
    """
    width = float(values[0])
    if not width > 0.0 or time_s.size == 0:
        return rudder_rad
    taken: Float = _taken(np.ascontiguousarray(rudder_rad), 0.5 * width)
    return taken


@njit(cache=True, nogil=True)
def _taken(rudder, half):  # type: ignore[no-untyped-def]
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        out[k] = min(max(out[k - 1], rudder[k] - half), rudder[k] + half)
    return out
