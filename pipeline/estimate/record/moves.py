"""How often the rudder is put over, or the heading swings: the legs of a manoeuvre, counted."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float

#: readings that a median takes together against single spikes
_NEIGHBOURS = 5


def swing(values: Float) -> float:
    """Return how far values range, single spikes left out."""
    return float(np.ptp(_without_spikes(values)))


def moves(values: Float) -> int:
    """Count how often values go from one third of their range to the opposite one.

    The first departure from the middle counts too, so a zigzag of n legs has n.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Rudder or heading; single spikes do not count.

    Examples
    --------
    >>> moves(np.repeat([0.0, 20.0, -20.0, 20.0], 30))
    3
    >>> moves(np.repeat([0.0, 35.0], 30))
    1
    """
    values = _without_spikes(values)
    low, high = float(np.min(values)), float(np.max(values))
    third = (high - low) / 3.0
    side = np.where(values > high - third, 1, np.where(values < low + third, -1, 0))
    held = side[side != 0]
    return int(np.count_nonzero(np.diff(held))) + int(side[0] == 0 and held.size > 0)


def _without_spikes(values: Float) -> Float:
    if values.size < _NEIGHBOURS:
        return values
    smooth: Float = np.median(np.lib.stride_tricks.sliding_window_view(values, _NEIGHBOURS), axis=1)
    return smooth
