"""What the error of a receiver's lateness does to a fit: it is one error for all manoeuvres of a log.

The lateness that is taken from a velocity (`kempf.pipeline.channels.punctual`) is known to some hundredths of a second.
A fit believes it, and its hull is off by what is left of the lateness, in every manoeuvre of the log to one side.
"""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.effect_responses import EffectTrial, responses
from kempf.pipeline.estimate.pooled_fit import Linearised, PooledFit
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.schemas.effects import get

#: the effect by which a velocity is late, and by how much it is tried, s
_LATE, _STEP_S = "gnss_latency", 0.05


def covariance_of_lateness(fit: PooledFit, workers: Executor) -> Float:
    """Return what the errors of the lateness add to the covariance of hull and effects, shape (6 + p, 6 + p).

    Parameters
    ----------
    fit : PooledFit
        A model that knows a latency of the receiver determines it itself: nothing is added.
    workers : Executor
        Share the passes; nothing depends on it.
    """
    shared = fit.covariance.shape[0]
    nothing = np.zeros((shared, shared))
    std = [filtered.run.velocity_late_std_s for filtered in fit.runs]
    if not any(std) or any(effect.name == _LATE for effect in fit.model.effects):
        return nothing
    (column,) = responses(fit, [EffectTrial(get(_LATE), (_STEP_S,))], workers)
    if column is None:
        return nothing
    known, first = np.nan_to_num(fit.covariance), 0
    moved: dict[int, Float] = {}
    for filtered, line, one in zip(fit.runs, fit.linearised, std, strict=True):
        own = column[first : first + line.u.size, 0]
        first += line.u.size
        moved[filtered.run.day] = moved.get(filtered.run.day, 0.0) + one * _shared_score(line, own, shared)
    off = np.stack([known @ score for score in moved.values()])
    added: Float = off.T @ off
    return added


def _shared_score(line: Linearised, column: Float, shared: int) -> Float:
    """Return what a change of a run's innovations asks of the shared parameters, its own levels free."""
    common = [k for k, i in enumerate(line.index) if i < shared]
    own = [k for k, i in enumerate(line.index) if i >= shared]
    levels = line.J[:, own]
    left = column - levels @ (inverse(levels.T @ levels) @ (levels.T @ column))
    found = np.zeros(shared)
    found[[line.index[k] for k in common]] = line.J[:, common].T @ left
    return found
