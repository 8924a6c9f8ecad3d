"""Prediction some seconds ahead, with intervals: what the model promises of measurements it has not been given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.likelihood import Likelihood
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.schemas.confidence import NORMAL_95


@dataclass(frozen=True, eq=False)
class Ahead:
    """Predictions between half of a horizon and the whole of it ahead."""

    horizon_s: float
    #: error, std: Shape (n, 3). Measured less predicted and its standard deviation, columns
    #: `pipeline.estimate.record.record.MEASUREMENTS`; NaN where nothing was predicted so far ahead.
    error: Float
    std: Float

    def inside(self) -> dict[str, tuple[int, int]]:
        """Return how many measurements lie in their 95 % interval, and of how many."""
        found = {}
        for i, name in enumerate(MEASUREMENTS):
            good = np.isfinite(self.error[:, i])
            if good.any():
                within = np.abs(self.error[good, i]) < NORMAL_95 * self.std[good, i]
                found[name] = (int(np.count_nonzero(within)), int(np.count_nonzero(good)))
        return found


def predict_ahead(objective: Likelihood, theta: Float, horizon_s: float) -> Ahead:
    """Predict measurements up to some seconds ahead of the last one taken in.

    The filter takes measurements in for one horizon and goes without for the next, in turn, from two beginnings, so
    that every part of the record is predicted once. The parameters are those fitted to all of it: in sample.

    Parameters
    ----------
    theta : ndarray, shape (12,)
    horizon_s : float
        Positive.
    """
    time = objective.record.time_s
    error, std = np.full((time.size, 3), np.nan), np.full((time.size, 3), np.nan)
    for phase in range(2):
        cycle = np.floor(time / horizon_s).astype(np.int64)
        withheld = cycle % 2 == 1 - phase
        # the very first window must be taken in: the initial state is hardly known
        withheld &= cycle > 0
        since = time - cycle * horizon_s
        far = withheld & (since >= 0.5 * horizon_s)
        trace = objective.predict(theta, withheld)
        error[far] = trace.innovation[far]
        std[far] = np.sqrt(trace.variance[far])
    return Ahead(horizon_s, error, std)
