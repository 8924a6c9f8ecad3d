"""What an error of each channel is measured in, so that channels and ships compare: the plain model's own errors.

Where a model lacks something its errors within a window belong together, and a window says one thing; where only white
noise is left, every reading speaks for itself. The errors' autocorrelation decides (Bayley & Hammersley 1946, "The
effective number of independent observations in an autocorrelated time series", Supplement to the JRSS 8).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.shooting import shooting_fit
from kempf.pipeline.shooting.reduced import Scales
from kempf.pipeline.shooting.shooting_fit import ShootingFit
from kempf.pipeline.shooting.shot_run import ShotRun

#: parts of the motion within a window to begin with, and rounds
_FIRST, _ROUNDS = 0.2, 3


def scaled(shots: Sequence[ShotRun], workers: Executor) -> ShootingFit:
    """Fit a plain model in units of its own errors, one leg ahead.

    Parameters
    ----------
    shots : sequence of ShotRun
        Without effects.
    """
    moved = np.concatenate([s.windows.measured - np.nan_to_num(s.windows.start)[s.windows.of_row] for s in shots])
    made = np.isfinite(moved).any(axis=0)
    spread = np.where(made, np.nanstd(np.where(made, moved, 0.0), axis=0), 1.0)
    scales = Scales(_FIRST * np.maximum(spread, 1e-12), np.ones(3))
    ship = shots[0].windows.run.ship
    fit, begin = None, None
    shared = mariner_like(ship.length_m).array()
    for _ in range(_ROUNDS):
        fit = shooting_fit.fit(shots, shared, scales, workers, begin)
        shared, begin = fit.shared, [part.at for part in fit.parts]
        errors = np.concatenate([part.errors for part in fit.parts])
        known = np.isfinite(errors).any(axis=0)
        mean = np.where(known, np.nanmean(np.where(known, errors, 0.0), axis=0), 1.0)
        scales = Scales(np.sqrt(np.maximum(mean, 1e-12)) * scales.error, np.ones(3))
    assert fit is not None
    scales = Scales(scales.error, _independent(fit))
    return shooting_fit.fit(shots, shared, scales, workers, begin)


def _independent(fit: ShootingFit) -> Float:
    """Return how many errors of a window are independent of each other, by channel, shape (3,)."""
    errors = []
    for shot, part in zip(fit.shots, fit.parts, strict=True):
        predicted = shot.predicted(part.at.shared[:, None], part.at.own[:, None], part.at.starts[..., None])[..., 0]
        left = shot.windows.measured - predicted
        errors += [left[shot.windows.of_row == w] for w in range(shot.windows.begins.size)]
    length = max(error.shape[0] for error in errors)
    result = np.ones(3)
    for i in range(3):
        products, counts = np.zeros(length), np.zeros(length)
        for error in errors:
            made = np.isfinite(error[:, i])
            filled = np.where(made, error[:, i], 0.0)
            n = filled.size
            products[:n] += np.correlate(filled, filled, "full")[n - 1 :]
            counts[:n] += np.correlate(made.astype(float), made.astype(float), "full")[n - 1 :]
        if products[0] <= 0.0:
            continue
        correlation = products / np.maximum(counts, 1.0) / (products[0] / counts[0])
        negative = np.flatnonzero(correlation <= 0.0)
        first = int(negative[0]) if negative.size else length
        result[i] = max(1.0, counts[0] / len(errors) / (1.0 + 2.0 * float(np.sum(correlation[1:first]))))
    return result
