"""Noise of the instruments that lasts, found in the data and kept in the model (decision 0042).

Noise that is fresh at every reading is what a filter believes unless it is given another. Where errors last for
seconds, a fit takes them for motion: the hull bends to swing as the compass does, and waves are seen where there are
none. So before anything is added to a model, and after each effect, the innovations are asked for lasting noise of
each measurement.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from kempf.pipeline.diagnose.screening.forward_selection import added, refitted
from kempf.pipeline.diagnose.screening.joint_noise import with_joint_noise
from kempf.pipeline.diagnose.screening.screen import screen
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effects import catalogue
from kempf.schemas.instrument_noise import lasting_noise

#: score below which nobody asks, and log-likelihood that it must gain
_LEAST_SCORE, _LEAST_GAIN = 30.0, 15.0
#: runs, and measurements in them, by which lasting noise is looked for
_FEWEST, _ENOUGH = 3, 60_000


def with_instrument_noise(fit: PooledFit, workers: Executor, listener: Listener = SILENT) -> PooledFit:
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
    listener : Listener, optional
        Notified of every iteration.
    """
    some = _some_of(fit)
    noisy, stuck = _one_by_one(some, workers, listener)
    if noisy is some and not stuck:
        return fit
    noisy = with_joint_noise(noisy, _LEAST_GAIN, workers, listener)
    if noisy is some:
        return fit
    return noisy if some is fit else _of_all(fit, some, noisy, workers, listener)


def _some_of(fit: PooledFit) -> PooledFit:
    """Return a fit as of so many of its runs, spread over them, as show what noise lasts; itself where there are few.

    The instruments are the same in every run, and the search costs a dozen fits.
    """
    n = len(fit.runs)
    many = max(_FEWEST, -(-_ENOUGH * n // max(fit.count, 1)))
    if many >= n:
        return fit
    at = sorted({int((k + 0.5) * n / many) for k in range(many)})
    lines = tuple(fit.linearised[i] for i in at)
    return replace(
        fit,
        runs=tuple(fit.runs[i] for i in at),
        levels=fit.levels[at],
        linearised=lines,
        log_likelihood=sum(line.passed.log_likelihood for line in lines),
    )


def _of_all(fit: PooledFit, some: PooledFit, noisy: PooledFit, workers: Executor, listener: Listener) -> PooledFit:
    """Fit all runs with the lasting noise that some of them show."""
    levels = fit.levels + np.mean(noisy.levels - some.levels, axis=0)
    refit = refitted(fit.runs, noisy.model, noisy.hull, levels, noisy.values, workers, listener=listener)
    return refit if refit.log_likelihood > fit.log_likelihood + _LEAST_GAIN else fit


def _one_by_one(fit: PooledFit, workers: Executor, listener: Listener) -> tuple[PooledFit, bool]:
    """Return a fit with the noises that gain one after the other, and whether one that says most gained nothing.

    A hull that has bent to all of them at once may be the top of a hill of its own, from which no climb with one of
    them leads up.
    """
    effects = catalogue()
    while True:
        there = {effect.name for effect in fit.model.effects}
        left = {name: noise for name, noise in lasting_noise().items() if name not in there}
        best = max(
            screen(fit, left, workers, listener), key=lambda candidate: np.nan_to_num(candidate.score), default=None
        )
        if best is None or not best.score > _LEAST_SCORE:
            return fit, False
        if any(candidate.score > best.score for candidate in screen(fit, effects, workers, listener)):
            return fit, False
        refit = added(fit, best, workers, listener=listener)
        if not refit.log_likelihood > fit.log_likelihood + _LEAST_GAIN:
            return fit, True
        fit = refit
