"""How constant the speed is after the second execute: the model takes it as known and slowly varying."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.zigzags.zigzag import SpeedConstancy


def speed_constancy(
    speed: Series | None, start_ns: int, first_ns: int, second_ns: int, end_ns: int
) -> SpeedConstancy | None:
    """Describe the speed from the second execute to the end.

    Parameters
    ----------
    speed : Series or None
        Speed through the water (or over ground), m/s.
    start_ns, first_ns, second_ns, end_ns : int
        Start of the approach, first and second execute, end of the zigzag, UTC nanoseconds.

    Returns
    -------
    SpeedConstancy or None
        None where fewer than two speeds were recorded after the second execute.
    """
    if speed is None:
        return None
    after = speed.between(second_ns, end_ns)
    if len(after) < 2:
        return None
    before = speed.between(start_ns, first_ns)
    mean = float(np.mean(after.value))
    seconds = after.seconds_since(second_ns)
    middle = seconds - np.mean(seconds)
    slope = float(np.sum(middle * (after.value - mean)) / np.sum(middle**2))
    change = slope * float(seconds[-1] - seconds[0])
    return SpeedConstancy(
        approach_m_s=float(np.mean(before.value)) if len(before) else None,
        mean_m_s=mean,
        std_m_s=float(np.std(after.value, ddof=1)),
        trend_percent=100.0 * change / mean if mean > 0 else float("nan"),
    )
