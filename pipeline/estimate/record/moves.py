"""How often the rudder is put over, or the heading swings: the legs of a manoeuvre, counted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    return int(moved(values)[-1])


def moved(values: Float) -> NDArray[np.int64]:
    """Count the same up to every value, shape (n,).

    Examples
    --------
    >>> moved(np.repeat([0.0, 20.0, -20.0, 20.0], 30))[[0, 45, 75, 105]]
    array([0, 1, 2, 3])
    """
    smooth = _without_spikes(values)
    low, high = float(np.min(smooth)), float(np.max(smooth))
    third = (high - low) / 3.0
    side = np.where(smooth > high - third, 1, np.where(smooth < low + third, -1, 0))
    held = np.flatnonzero(side)
    steps = np.zeros(smooth.size, dtype=np.int64)
    steps[held[1:]] = np.diff(side[held]) != 0
    if held.size:
        steps[held[0]] = side[0] == 0
    counted = np.cumsum(steps)
    lost = values.size - smooth.size
    before = np.full(lost // 2, counted[0])
    return np.concatenate([before, counted, np.full(lost - lost // 2, counted[-1])])


def _without_spikes(values: Float) -> Float:
    if values.size < _NEIGHBOURS:
        return values
    smooth: Float = np.median(np.lib.stride_tricks.sliding_window_view(values, _NEIGHBOURS), axis=1)
    return smooth
