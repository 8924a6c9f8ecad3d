"""The smallest change that would be seen: what 'no change seen' is worth."""

from __future__ import annotations

import numpy as np

from pipeline.history.contrasts import statistics
from pipeline.history.scan import Stretch, Verdict
from pipeline.normalise.series import Float

_DRAWS = 200
_FACTORS = (0.6, 0.75, 0.9, 1.05, 1.25, 1.5, 2.0)


def smallest_steps(one: Stretch, verdict: Verdict) -> Float:
    """Return the step of each parameter alone, midway through, that would be seen with the power asked for.

    Parameters
    ----------
    one : Stretch
    verdict : Verdict
        Its thresholds.

    Returns
    -------
    ndarray, shape (n_parameter,)
        Relative; NaN where even twice what a first guess says would not do.
    """
    n, p = one.value.shape
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


def _seen(one: Stretch, verdict: Verdict, z: Float) -> float:
    s = one.settings
    found = statistics(z, one.variance, one.years, s.smallest_side, s.prior_dof)
    return float(
        np.mean((found.largest_step > verdict.step_threshold) | (found.largest_drift > verdict.drift_threshold))
    )
