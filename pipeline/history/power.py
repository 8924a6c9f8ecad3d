"""The smallest change that would be seen: what 'no change seen' is worth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.history.contrasts import scatter, statistics
from kempf.pipeline.history.scan import Stretch, Verdict

_DRAWS = 200
#: How many differences of neighbours the scatter common to all directions is worth. A change shows in the direction
#: that scatters least, so that the least of six estimates would be promised; with 30 the promise holds on average.
_COMMON = 30.0
_FACTORS = (0.6, 0.75, 0.9, 1.05, 1.25, 1.5, 2.0, 3.0)


def smallest_steps(stretch: Stretch, verdict: Verdict) -> Float:
    """Return the step of each parameter alone, midway through, that would be seen with the power asked for.

    Parameters
    ----------
    verdict : Verdict
        Its thresholds.

    Returns
    -------
    ndarray, shape (n_parameter,)
        Relative; NaN where even three times what a first guess says would not do.
    """
    n, p = stretch.value.shape
    stretch = _typical(stretch)
    noise = stretch.noise(_DRAWS, 2) @ stretch.along
    after = (np.arange(n) >= n // 2).astype(float)[:, None]
    total = np.einsum("ac,iab,bc->ic", stretch.along, stretch.total, stretch.along)
    std = np.sqrt(1.0 / np.sum(1.0 / total[: n // 2], axis=0) + 1.0 / np.sum(1.0 / total[n // 2 :], axis=0))
    steps = np.full(p, np.nan)
    for j in range(p):
        guess = (np.sqrt(verdict.step_threshold) + 1.3) / np.max(np.abs(stretch.along[j]) / std)
        powers = []
        for factor in _FACTORS:
            powers.append(_seen(stretch, verdict, noise + after * stretch.along[j] * guess * factor))
            if powers[-1] >= stretch.settings.power:
                break
        if powers[-1] >= stretch.settings.power:
            rising = np.maximum.accumulate(powers)
            steps[j] = guess * float(np.interp(stretch.settings.power, rising, _FACTORS[: len(powers)]))
    return steps


def _typical(stretch: Stretch) -> Stretch:
    """Return the stretch with the scatter of every axis drawn towards that of all."""
    p = stretch.value.shape[1]
    U, own = stretch.along[:, :p], stretch.variance[:, :p]
    estimates = scatter(stretch.value @ U, own)[0]
    # axes whose sets say little of themselves say little of the scatter
    weight = 1.0 / (np.mean(own, axis=0) + np.median(estimates)) ** 2
    common = np.sum(weight * estimates) / np.sum(weight)
    differences = own.shape[0] - 1
    between = (differences * estimates + _COMMON * common) / (differences + _COMMON)
    return replace(stretch, total=stretch.covariance + (U * between) @ U.T)


def _seen(stretch: Stretch, verdict: Verdict, z: Float) -> float:
    s = stretch.settings
    figures = statistics(z, stretch.variance, stretch.years, s.smallest_side, s.prior_dof)
    return float(
        np.mean((figures.largest_step > verdict.step_threshold) | (figures.largest_drift > verdict.drift_threshold))
    )
