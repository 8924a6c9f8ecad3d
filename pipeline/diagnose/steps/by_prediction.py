"""The structure of a model: effects added for as long as one makes the prediction one leg ahead better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.diagnose.steps.confusion_sets import WINDOW
from kempf.pipeline.diagnose.steps.improves_prediction import ALIKE, LEAST_FALL, STABLE, better_ahead
from kempf.pipeline.diagnose.steps.joint import better_together
from kempf.pipeline.diagnose.steps.ladder import Ladder
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.steps.legs import ahead_in_std
from kempf.pipeline.shooting.ahead import Ahead, ShootingRange
from kempf.pipeline.shooting.paired import paired
from kempf.schemas.effect import Effect

#: members of a set that are refitted by likelihood at most
_MEMBERS = 4
#: manoeuvres, fitted and held out, from which predictions choose
FEWEST = 3
#: standard errors from nothing within which an effect may be taken out again
_SEEN = 2.0

Member = tuple[Candidate, Confirmation, Ahead]


def predicting_better(ladder: Ladder, steps: list[Step]) -> list[Step]:
    """Return the ladder with every effect that makes the prediction one leg ahead better, alone or with others.

    Of two manoeuvres each would have to be predicted by the other alone: too few to choose by.
    """
    if len(steps[0].fit.runs) + len(ladder.held) < FEWEST:
        return steps
    seen = set[frozenset[str]]()
    while ladder.shooting is not None and len(steps) <= ladder.settings.most_steps:
        ladder.listener.begins(f"step {len(steps)}: predicting one leg ahead")
        more = _one_more(ladder, ladder.shooting, steps) or _several_more(ladder, ladder.shooting, steps)
        if not more:
            break
        idle = _idle(ladder, more)
        more = more if idle is None else ladder.without(idle, more)
        names = frozenset(step.added.name for step in more if step.added is not None)
        if names in seen:
            break  # what was taken out would be put in again
        seen.add(names)
        steps = more
        ladder.probe = steps[-1].fit
    return steps


def _testable(step: Step) -> dict[str, Candidate]:
    """Return what can be tested, also where disturbances carry it one step ahead and the likelihood is blind to it."""
    return {c.effect.name: c for c in step.screened if not (c.missing or c.measured_by)}


def _one_more(ladder: Ladder, shooting: ShootingRange, steps: list[Step]) -> list[Step]:
    """Return the ladder with the effect that makes predictions better by itself; empty where none does."""
    last = steps[-1]
    assert last.ahead is not None
    testable = _testable(last)
    scores = {name: float(np.nan_to_num(candidate.score)) for name, candidate in testable.items()}
    choice = better_ahead(shooting, last.ahead, [c.effect for c in testable.values()], scores)
    if choice is None or choice.stability < STABLE:
        return []
    best, *others = choice.close
    others.sort(key=lambda ahead: -scores[ahead.model.effects[-1].name])
    alone = ladder.unseen(last)
    tried: list[Member] = []
    for ahead in [best, *others][:_MEMBERS]:
        candidate = testable[ahead.model.effects[-1].name]
        confirmation = ladder.confirmed(last.fit, alone, candidate)
        if _stands(candidate, confirmation) and not confirmation.absent:
            tried.append((candidate, confirmation, ahead))
    return _put_on(ladder, shooting, steps, tried, choice.stability)


def _several_more(ladder: Ladder, shooting: ShootingRange, steps: list[Step]) -> list[Step]:
    """Return the ladder with effects that make predictions better together, a step each; empty where none do."""
    first = steps[-1]
    assert first.ahead is not None
    joint = better_together(shooting, first.ahead, [c.effect for c in _testable(first).values()])
    if joint is None or len(steps) + len(joint.effects) > ladder.settings.most_steps + 1:
        return []
    for effect in joint.effects[:-1]:
        steps = _put_on(ladder, shooting, steps, _members(ladder, steps[-1], [effect]), joint.stability)
        if not steps:
            return []
    members = _members(ladder, steps[-1], joint.alternatives[:_MEMBERS])
    steps = _put_on(ladder, shooting, steps, members, joint.stability)
    if not steps:
        return []
    several = steps[-len(joint.effects) :]
    names = tuple(step.added.name for step in several if step.added is not None)
    return [*steps[: -len(several)], *(replace(step, together=names) for step in several)]


def _members(ladder: Ladder, last: Step, effects: Sequence[Effect]) -> list[Member]:
    """Refit a rung by likelihood and by legs with each of several effects; what comes to nothing is left out."""
    members = []
    for effect in effects:
        candidate = _testable(last)[effect.name]
        confirmation, ahead = ladder.confirmed(last.fit, ladder.unseen(last), candidate), ladder.ahead(last, effect)
        if ahead is not None and _stands(candidate, confirmation):
            members.append((candidate, confirmation, ahead))
    return members


def _stands(candidate: Candidate, confirmation: Confirmation) -> bool:
    """Return whether the likelihood has nothing against what legs chose.

    Disturbances carry a force one step ahead, so that the likelihood may be blind to it; a reading they do not carry,
    and an error of an instrument must hold by likelihood too.
    """
    if candidate.effect.group == "sensor" and not confirmation.holds:
        return False
    return np.isfinite(confirmation.fit.log_likelihood) and not confirmation.at_bound


def _put_on(
    ladder: Ladder, shooting: ShootingRange, steps: list[Step], tried: Sequence[Member], stability: float
) -> list[Step]:
    """Return the ladder with the one of several that the likelihood prefers; empty where there is none."""
    close = _decided(shooting, tried)
    if not close:
        return []
    pairs = tuple((c, k) for c, k, _ in close)
    names = {c.effect.name for c, _ in pairs}
    others = tuple((c, k) for c, k, _ in tried if c.effect.name not in names)
    return [*steps, ladder.stepped(pairs, others, close[0][2], stability)]


def _decided(shooting: ShootingRange, tried: Sequence[Member]) -> list[Member]:
    """Return those of the models that predict alike which the likelihood does not decide between, simplest first.

    Where the likelihood's sizes predict legs clearly worse than those fitted to them, the model lacks something that
    disturbances carry one step ahead, and the likelihood does not choose. Of what is equally simple, a term of a series
    in drift and turn comes last: in a circle it goes wrong first.
    """
    if not tried:
        return []
    best = min(tried, key=lambda member: member[1].bic_change)[1]
    close = [
        member
        for member in tried
        if member[1].bic_change <= best.bic_change + WINDOW
        or ahead_in_std(best.fit, member[1].fit, shooting.horizon_s) > -ALIKE
    ]
    first = min(close, key=lambda member: member[2].left_out.mean)
    apart = shooting.beside(first[2], first[1].fit).disagrees is not None
    return sorted(
        tried if apart else close,
        key=lambda member: (
            len(member[0].effect.parameters),
            apart and member[0].effect.polynomial,
            member[2].left_out.mean,
            member[0].effect.name,
        ),
    )


def _idle(ladder: Ladder, steps: Sequence[Step]) -> Effect | None:
    """Return an effect added before the last one that is not needed any more, None where there is none.

    Without it legs are predicted as well; or so much worse as chance may have it, and its size is nothing within two
    standard errors: what was added later has taken over what it was chosen for.
    """
    now = steps[-1].ahead
    assert ladder.shooting is not None
    assert now is not None
    for step in steps[1:-1]:
        assert step.added is not None
        comparison = paired(ladder.shooting.without(now, step.added).left_out, now.left_out)
        if comparison.in_std < ALIKE and (comparison.falls_by < LEAST_FALL or not is_sized(now, step.added)):
            return step.added
    return None


def is_sized(ahead: Ahead, effect: Effect) -> bool:
    """Return whether a parameter of an effect is more than two standard errors from nothing."""
    own = ahead.model.own(effect.name)
    return bool(np.any(np.abs(ahead.fit.values[own]) > _SEEN * ahead.std[-ahead.fit.values.size :][own]))
