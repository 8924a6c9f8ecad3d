"""What the intervals of a model miss of the ship's own zigzags, and the scatter of its parameters that accounts for it.

A covariance knows of noise. That a model bends a turn otherwise than the ship does shows where it has to predict what
was measured: in the overshoots of her own zigzags, closed loop, each as it began and in its own wind. What is missed is
put into the parameters: each of them differs from manoeuvre to manoeuvre by the same share of its size, so that every
figure of every manoeuvre is as uncertain as what it depends on makes it (Sargsyan, Huan & Najm 2019, "Embedded model
error representation for Bayesian model calibration", International Journal for Uncertainty Quantification 9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.distributions import binomial_up_to
from kempf.schemas.confidence import NORMAL_95

#: to which an overshoot is measured, deg
READ_DEG = 0.1
#: fewer overshoots say nothing
FEWEST = 4
#: share of the parameters' size by which they scatter where its effect on the overshoots is looked at; the largest one
REFERENCE, MOST = 0.03, 0.25
#: median of the square of a standard normal number
_MEDIAN = 0.4549
#: so improbable is no chance
_CHANCE = 0.01
_HALVINGS = 40


@dataclass(frozen=True)
class OwnZigzags:
    """How well a model predicts the zigzags of its ship."""

    zigzags: int
    overshoots: int
    #: How many lie in the interval that the errors alone give.
    inside: int
    #: Root mean square of measured less predicted, deg; NaN where there are none.
    rms_deg: float
    #: Share of their size by which the parameters scatter beside their errors.
    scatter: float = 0.0
    #: The same before the parameters were brought to the overshoots of the fitted ones; None where they were not.
    before: OwnZigzags | None = None

    @property
    def sentence(self) -> str:
        """Say it."""
        if self.overshoots < FEWEST:
            return "too few zigzags of her own to hold the intervals against"
        words = (
            f"her own {self.zigzags} zigzags: intervals of the errors alone hold {self.inside} of {self.overshoots} "
            f"first and second overshoots, {self.rms_deg:.2g} deg rms off"
        )
        if self.before is not None:
            words = (
                f"{words}, after the parameters were brought to the fitted ones ({self.before.rms_deg:.2g} deg before)"
            )
        if self.scatter <= 0.0:
            return words
        most = ", the most that is tried" if self.scatter >= MOST else ""
        return (
            f"{words}; so the intervals shown let every parameter scatter by {100.0 * self.scatter:.2g} % of its size "
            f"beside its error{most}"
        )


def held_against(overshoots: Float, zigzags: int) -> OwnZigzags:
    """Return what the intervals of the errors miss.

    Parameters
    ----------
    overshoots : ndarray, shape (n, 4)
        Measured, predicted, and the ends of the prediction's 95 % interval, deg.
    zigzags : int
        How many they are of.

    Examples
    --------
    >>> made = held_against(np.array([[10.0, 11.0, 10.8, 11.2]] * 4), 2)
    >>> made.inside, made.rms_deg
    (0, 1.0)
    """
    off = overshoots[:, 0] - overshoots[:, 1]
    inside = int(np.sum((overshoots[:, 2] <= overshoots[:, 0]) & (overshoots[:, 0] <= overshoots[:, 3])))
    rms = float(np.sqrt(np.mean(off**2))) if len(off) else float("nan")
    return OwnZigzags(zigzags, len(off), inside, rms)


def missed(overshoots: Float) -> bool:
    """Return whether the intervals hold fewer overshoots than chance lets those that are right hold."""
    if len(overshoots) < FEWEST:
        return False
    off, half = overshoots[:, 0] - overshoots[:, 1], 0.5 * (overshoots[:, 3] - overshoots[:, 2])
    inside = int(np.sum(np.abs(off) <= np.hypot(half, NORMAL_95 * READ_DEG)))
    return binomial_up_to(inside, len(off), 0.95) < _CHANCE


def scatter(overshoots: Float, scattered: Float) -> float:
    """Return the share by which the parameters scatter where the errors alone hold too few overshoots.

    Parameters
    ----------
    overshoots : ndarray, shape (n, 4)
        As `held_against` takes them.
    scattered : ndarray, shape (n, 4)
        The same of ships that scatter by `REFERENCE` and have no other error.
    """
    if len(overshoots) < FEWEST or _misfit(overshoots, np.zeros(len(overshoots))) <= 1.0:
        return 0.0
    variance = ((scattered[:, 3] - scattered[:, 2]) / (2.0 * NORMAL_95 * REFERENCE)) ** 2
    low, high = 0.0, MOST
    if _misfit(overshoots, high**2 * variance) > 1.0:
        return MOST
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _misfit(overshoots, middle**2 * variance) > 1.0 else (low, middle)
    return high


def _misfit(overshoots: Float, more: Float) -> float:
    """Return the square of what is missed, in that of the errors with some variance more, 1 where they fit."""
    off = overshoots[:, 0] - overshoots[:, 1]
    variance = ((overshoots[:, 3] - overshoots[:, 2]) / (2.0 * NORMAL_95)) ** 2 + READ_DEG**2 + more
    # the median: one that was broken off or gusted upon is no misfit of the model
    return float(np.median(off**2 / variance) / _MEDIAN)
