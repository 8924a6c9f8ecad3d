"""Fitting a model with one effect more, from where the score says that it lies."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.estimate import pooled_fit
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.level_bounds import level_bounds
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effect import Effect

#: iterations of an entry of the race, and of the climb to the end
_RACE, _TO_THE_END = 6, 60
#: multiples of its typical size with which a lag begins beside an ordinary hull
_LONGER = (1.0, 10.0, 30.0)
#: see `kempf.pipeline.estimate.pooled_fit.swiftness`: twice that of the quickest vessels
_QUICK = 15.0
#: runs that the race goes over
_RUNS_OF_RACE = 3
#: intensities of what drives force, moment and current where an ordinary hull begins, SI
_CALM = (1e-4, 1e-6, 1e-3)


def added(
    base: PooledFit,
    candidate: Candidate,
    workers: Executor,
    wanted: float = -np.inf,
    listener: Listener = SILENT,
    *,
    race: bool = True,
) -> PooledFit:
    """Fit a model with one effect more.

    A hull fitted without a lag of the rudder has been bent to imitate it, and from there the way to the true
    hull leads through worse ones. So an effect with a threshold races from several sizes and two hulls, and where the
    hull has bent so far that it is no ship, before or behind the fit, every effect climbs from an ordinary one too.

    Parameters
    ----------
    candidate : Candidate
        Of the screen beside ``base``.
    wanted : float, optional
        Log-likelihood without which the fit is of no use: climbs that cannot reach it are given up, not converged.
    listener : Listener, optional
        Notified of every iteration, of the race too.
    race : bool, optional
        False where the effect has raced beside a hull that was bent more, and nothing came of it.
    """
    model = base.model.with_effect(candidate.effect)
    begin = _begin(candidate)
    first = candidate.effect.parameters[0]
    entries = [(base.hull, begin)]
    ordinary = mariner_like(base.runs[0].run.ship.length_m).array()
    if race and len(first.steps) > 1:
        sizes = [np.concatenate([[size], begin[1:]]) for size in first.steps]
        entries += [(hull, size) for hull in (base.hull, ordinary) for size in sizes]
    if len(entries) > 1:
        few = slice(0, _RUNS_OF_RACE)
        raced = [_climbed(base, model, hull, size, workers, _RACE, few, listener=listener) for hull, size in entries]
        best = max(raced, key=lambda fit: fit.log_likelihood)
        hull, begin = best.hull, best.values[base.values.size :]
    else:
        hull = base.hull
    fitted = _climbed(base, model, hull, begin, workers, _TO_THE_END, wanted=wanted, listener=listener)
    if is_ship(base) and is_ship(fitted):
        return fitted
    # what the score predicts beside such a hull says little, and the disturbances beside it have eaten the effect
    calm = replace(base, levels=calm_levels(base))
    for size in _sizes(candidate.effect):
        # a lower hill need not be climbed to its top
        least = max(wanted, fitted.log_likelihood)
        other = _climbed(calm, model, ordinary, size, workers, _TO_THE_END, wanted=least, listener=listener)
        fitted = max(fitted, other, key=lambda fit: fit.log_likelihood)
    return fitted


def calm_levels(base: PooledFit) -> Float:
    """Return the levels of a fit, shape (runs, 6), with disturbances as in quiet weather."""
    levels = base.levels.copy()
    levels[:, : len(_CALM)] = np.log(_CALM)
    result: Float = np.clip(levels, *level_bounds(base.runs[0].spec))
    return result


def _sizes(effect: Effect) -> list[Float]:
    """Sizes to begin with where the score predicts none: of what delays the rudder several, it has several tops."""
    first, *rest = (p.steps for p in effect.parameters)
    if effect.rudder_course is None:
        chosen = first[:1]
    else:
        chosen = first if len(first) > 1 else tuple(k * first[0] for k in _LONGER)
    return [np.array([size, *(steps[0] for steps in rest)]) for size in chosen]


def is_ship(fit: PooledFit) -> bool:
    """Return whether sway and yaw are damped, drift turns her away from the flow and the rudder turns her as it should.

    And whether she answers as fast as vessels do. A ship that does not keep a straight course by herself is one too.
    """
    a11, _, a21, a22, b1, b2 = (float(x) for x in fit.hull)
    quick = pooled_fit.swiftness(fit.hull, fit.runs[0].run.ship.length_m) > _QUICK
    return max(a11, a21, a22, b1) < 0.0 < b2 and not quick


def _climbed(
    base: PooledFit,
    model: EffectModel,
    hull: Float,
    begin: Float,
    workers: Executor,
    iterations: int,
    chosen: slice = slice(None),
    wanted: float = -np.inf,
    listener: Listener = SILENT,
) -> PooledFit:
    values = np.concatenate([base.values, begin])
    return refitted(base.runs[chosen], model, hull, base.levels[chosen], values, workers, iterations, wanted, listener)


def refitted(
    filtered: Sequence[RunFilter],
    model: EffectModel,
    hull: Float,
    levels: Float,
    values: Float,
    workers: Executor,
    max_iterations: int = pooled_fit.MAX_ITERATIONS,
    wanted: float = -np.inf,
    listener: Listener = SILENT,
) -> PooledFit:
    """Fit another model to runs that have one; the parameters are those of `kempf.pipeline.estimate.pooled_fit.fit`."""
    runs = [replace(run, model=model) for run in filtered]
    return pooled_fit.fit(
        runs, hull, levels, values, workers, max_iterations=max_iterations, wanted=wanted, listener=listener
    )


def _begin(candidate: Candidate) -> Float:
    """Where to start: at the expected change, inside the bounds; a threshold from where it was tried."""
    parameters = candidate.effect.parameters
    inside = np.clip(candidate.change, [p.low for p in parameters], [p.high for p in parameters])
    # at 0 a threshold has no slope of its own
    if len(parameters[0].steps) > 1 and parameters[0].low == 0.0 and inside[0] <= 0.0:
        inside[0] = candidate.steps[0]
    return np.asarray(inside, dtype=np.float64)
