"""How well an estimate explains the segment it was fitted to: one step ahead, in sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.schemas.confidence import NORMAL_95

#: a prediction counts when its variance is below this many times the median one
_SETTLED = 3.0


def fit_percent(measured: Float, error: Float) -> float:
    """Return 100 (1 - |y - y^| / |y - mean y|), as MATLAB's ``compare`` defines it.

    Parameters
    ----------
    measured, error : ndarray, shape (n,)
        y and y - y^.

    Examples
    --------
    >>> fit_percent(np.array([0.0, 2.0]), np.array([0.0, 0.0]))
    100.0
    """
    spread = float(np.linalg.norm(measured - np.mean(measured)))
    return float(100.0 * (1.0 - np.linalg.norm(error) / spread)) if spread > 0 else float("nan")


def one_step_fit(measured: Float, innovation: Float, variance: Float) -> dict[str, Any]:
    """Summarise the innovations of the fitted model.

    Parameters
    ----------
    measured : ndarray, shape (n, 3)
        What the model was fitted to.
    innovation, variance : ndarray, shape (n, 3)
        One-step prediction errors and their variances, NaN where not measured.

    Returns
    -------
    dict
        Horizon and sample named; for each measurement rms (SI), fit %, number of values, the lag-1 autocorrelation of
        the whitened innovations (0 for a model that lacks nothing) and the share inside the 95 % prediction interval;
        without the first predictions, until their variance has settled (``settling`` of them).
    """
    channels: dict[str, Any] = {}
    for i, name in enumerate(MEASUREMENTS):
        good = np.isfinite(innovation[:, i])
        count = int(np.count_nonzero(good))
        # the first predictions only carry how little was known of the initial state
        good[good] = variance[good, i] < _SETTLED * np.median(variance[good, i]) if good.any() else False
        if np.count_nonzero(good) < 3:
            continue
        e, white = innovation[good, i], innovation[good, i] / np.sqrt(variance[good, i])
        channels[name] = {
            "rms": float(np.sqrt(np.mean(e**2))),
            "fit_percent": fit_percent(measured[good, i], e),
            "n": int(e.size),
            "settling": count - int(e.size),
            "lag1_autocorrelation": float(np.sum(white[1:] * white[:-1]) / np.sum(white**2)),
            "inside_95_percent": float(np.mean(np.abs(white) < NORMAL_95)),
        }
    return {"horizon": "one step", "sample": "in sample", "channels": channels}
