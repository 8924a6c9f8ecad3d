"""What the intervals of a model miss of the ship's own zigzags, and how much wider they have to be.

A covariance knows of noise. That a model bends a turn otherwise than the ship does shows where it has to predict what
was measured: in the overshoots of her own zigzags, closed loop, each in its own wind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float

#: to which an overshoot is measured, deg
READ_DEG = 0.1
#: fewer overshoots say nothing
FEWEST = 4
#: half the width of a 95 % interval in standard errors; median of the square of a standard normal number
_HALF, _MEDIAN = 1.96, 0.4549


@dataclass(frozen=True)
class OwnZigzags:
    """How well a model predicts the zigzags of its ship."""

    zigzags: int
    overshoots: int
    #: How many lie in their interval before it is widened.
    inside: int
    #: Root mean square of measured less predicted, deg; NaN where there are none.
    rms_deg: float
    #: By which intervals are widened about their value, at least 1.
    factor: float

    @property
    def sentence(self) -> str:
        """Say it."""
        if self.overshoots < FEWEST:
            return "too few zigzags of her own to hold the intervals against"
        said = (
            f"her own {self.zigzags} zigzags: {self.inside} of {self.overshoots} first and second overshoots in their "
            f"interval, {self.rms_deg:.2g} deg rms off"
        )
        return f"{said}; intervals widened {self.factor:.1f} times for it" if self.factor > 1.0 else said


def own_zigzags(overshoots: Float, zigzags: int) -> OwnZigzags:
    """Return what the intervals miss.

    Parameters
    ----------
    overshoots : ndarray, shape (n, 4)
        Measured, predicted, and the ends of the prediction's 95 % interval, deg.
    zigzags : int
        How many they are of.

    Examples
    --------
    >>> made = own_zigzags(np.array([[10.0, 11.0, 10.8, 11.2]] * 4), 2)
    >>> made.inside, made.rms_deg, round(made.factor)
    (0, 1.0, 10)
    """
    off = overshoots[:, 0] - overshoots[:, 1]
    std = np.hypot((overshoots[:, 3] - overshoots[:, 2]) / (2.0 * _HALF), READ_DEG)
    factor = 1.0
    if len(off) >= FEWEST:
        # the median: one that was broken off or gusted upon is no misfit of the model
        factor = max(1.0, float(np.sqrt(np.median((off / std) ** 2) / _MEDIAN)))
    inside = int(np.sum((overshoots[:, 2] <= overshoots[:, 0]) & (overshoots[:, 0] <= overshoots[:, 3])))
    rms = float(np.sqrt(np.mean(off**2))) if len(off) else float("nan")
    return OwnZigzags(zigzags, len(off), inside, rms, factor)
