"""Positions on the earth's ellipsoid as metres on a plane."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float

#: Semi-major axis of the earth, m (WGS 84).
EARTH_M = 6378137.0
#: Square of its eccentricity.
_EARTH_E2 = 6.69437999014e-3


def plane(latitude: Float, longitude: Float) -> tuple[Float, Float]:
    """Return metres to north and east of the first position, by the radii of curvature there.

    Parameters
    ----------
    latitude, longitude : ndarray, shape (n,)
        Radians; the longitude does not leap by a full turn.

    Returns
    -------
    (ndarray, ndarray), shape (n,)
    """
    w = 1.0 - _EARTH_E2 * np.sin(latitude[0]) ** 2
    meridian, across = EARTH_M * (1.0 - _EARTH_E2) / w**1.5, EARTH_M / np.sqrt(w)
    north = (latitude - latitude[0]) * meridian
    return north, (longitude - longitude[0]) * across * np.cos(latitude[0])
