"""Whether one model predicts better than another: their errors paired, window by window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.shooting.left_out import LeftOut

#: part of the median error below which errors are not distinguished
_LEAST = 0.1


@dataclass(frozen=True)
class Paired:
    """Two models side by side on manoeuvres that neither was fitted to."""

    #: Part of the first one's misfit by which the second one's is smaller; negative where it is larger.
    falls_by: float
    #: The mean logarithm of the errors' ratio, window by window, in its standard errors; windows overlap by half, so
    #: every other one counts. Positive where the second one predicts better.
    in_std: float
    #: Manoeuvres that the second one predicts better.
    better: int
    of: int


def paired(first: LeftOut, second: LeftOut) -> Paired:
    """Compare two models of the same manoeuvres."""
    a, b = (np.concatenate([np.nansum(e, axis=1) for e in model.errors]) for model in (first, second))
    if not np.all(np.isfinite(b)) or not np.all(np.isfinite(a)):
        sign = float(np.all(np.isfinite(b))) - float(np.all(np.isfinite(a)))
        better = int(np.sum(np.nan_to_num(second.misfits, nan=np.inf) < np.nan_to_num(first.misfits, nan=np.inf)))
        return Paired(float(np.sign(sign)), float(np.inf) * sign if sign else 0.0, better, len(first.errors))
    # beside a small part of the usual error, so that a window that is predicted to a hair does not decide
    least = _LEAST * float(np.median(np.concatenate([a, b])))
    difference = np.log((a + least) / (b + least)) if least > 0.0 else a - b
    error = float(np.std(difference, ddof=1)) / np.sqrt(max(difference.size / 2.0, 1.0)) if difference.size > 1 else 0.0
    mean = float(np.mean(difference))
    return Paired(
        falls_by=1.0 - second.mean / first.mean if first.mean > 0.0 else 0.0,
        in_std=mean / error if error > 0.0 else 0.0,
        better=int(np.sum(second.misfits < first.misfits)),
        of=first.misfits.size,
    )
