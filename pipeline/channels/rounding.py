"""How coarse a channel is."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Series


def rounding_std(series: Series) -> float:
    """Return the standard deviation of the rounding of a channel that mostly repeats itself; 0 of any other."""
    steps = np.abs(np.diff(series.value))
    if not np.mean(steps == 0.0) > 0.5:
        return 0.0
    least = float(np.min(steps[steps > 0.0], initial=np.inf))
    return least / np.sqrt(12.0) if np.isfinite(least) else 0.0
