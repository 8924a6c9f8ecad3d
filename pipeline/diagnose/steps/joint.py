"""Which effects make the prediction one leg ahead better together, where none does by itself.

A ship may lack a race and a drag that hide each other, and a wind that hides both. Every small set of effects is
screened on one linearisation; the few best are fitted. What has been chosen from thousands is significant by chance,
so the set is chosen by manoeuvres left out, and confirmed by the held-out ones, which had no part in the choice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.steps.improves_prediction import (
    ALIKE,
    LEAST_FALL,
    SHARE_BETTER,
    STABLE,
    stability_of,
    worsens,
)
from kempf.pipeline.shooting.ahead import Ahead, ShootingRange, at_bounds
from kempf.pipeline.shooting.normal_equations import NormalEquations
from kempf.pipeline.shooting.paired import paired
from kempf.schemas.effect import Effect

#: effects of a set, and sets that are fitted
_MOST_EFFECTS, _REFITS = 3, 10
#: standard errors by which the error must fall in manoeuvres left out, and again in held-out ones
_FALLS = 3.0
#: held-out manoeuvres that can confirm a set
_FEWEST_HELD = 2
#: groups of the catalogue whose effects are formulas of one thing
_FORMS = ("hull", "propulsion")
#: beside what is linear in the effects
_DAMPING = 1e-6


@dataclass(frozen=True, eq=False)
class Joint:
    """Effects that belong together."""

    #: In order; the last one is that which others could replace.
    effects: tuple[Effect, ...]
    #: The last one, and what could be in its place; terms of series after the others.
    alternatives: tuple[Effect, ...]
    #: Share of the repetitions, each without one manoeuvre, whose best set has effects of the same kinds.
    stability: float


def better_together(shooting: ShootingRange, base: Ahead, effects: Sequence[Effect]) -> Joint | None:
    """Return the effects that predict clearly better together, None where no set does.

    Parameters
    ----------
    effects : sequence of Effect
        To be tried; of those that act on the hull no two are in a set, since polynomials of drift and turn make up for
        each other in zigzags, and go wrong together in a circle.
    """
    if len(base.held.errors) < _FEWEST_HELD:
        return None
    candidates = [effect for effect in effects if _is_linear(effect) and effect.name not in base.names]
    linear = shooting.linearised(base, candidates)
    if linear is None:
        return None
    good = []
    for chosen, shared in _worth(linear, base, candidates):
        refit = shooting.with_effects(base, chosen, shared)
        if np.all(np.isfinite(refit.left_out.misfits)) and not at_bounds(refit, len(chosen)):
            good.append(refit)
    if not good:
        return None
    best = _best(good)
    close = [ahead for ahead in good if paired(best.left_out, ahead.left_out).in_std > -ALIKE]
    alike = [ahead for ahead in good if kinds(ahead.model.effects) == kinds(best.model.effects)]
    stability = stability_of(good, alike)
    added = best.model.effects[len(base.model.effects) :]
    if not (stability >= STABLE and _holds(base, best) and all(_is_needed(shooting, best, e) for e in added)):
        return None
    return _ordered(base, added, [ahead for ahead in close if _holds(base, ahead)], stability)


def _best(good: Sequence[Ahead]) -> Ahead:
    """Return the set that predicts manoeuvres left out best.

    The mean misfit hangs on the few windows that are predicted worst. Between sets whose means differ by less than
    anybody would notice, the errors window by window decide.
    """
    least = min(good, key=lambda ahead: ahead.left_out.mean)
    beside = [(ahead, paired(least.left_out, ahead.left_out)) for ahead in good]
    near = [(comparison.in_std, ahead) for ahead, comparison in beside if comparison.falls_by > -LEAST_FALL]
    return max(near, key=lambda pair: pair[0])[1]


def _is_linear(effect: Effect) -> bool:
    """Return whether an effect grows with its parameters from nothing, and brings no state along."""
    plain = effect.rudder_course is None and not effect.states
    return plain and len(effect.parameters[0].steps) == 1 and not any(p.shapes for p in effect.parameters)


def _worth(linear: NormalEquations, base: Ahead, effects: Sequence[Effect]) -> list[tuple[tuple[Effect, ...], Float]]:
    """Return the sets that are worth a fit, with where to begin it, the best first."""
    first, counts = base.fit.shared.size, [len(effect.parameters) for effect in effects]
    ends = first + np.cumsum(counts)
    place = {e.name: np.arange(end - n, end) for e, end, n in zip(effects, ends, counts, strict=True)}
    common = np.arange(first)
    costs: dict[frozenset[str], float] = {}
    sets = []
    for chosen in _sets(effects):
        part = linear.of(np.concatenate([common, *(place[effect.name] for effect in chosen)]))
        step = part.step(_DAMPING)
        names = frozenset(effect.name for effect in chosen)
        costs[names] = part.cost_after(step)
        least = min((costs[names - {name}] for name in names), default=linear.cost) if len(names) > 1 else linear.cost
        # each of them must be worth its while
        if len(chosen) > 1 and least - costs[names] > LEAST_FALL * linear.cost:
            sets.append((costs[names], chosen, part.at + step))
    sets.sort(key=lambda entry: (entry[0], [effect.name for effect in entry[1]]))
    return [(chosen, shared) for _, chosen, shared in sets[:_REFITS]]


def _sets(effects: Sequence[Effect]) -> Iterator[tuple[Effect, ...]]:
    """Yield the sets of one effect, of two and of three, with one that acts on the hull at most."""
    for size in range(1, _MOST_EFFECTS + 1):
        for chosen in combinations(effects, size):
            if sum(effect.group == "hull" for effect in chosen) <= 1:
                yield chosen


def _holds(base: Ahead, ahead: Ahead) -> bool:
    """Return whether the error falls clearly in manoeuvres left out and held out, and by as much as its effects owe."""
    owed = LEAST_FALL * (len(ahead.model.effects) - len(base.model.effects))
    falls = (paired(base.left_out, ahead.left_out), paired(base.held, ahead.held))
    return not worsens(base, ahead) and all(
        fall.in_std > _FALLS and fall.falls_by > owed and fall.better >= SHARE_BETTER * fall.of for fall in falls
    )


def kinds(effects: Sequence[Effect]) -> list[str]:
    """Return what effects are of, sorted: formulas of the hull's drag or of the propulsion are of one kind each.

    A race over the rudder and a rudder force with another power of the speed are near one another, and which of both
    comes out first turns on single seconds of the record. Of the other groups every effect is a kind of its own.
    """
    return sorted(effect.group if effect.group in _FORMS else effect.name for effect in effects)


def _is_needed(shooting: ShootingRange, best: Ahead, effect: Effect) -> bool:
    """Return whether a model predicts manoeuvres left out worse without one of its effects."""
    return paired(shooting.without(best, effect).left_out, best.left_out).falls_by > LEAST_FALL


def _ordered(base: Ahead, added: Sequence[Effect], close: Sequence[Ahead], stability: float) -> Joint:
    """Put that effect last which most others could replace."""
    names = {effect.name for effect in added}
    instead: dict[str, list[Effect]] = {effect.name: [] for effect in added}
    for ahead in close:
        others = ahead.model.effects[len(base.model.effects) :]
        gone = names - {effect.name for effect in others}
        if len(gone) == 1 and len(others) == len(added):
            instead[gone.pop()] += [effect for effect in others if effect.name not in names]
    order = sorted(added, key=lambda effect: len(instead[effect.name]))
    alternatives = sorted((order[-1], *instead[order[-1].name]), key=lambda effect: effect.polynomial)
    return Joint(tuple(order), tuple(alternatives), stability)
