"""Noise of the instruments that lasts, found in the data and kept in the model (decision 0042).

Noise that is fresh at every reading is what a filter believes unless it is given another. Where errors last for
seconds, a fit takes them for motion: the hull bends to swing as the compass does, and waves are seen where there are
none. So before anything is added to a model, and after each effect, the innovations are asked for lasting noise of
each measurement.
"""

from __future__ import annotations

from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.diagnose.forward_selection import added
from kempf.pipeline.diagnose.joint_noise import with_joint_noise
from kempf.pipeline.diagnose.screen import screen
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effects import catalogue
from kempf.schemas.instrument_noise import lasting_noise

#: score below which nobody asks, and log-likelihood that it must gain
_LEAST_SCORE, _LEAST_GAIN = 30.0, 15.0


def with_instrument_noise(fit: PooledFit, workers: Executor) -> PooledFit:
    """Return a fit with what its innovations show of lasting noise.

    Noise follows no manoeuvre and could imitate a little of everything. It is taken where it says more of the
    innovations than any effect of the catalogue, and gains clearly. Where it is found, all of it is tried at once,
    beside a hull that has not bent to any.

    Parameters
    ----------
    fit : PooledFit
        Of any model.
    workers : Executor
        Share the work; nothing depends on it.
    """
    found = _one_by_one(fit, workers)
    return found if found is fit else with_joint_noise(found, _LEAST_GAIN, workers)


def _one_by_one(fit: PooledFit, workers: Executor) -> PooledFit:
    effects = catalogue()
    while True:
        there = {effect.name for effect in fit.model.effects}
        left = {name: noise for name, noise in lasting_noise().items() if name not in there}
        best = max(screen(fit, left, workers), key=lambda one: np.nan_to_num(one.score), default=None)
        if best is None or not best.score > _LEAST_SCORE:
            return fit
        if any(one.score > best.score for one in screen(fit, effects, workers)):
            return fit
        made = added(fit, best, workers)
        if not made.log_likelihood > fit.log_likelihood + _LEAST_GAIN:
            return fit
        fit = made
