"""Added-variable plots: what is left of the innovations against what an effect would explain of them.

Both without what the fitted parameters can imitate, so that the slope of the one over the other is the score's estimate
of the effect (Cook & Weisberg 1982, "Residuals and influence in regression", section 2.3.2).
"""

from __future__ import annotations

from concurrent.futures import Executor
from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.nuisance import nuisance
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.screening.speed_noise import speed_noise
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.diagnosis_evidence import AddedVariable
from kempf.schemas.model_spec import N_HULL

_BINS = 14


def added_variables(diagnosis: Diagnosis, workers: Executor) -> tuple[AddedVariable, ...]:
    """Return one for every effect that was added; with none, for the strongest candidate.

    Parameters
    ----------
    workers : Executor
        Runs share it; nothing depends on it.
    """
    steps = diagnosis.steps
    pairs = [(before.fit, step.chosen_from[0][0]) for before, step in pairwise(steps)]
    if not pairs:
        pairs = [(steps[0].fit, candidate) for candidate in steps[0].screened if candidate.direction.size][:1]
    return tuple(_added_variable(fit, candidate, workers) for fit, candidate in pairs)


def _added_variable(fit: PooledFit, candidate: Candidate, workers: Executor) -> AddedVariable:
    known = nuisance(speed_noise(fit, workers).of(fit).linearised, N_HULL + len(fit.model.names))
    cleaned = known.clean(known.u[:, None])[:, 0]
    # the second half of each run's part is about the spread of the innovations, not about themselves
    about_mean = np.concatenate([np.arange(line.u.size) < line.u.size // 2 for line in fit.linearised])
    expected, left = candidate.direction[about_mean], cleaned[about_mean]
    square = float(expected @ expected)
    middle, mean, half = binned_means(expected, left)
    return AddedVariable(
        title=candidate.effect.title,
        expected=expected,
        left=left,
        score=float(candidate.score),
        slope=float(expected @ left) / square if square > 0.0 else None,
        slope_half_95=NORMAL_95 / float(np.sqrt(candidate.score)) if candidate.score > 0.0 else None,
        bin_middle=middle,
        bin_mean=mean,
        bin_half_95=half,
    )


def binned_means(x: Float, y: Float) -> tuple[Float, Float, Float]:
    """Return means of y over bins of x that hold equally many, and half the width of their 95 % intervals.

    Parameters
    ----------
    x, y : ndarray, shape (N,)

    Returns
    -------
    middle, mean, half : ndarray, shape (b,)
    """
    order = np.argsort(x, kind="stable")
    parts = [part for part in np.array_split(order, _BINS) if part.size > 1]
    middle = np.array([np.mean(x[part]) for part in parts])
    mean = np.array([np.mean(y[part]) for part in parts])
    half = np.array([NORMAL_95 * np.std(y[part], ddof=1) / np.sqrt(part.size) for part in parts])
    return middle, mean, half
