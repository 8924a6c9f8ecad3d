"""Which effect makes the prediction one leg ahead better, on manoeuvres that were not fitted: the structure of a model.

A likelihood one step ahead answers whether an effect is there; at the rate of a log it sees what changes no
prediction, and disturbances carry what is missing. What a user predicts is legs. So effects are chosen by the error one
leg ahead of manoeuvres left out, paired window by window; their sizes, and the last word between those that predict
alike, are the likelihood's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.shooting.ahead import Ahead, ShootingRange, at_bounds
from kempf.pipeline.shooting.paired import Paired, paired
from kempf.schemas.effect import Effect

#: standard errors by which the error of manoeuvres left out must fall: the best of three dozen candidates is chosen
FALLS = 3.5
#: and part of it, below which a fall is of no use to anybody
LEAST_FALL = 0.05
#: share of the manoeuvres that must be predicted better
SHARE_BETTER = 2.0 / 3.0
#: share of the repetitions, each without one manoeuvre, that must choose what predicts alike
STABLE = 0.9
#: standard errors within which two models predict alike, and beyond which one is worse
ALIKE, WORSE = 2.0, 2.0
#: and part of the misfit by which it must rise to be worse
LEAST_RISE = 0.01
#: refits at a step
_REFITS = 6


@dataclass(frozen=True, eq=False)
class Choice:
    """The models with one effect more that predict best, and alike."""

    #: The best first.
    close: tuple[Ahead, ...]
    #: Share of the repetitions, each without one manoeuvre, whose best is one of them.
    stability: float


def falls(before: Ahead, after: Ahead) -> bool:
    """Return whether a model predicts manoeuvres left out clearly better than another, and no others worse."""
    comparison = paired(before.left_out, after.left_out)
    return bool(
        comparison.in_std > FALLS
        and comparison.falls_by > LEAST_FALL
        and comparison.better >= SHARE_BETTER * comparison.of
        and not worsens(before, after)
    )


def worsens(before: Ahead, after: Ahead) -> bool:
    """Return whether a model predicts fitted, left-out or held-out manoeuvres worse than another, beyond the error."""
    return any(
        comparison.in_std < -WORSE and comparison.falls_by < -LEAST_RISE for comparison in comparisons(before, after)
    )


def comparisons(before: Ahead, after: Ahead) -> list[Paired]:
    """Compare two models on fitted, left-out and, where there are any, held-out manoeuvres."""
    pairs = [paired(before.own, after.own), paired(before.left_out, after.left_out)]
    return [*pairs, paired(before.held, after.held)] if before.held.errors else pairs


def better_ahead(
    shooting: ShootingRange, base: Ahead, effects: Sequence[Effect], scores: Mapping[str, float] | None = None
) -> Choice | None:
    """Return the models with one effect more that predict clearly better than ``base``, None where none does.

    Parameters
    ----------
    effects : sequence of Effect
        To be tried.
    scores : mapping, optional
        Score of each effect by name. The likeliest one worth it is refitted even where the screen by legs foresees less
        of it than of many, as forms of one effect predict legs alike to a per cent.
    """
    foreseen = shooting.screened(base, effects)
    worth = [effect for cost, effect in foreseen if cost < (1.0 - LEAST_FALL) * base.fit.cost]
    short = worth[:_REFITS]
    if scores is not None and worth:
        likeliest = max(worth, key=lambda effect: scores[effect.name])
        short += [likeliest] if likeliest not in short else []
    refitted = (shooting.with_effect(base, effect) for effect in short)
    tried = [refit for refit in refitted if refit is not None]
    good = [ahead for ahead in tried if not (at_bounds(ahead) or worsens(base, ahead))]
    if not good:
        return None
    best = min(good, key=lambda ahead: ahead.left_out.mean)
    if not falls(base, best):
        return None
    close = [ahead for ahead in good if ahead is best or _alike(base, best, ahead)]
    close.sort(key=lambda ahead: ahead.left_out.mean)
    return Choice(tuple(close), stability_of(good, close))


def _alike(base: Ahead, best: Ahead, other: Ahead) -> bool:
    """Return whether a model makes the error fall too, and is not clearly behind the best one."""
    return (
        paired(base.left_out, other.left_out).falls_by > LEAST_FALL
        and paired(best.left_out, other.left_out).in_std > -ALIKE
    )


def stability_of(good: Sequence[Ahead], close: Sequence[Ahead]) -> float:
    """Return the share of repetitions without one manoeuvre each in which the best is one of ``close``."""
    misfits = np.array([ahead.left_out.misfits for ahead in good])
    rest = misfits.sum(axis=1, keepdims=True) - misfits
    chosen = np.argmin(rest, axis=0)
    return float(np.mean([any(good[k] is ahead for ahead in close) for k in chosen]))
