"""Angles that were unwrapped over a log, as a reader expects them: a heading of 812 deg is one of 92."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float


def within_a_turn(angle_rad: Float, by: Float | None = None) -> Float:
    """Return an angle whose first value is between 0 and a full turn; where it goes on from there is kept.

    Parameters
    ----------
    angle_rad : ndarray, shape (n,)
        NaN where there is none.
    by : ndarray, shape (n,), optional
        The angle whose first value decides, where it is another one.

    Examples
    --------
    >>> np.round(within_a_turn(np.array([14.0, 15.0])), 3)
    array([1.434, 2.434])
    """
    known = angle_rad[np.isfinite(angle_rad)] if by is None else by[np.isfinite(by)]
    turns = float(np.floor(known[0] / (2.0 * np.pi))) if known.size else 0.0
    result: Float = angle_rad - 2.0 * np.pi * turns
    return result
