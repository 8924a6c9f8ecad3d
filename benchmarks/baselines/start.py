"""Where the baselines begin: Mariner-like ships of all lengths, as the default estimator does."""

from __future__ import annotations

import numpy as np

from benchmarks.baselines.step import innovations
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.classical.resample import step_of
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.model_spec import HULL_PARAMETERS

#: lengths whose Mariner-like ship is tried, m: the ladder of the default estimator
LENGTHS_M = tuple(float(f"{1.5 * 1.6**k:.4g}") for k in range(12))


def ranked_starts(record: Record) -> list[tuple[float, Float]]:
    """Return the ships that stay bounded, the one first that simulates the record best.

    Parameters
    ----------
    record : Record
        At equal steps.

    Returns
    -------
    list of (float, ndarray of shape (6,))
        Length, m, and hull; ranked by the product of the two mean squared simulation errors, their means taken off:
        no unit weighs, and no constant disturbance decides.
    """
    measured = np.ascontiguousarray(record.measured[:, :2])
    found = []
    for length in LENGTHS_M:
        hull = mariner_like(length).array()
        e = np.empty_like(measured)
        if innovations(
            hull, np.zeros((2, 2)), np.zeros(2), step_of(record), record.speed_m_s, record.rudder_rad, measured, e
        ):
            found.append((float(np.prod(np.var(e, axis=0))), length, hull))
    found.sort(key=lambda entry: entry[:2])
    return [(length, hull) for _, length, hull in found]


def named(hull: Float) -> dict[str, float]:
    """Return the six parameters by name."""
    return dict(zip(HULL_PARAMETERS, (float(p) for p in hull), strict=True))
