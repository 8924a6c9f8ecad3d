"""How large effects are beside everything else that is claimed, and beside noise of the instruments found with them.

An effect is chosen by a refit beside what was known when it was chosen. What is found later, another effect or noise
that lasts, moves it: what was missing had hidden how long the errors of a compass last.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.forward_selection import refitted
from kempf.pipeline.diagnose.screening.unsure_instants import WithInstants, with_instants
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.effect import Effect


@dataclass(frozen=True, eq=False)
class Size:
    """How large an effect is."""

    #: values, std: Shape (p,). Of its parameters, SI.
    values: Float
    std: Float
    #: Factor on the standard errors, in ``std`` already, see `kempf.pipeline.estimate.agreement`.
    widened: float


def refitted_size(effect: Effect, confirmation: Confirmation) -> Size:
    """Return the size that an effect has in the refit that it was chosen or refused by."""
    return _in(confirmation.stated, effect)


def final_sizes(steps: Sequence[Step], workers: Executor, listener: Listener = SILENT) -> Mapping[str, Size]:
    """Return the sizes of the effects of a ladder in its last model, and of those in their sets in place of them.

    Parameters
    ----------
    steps : sequence of Step
        The claimed ones, the diagnosed model first.
    workers : Executor
        Share the work; nothing depends on it.
    listener : Listener, optional
        Notified of every iteration.

    Returns
    -------
    mapping
        By effect. Of what only could be in the place of an effect, where its refit does not converge, that of the refit
        that it was compared by.
    """
    last = steps[-1].fit
    sizes: dict[str, Size] = {}
    if len(steps) == 1:
        return sizes
    whole = with_instants(last, workers)
    for step in steps[1:]:
        (chosen, confirmation), *others = step.chosen_from
        sizes[chosen.effect.name] = _in(whole, chosen.effect)
        for candidate, refit in others:
            if last is not confirmation.fit:
                listener.begins(f"fitting {candidate.effect.title} in place of {chosen.effect.title}")
                fit = _in_place(last, chosen.effect, candidate.effect, refit, workers, listener)
                if fit.converged:
                    sizes[candidate.effect.name] = _in(with_instants(fit, workers), candidate.effect)
                    continue
            sizes[candidate.effect.name] = refitted_size(candidate.effect, refit)
    return sizes


def _in_place(
    fit: PooledFit, effect: Effect, other: Effect, confirmation: Confirmation, workers: Executor, listener: Listener
) -> PooledFit:
    """Fit a model with another effect in the place of one of its own."""
    model = EffectModel(tuple(other if member.name == effect.name else member for member in fit.model.effects))
    chosen = confirmation.fit
    sizes = {member.name: fit.values[fit.model.own(member.name)] for member in fit.model.effects}
    sizes[other.name] = chosen.values[chosen.model.own(other.name)]
    values = np.concatenate([sizes[member.name] for member in model.effects])
    return refitted(fit.runs, model, chosen.hull, fit.levels, values, workers, listener=listener)


def _in(stated: WithInstants, effect: Effect) -> Size:
    at = stated.fit.model.own(effect.name)
    return Size(stated.fit.values[at], stated.std(stated.fit.values.size)[at], agreement_of(stated.fit).widened)
