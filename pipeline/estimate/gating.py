"""Gross errors: measurements that no noise of the instrument explains, taken out before they bend the estimate.

A gate on the whitened innovations of the fitted model, in robust units: their median absolute deviation, which the
gross errors themselves do not move. See Huber & Ronchetti (2009), Robust Statistics, ch. 1. What a model lacks shows as
long misfits, and these stay: a gross error has a sound neighbour.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.robust_std import robust_std
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.record import MEASUREMENTS, Instants

#: share of the gate's width within which one neighbour of a gross error must lie
_SOUND = 0.7


@dataclass(frozen=True, eq=False)
class Gated:
    """A record without its gross errors."""

    #: With NaN where a measurement was taken out.
    record: Instants
    #: How many, by measurement; only where there are some.
    taken_out: dict[str, int]
    #: Measurements of which so many lie outside the gate that these are no gross errors; all of them were kept.
    heavy: tuple[str, ...]


def gate(record: Instants, innovation: Float, variance: Float, width: float, largest_share: float) -> Gated:
    """Take out the measurements whose innovation lies outside the gate.

    Parameters
    ----------
    record : Instants
        What the model was fitted to.
    innovation, variance : ndarray, shape (n, 3)
        One-step prediction errors and their variances, NaN where not measured.
    width : float
        Half width of the gate in robust standard deviations.
    largest_share : float
        A larger share outside the gate means that the model is wrong, not the measurements: nothing is taken out.
    """
    measured = record.measured.copy()
    taken_out: dict[str, int] = {}
    heavy: list[str] = []
    for i, name in enumerate(MEASUREMENTS):
        rows = np.flatnonzero(np.isfinite(innovation[:, i]))
        if rows.size == 0:
            continue
        white = innovation[rows, i] / np.sqrt(variance[rows, i])
        spread = robust_std(white)
        size = np.abs(white) / max(spread, 1.0)
        sound = np.minimum(np.roll(size, 1), np.roll(size, -1)) < _SOUND * width
        outside = rows[(size > width) & sound]
        if outside.size > largest_share * rows.size:
            heavy.append(name)
        elif outside.size > 0:
            measured[outside, i] = np.nan
            taken_out[name] = int(outside.size)
    return Gated(replace(record, measured=measured), taken_out, tuple(heavy))
