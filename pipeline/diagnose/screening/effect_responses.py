"""What effects that a model lacks would do to its whitened innovations: columns of J, for many effects at once.

Effects that are absent at 0 may stand in one model without being there: each lane of the filter then has one of them at
its step and all others at 0, and sixteen tries cost little more than a handful of passes.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.batch import MOST
from kempf.schemas.effect import Effect


@dataclass(frozen=True)
class EffectTrial:
    """An effect with the values of its parameters at which it is tried."""

    effect: Effect
    steps: tuple[float, ...]

    @property
    def making(self) -> tuple[int, ...]:
        """Parameters that make the effect; each has a column."""
        return tuple(k for k, p in enumerate(self.effect.parameters) if not p.shapes)


def responses(
    base: PooledFit, trials: Sequence[EffectTrial], workers: Executor, listener: Listener = SILENT
) -> list[Float | None]:
    """Return what each trial does to the whitened innovations of all runs.

    Parameters
    ----------
    base : PooledFit
        The fitted model; it has none of the effects.
    workers : Executor
        Share the passes; nothing depends on it.
    listener : Listener, optional
        Notified of the trials that are done.

    Returns
    -------
    list of ndarray of shape (N, c), or None
        Of each trial one column for every parameter that makes the effect; None where the filter runs away.
    """
    bundles = _bundles(trials)
    result: list[Float | None] = [None] * len(trials)
    done = 0
    passed = workers.map(lambda bundle: _passed(base, [trials[i] for i in bundle]), bundles)
    for bundle, answers in zip(bundles, passed, strict=True):
        for i, columns in zip(bundle, answers, strict=True):
            result[i] = columns
        done += len(bundle)
        listener.counted(done, len(trials))
    # what one effect makes of a state may be no number for another one that is not there: it is passed again, alone
    astray = [i for bundle in bundles if len(bundle) > 1 for i in bundle if result[i] is None]
    for i, (columns,) in zip(astray, workers.map(lambda i: _passed(base, [trials[i]]), astray), strict=True):
        result[i] = columns
    return result


def _bundles(trials: Sequence[EffectTrial]) -> list[list[int]]:
    """Put trials together that fit into the lanes of one filter.

    States of their own would be carried by all, and courses of the rudder be computed for all: effects with these share
    the lanes with themselves only.
    """
    bundles: list[list[int]] = []
    lanes, last = 0, ""
    for i in sorted(range(len(trials)), key=lambda i: (_alone(trials[i].effect), i)):
        own, width = _alone(trials[i].effect), len(trials[i].making)
        if not bundles or own != last or lanes + width > MOST:
            bundles.append([])
            lanes = 0
        bundles[-1].append(i)
        lanes, last = lanes + width, own
    return bundles


def _alone(effect: Effect) -> str:
    return effect.name if effect.states or effect.rudder_course is not None else ""


def _passed(base: PooledFit, trials: Sequence[EffectTrial]) -> list[Float | None]:
    """Return the columns of trials that go through the filter together, None for one that runs away."""
    model, effects = base.model, {trial.effect.name: trial.effect for trial in trials}
    first, at = {}, base.values.size
    for name, effect in effects.items():
        model = model.with_effect(effect)
        first[name], at = at, at + len(effect.parameters)
    absent = np.concatenate([base.values, [p.absent for effect in effects.values() for p in effect.parameters]])
    lanes = [(trial, k) for trial in trials for k in trial.making]
    values = np.repeat(absent[:, None], len(lanes), axis=1)
    for lane, (trial, k) in enumerate(lanes):
        for i, (parameter, step) in enumerate(zip(trial.effect.parameters, trial.steps, strict=True)):
            if parameter.shapes or i == k:
                values[first[trial.effect.name] + i, lane] = step
    parts: list[list[Float]] = [[] for _ in lanes]
    hulls = np.repeat(base.hull[:, None], len(lanes), axis=1)
    for number, (filtered, line) in enumerate(zip(base.runs, base.linearised, strict=True)):
        levels = np.repeat(np.exp(base.levels[number])[:, None], len(lanes), axis=1)
        others = RunFilter(filtered.run, model, filtered.spec).run_filters(hulls, levels, values)
        for lane, ((trial, k), other) in enumerate(zip(lanes, others, strict=True)):
            if np.isfinite(other.log_likelihood):
                parts[lane].append(sensitivity.difference(line.passed, other, trial.steps[k]))
    result: list[Float | None] = []
    columns = iter(parts)
    for trial in trials:
        own = [next(columns) for _ in trial.making]
        whole = all(len(part) == len(base.runs) for part in own)
        column = np.column_stack([np.concatenate(part) for part in own]) if whole else None
        result.append(column if column is not None and np.all(np.isfinite(column)) else None)
    return result
