"""Lasting noise of several instruments at once, from a hull that has not bent to it (decision 0050).

A hull that was fitted as if noise were fresh has bent to follow it. Taken one by one each noise is fitted beside such a
hull, which still follows the others, and the search may end on a lower hill than that of the ship.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.diagnose.forward_selection import calm_levels, refitted
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effect import Effect
from kempf.schemas.instrument_noise import lasting_noise

#: log-likelihood that a search which goes on may still find at its top
_LEFT = 1.0


def with_joint_noise(fit: PooledFit, least_gain: float, workers: Executor, listener: Listener = SILENT) -> PooledFit:
    """Return a fit with lasting noise, or the higher one that all lasting noise together has beside another hull.

    The search begins beside a hull of the ship's length (`kempf.pipeline.model.ship.mariner_like`) and quiet weather.

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
    values = np.concatenate([fit.values, *([p.steps[0] for p in noise.parameters] for noise in missing)])
    wanted = fit.log_likelihood + least_gain * max(len(missing), 1)
    hull = mariner_like(fit.runs[0].run.ship.length_m).array()
    made = refitted(fit.runs, model, hull, calm_levels(fit), values, workers, wanted=wanted, listener=listener)
    settled = made.converged
    if made.log_likelihood > wanted and not made.converged:
        # it came from far, and its iterations may have run out next to the top
        before = made.log_likelihood
        made = refitted(
            *(made.runs, model, made.hull, made.levels, made.values, workers), wanted=wanted, listener=listener
        )
        settled = made.converged or made.log_likelihood < before + _LEFT
    # a fit that did not converge itself may ask no more of another
    if not (made.log_likelihood > wanted and (settled or not fit.converged)):
        return fit
    return _without_idle(made, missing, least_gain, workers, listener)


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
