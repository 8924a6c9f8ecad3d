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


def smallest_steps(one: Stretch, verdict: Verdict) -> Float:
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
    n, p = one.value.shape
    one = _typical(one)
    noise = one.noise(_DRAWS, 2) @ one.along
    after = (np.arange(n) >= n // 2).astype(float)[:, None]
    total = np.einsum("ac,iab,bc->ic", one.along, one.total, one.along)
    std = np.sqrt(1.0 / np.sum(1.0 / total[: n // 2], axis=0) + 1.0 / np.sum(1.0 / total[n // 2 :], axis=0))
    found = np.full(p, np.nan)
    for j in range(p):
        guess = (np.sqrt(verdict.step_threshold) + 1.3) / np.max(np.abs(one.along[j]) / std)
        seen = []
        for factor in _FACTORS:
            seen.append(_seen(one, verdict, noise + after * one.along[j] * guess * factor))
            if seen[-1] >= one.settings.power:
                break
        if seen[-1] >= one.settings.power:
            rising = np.maximum.accumulate(seen)
            found[j] = guess * float(np.interp(one.settings.power, rising, _FACTORS[: len(seen)]))
    return found


def _typical(one: Stretch) -> Stretch:
    """Return the stretch with the scatter of every axis drawn towards that of all."""
    p = one.value.shape[1]
    U, own = one.along[:, :p], one.variance[:, :p]
    found = scatter(one.value @ U, own)[0]
    # axes whose sets say little of themselves say little of the scatter
    weight = 1.0 / (np.mean(own, axis=0) + np.median(found)) ** 2
    common = np.sum(weight * found) / np.sum(weight)
    differences = own.shape[0] - 1
    between = (differences * found + _COMMON * common) / (differences + _COMMON)
    return replace(one, total=one.covariance + (U * between) @ U.T)


def _seen(one: Stretch, verdict: Verdict, z: Float) -> float:
    s = one.settings
    found = statistics(z, one.variance, one.years, s.smallest_side, s.prior_dof)
    return float(
        np.mean((found.largest_step > verdict.step_threshold) | (found.largest_drift > verdict.drift_threshold))
    )
