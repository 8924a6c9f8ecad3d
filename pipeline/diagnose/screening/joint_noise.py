"""Lasting noise of several instruments at once, from a hull that has not bent to it (decision 0050).

A hull that was fitted as if noise were fresh has bent to follow it. Taken one by one each noise is fitted beside such a
hull, which still follows the others, and the search may end on a lower hill than that of the ship.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.diagnose.screening.forward_selection import calm_levels, refitted
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effect import Effect
from kempf.schemas.instrument_noise import lasting_noise

#: log-likelihood that a search which goes on may still find at its top, and by which another hill must be higher
_LEFT = 1.0


def with_joint_noise(fit: PooledFit, least_gain: float, workers: Executor, listener: Listener = SILENT) -> PooledFit:
    """Return a fit with lasting noise, or the higher one that all lasting noise together has beside another hull.

    The search begins beside a hull of the ship's length (`kempf.pipeline.model.ship.mariner_like`) and quiet weather,
    and once more from the fit itself: several noises have several maxima, and from one beginning it may depend on the
    last bit of its numbers which of them the search comes to.

    Parameters
    ----------
    fit : PooledFit
        With the lasting noise that was found one by one.
    least_gain : float
        Log-likelihood by which each noise must gain.
    workers : Executor
        Share the work; nothing depends on it.
    listener : Listener, optional
        Notified of every iteration.

    Returns
    -------
    PooledFit
        The very one given unless the other gains so much for every noise that it has more, and has come to its top
        where the one given did.
    """
    present = {effect.name for effect in fit.model.effects}
    missing = [noise for name, noise in lasting_noise().items() if name not in present]
    model = EffectModel((*fit.model.effects, *missing))
    values = np.concatenate([fit.values, *(_typical(noise) for noise in missing)])
    wanted = fit.log_likelihood + least_gain * max(len(missing), 1)
    hull = mariner_like(fit.runs[0].run.ship.length_m).array()
    joint = refitted(fit.runs, model, hull, calm_levels(fit), values, workers, wanted=wanted, listener=listener)
    joint, settled = _climbed(joint, wanted, workers, listener)

    def usable(log_likelihood: float, there: bool) -> bool:
        # a fit that did not converge itself may ask no more of another
        return log_likelihood > wanted and (there or not fit.converged)

    first = usable(joint.log_likelihood, settled)
    every = lasting_noise()
    begin = [_typical(e) if e.name in every else fit.values[fit.model.own(e.name)] for e in model.effects]
    higher = joint.log_likelihood + _LEFT if first else wanted
    # to its end: whether a climb can come so high is judged too early where it begins with a long way to go
    other = refitted(fit.runs, model, fit.hull, fit.levels, np.concatenate(begin), workers, listener=listener)
    other, other_settled = _climbed(other, higher, workers, listener)
    second = other.log_likelihood > higher and usable(other.log_likelihood, other_settled)
    if second and (other_settled or not (first and settled)):
        joint = other
    elif not first:
        return fit
    return _without_idle(joint, missing, least_gain, workers, listener)


def _climbed(fit: PooledFit, wanted: float, workers: Executor, listener: Listener) -> tuple[PooledFit, bool]:
    """Climb on where the iterations ran out next to the top; return the fit and whether it has reached the top."""
    if fit.converged or not fit.log_likelihood > wanted:
        return fit, fit.converged
    more = refitted(*(fit.runs, fit.model, fit.hull, fit.levels, fit.values, workers), wanted=wanted, listener=listener)
    return more, more.converged or more.log_likelihood < fit.log_likelihood + _LEFT


def _typical(noise: Effect) -> list[float]:
    return [parameter.steps[0] for parameter in noise.parameters]


def _without_idle(
    fit: PooledFit, noises: Sequence[Effect], least_gain: float, workers: Executor, listener: Listener
) -> PooledFit:
    """Leave out the noises that gain nothing beside the others."""
    for noise in noises:
        model = EffectModel(tuple(effect for effect in fit.model.effects if effect.name != noise.name))
        kept = ~fit.model.own(noise.name)
        fewer = refitted(fit.runs, model, fit.hull, fit.levels, fit.values[kept], workers, listener=listener)
        if fit.log_likelihood <= fewer.log_likelihood + least_gain:
            fit = fewer
    return fit
