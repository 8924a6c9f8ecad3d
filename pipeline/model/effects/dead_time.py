"""A dead time between the rudder reading and the rudder that the hull feels."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float


def rudder_course(time_s: Float, rudder_rad: Float, values: Float) -> Float:
    """Return the rudder some time ago; before the first instant it stood still.

    Parameters
    ----------
    time_s, rudder_rad : ndarray, shape (n,)
        Evenly spaced; the rudder is linear between them.
    values : ndarray, shape (1,)
        Dead time, s.

    Returns
    -------
    ndarray, shape (n,)
        What the hull feels, rad.
    """
    late = float(values[0])
    if not late > 0.0:
        return rudder_rad
    shifted: Float = np.interp(time_s - late, time_s, rudder_rad)
    return shifted
