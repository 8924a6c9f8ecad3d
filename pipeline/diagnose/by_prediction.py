"""The structure of a model: effects added for as long as one makes the prediction one leg ahead better."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.diagnose.confirm import Confirmation
from kempf.pipeline.diagnose.confusion_sets import WINDOW
from kempf.pipeline.diagnose.ladder import Ladder
from kempf.pipeline.diagnose.ladder_step import Step
from kempf.pipeline.diagnose.legs import ahead_in_std
from kempf.pipeline.diagnose.matters import ALIKE, LEAST_FALL, STABLE, better_ahead
from kempf.pipeline.diagnose.screen import Candidate
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.paired import paired
from kempf.schemas.effect import Effect

#: members of a set that are refitted by likelihood at most
_MEMBERS = 4
#: manoeuvres, fitted and held out, from which predictions choose
_FEWEST = 3

Member = tuple[Candidate, Confirmation, Ahead]


def predicting_better(ladder: Ladder, steps: list[Step]) -> list[Step]:
    """Return the ladder with every effect that makes the prediction one leg ahead better.

    Of two manoeuvres each would have to be predicted by the other alone: too few to choose by.
    """
    if len(steps[0].fit.runs) + len(ladder.held) < _FEWEST:
        return steps
    while ladder.shooting is not None and len(steps) <= ladder.settings.most_steps:
        last = steps[-1]
        assert last.ahead is not None
        ladder.announce(f"step {len(steps)}: predicting one leg ahead")
        # also what disturbances carry one step ahead, so that the likelihood does not see it
        screened = {c.effect.name: c for c in last.screened if not (c.missing or c.measured_by)}
        choice = better_ahead(ladder.shooting, last.ahead, [c.effect for c in screened.values()])
        if choice is None or choice.stability < STABLE:
            break
        alone = ladder.unseen(last)
        tried: list[Member] = []
        for ahead in choice.close[:_MEMBERS]:
            candidate = screened[ahead.model.effects[-1].name]
            found = ladder.confirmed(last.fit, alone, candidate)
            if np.isfinite(found.fit.log_likelihood) and not (found.at_bound or found.absent):
                tried.append((candidate, found, ahead))
        close = _decided(tried, ladder.shooting.horizon_s)
        if not close:
            break
        pairs = tuple((c, k) for c, k, _ in close)
        names = {c.effect.name for c, _ in pairs}
        others = tuple((c, k) for c, k, _ in tried if c.effect.name not in names)
        steps = [*steps, ladder.stepped(pairs, others, close[0][2], choice.stability)]
        idle = _idle(ladder, steps)
        if idle is not None:
            steps = ladder.without(idle, steps)
        ladder.probe = steps[-1].fit
    return steps


def _decided(tried: Sequence[Member], leg_s: float) -> list[Member]:
    """Return those of the models that predict alike which the likelihood does not decide between, simplest first."""
    if not tried:
        return []
    _, best, _ = min(tried, key=lambda one: one[1].bic_change)
    close = [
        one
        for one in tried
        if one[1].bic_change <= best.bic_change + WINDOW or ahead_in_std(best.fit, one[1].fit, leg_s) > -ALIKE
    ]
    return sorted(close, key=lambda one: (len(one[0].effect.parameters), one[2].left_out.mean, one[0].effect.name))


def _idle(ladder: Ladder, steps: Sequence[Step]) -> Effect | None:
    """Return an effect added before the last one without which legs are predicted as well, None where there is none."""
    now = steps[-1].ahead
    assert ladder.shooting is not None
    assert now is not None
    for step in steps[1:-1]:
        assert step.added is not None
        found = paired(ladder.shooting.without(now, step.added).left_out, now.left_out)
        if found.in_std < ALIKE and found.falls_by < LEAST_FALL:
            return step.added
    return None
