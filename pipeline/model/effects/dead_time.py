"""A dead time between the rudder reading and the rudder that the hull feels."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float


def rudder_course(time_s: Float, rudder_rad: Float, late: float) -> Float:
    """Return the rudder some time ago; before the first instant it stood still.

    ``late``: dead time, s.
    """
    shifted: Float = np.interp(time_s - late, time_s, rudder_rad)
    return shifted
