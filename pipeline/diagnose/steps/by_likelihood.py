"""What the likelihood is sure of beside what makes predictions better: material, immaterial or only suspected.

One step ahead a log of any rate shows more than changes a prediction. So each effect is asked two questions: is it
there, by scores whose errors allow for what hangs together within a leg; and does it matter, by what it changes in
predictions of legs and in the hull's parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from kempf.pipeline.diagnose.screening.forward_selection import is_ship
from kempf.pipeline.diagnose.screening.screen import Candidate, screen
from kempf.pipeline.diagnose.steps.by_prediction import is_sized
from kempf.pipeline.diagnose.steps.confirm import BIC_SAVING, Confirmation, Unseen, price_of, unpredicted, unseen
from kempf.pipeline.diagnose.steps.confusion_sets import ALIKE, WINDOW, alike, shortlist, undecided
from kempf.pipeline.diagnose.steps.immaterial import LEAST_PART, Immaterial, weighed
from kempf.pipeline.diagnose.steps.improves_prediction import worsens
from kempf.pipeline.diagnose.steps.ladder import Ladder
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.steps.legs import candidate_in_std
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.paired import paired
from kempf.schemas.effect import Effect

#: how many times its score a refit gains at most, as far as has been seen; a hull bent by what is missing hides much
_MOST_GAIN = 10.0
#: standard errors from nothing below which an effect added before is taken out again
_SEEN = 2.0


@dataclass(eq=False)
class LikelihoodFindings:
    """What the likelihood found."""

    #: The ladder with what matters.
    steps: list[Step]
    immaterial: list[Immaterial] = field(default_factory=list)
    #: By name, why it is no more than suspected.
    suspected: dict[str, str] = field(default_factory=dict)


def certain_ones(ladder: Ladder, steps: list[Step]) -> LikelihoodFindings:
    """Add what the likelihood is sure of to a ladder."""
    findings = LikelihoodFindings(steps)
    while len(findings.steps) + len(findings.immaterial) <= ladder.settings.most_steps:
        last = findings.steps[-1]
        tried = _refitted(ladder, findings)
        kept = _kept(ladder, findings, undecided([pair for pair in tried if pair[1].holds]))
        if not kept:
            findings.steps[-1] = replace(last, refused=(*last.refused, *tried))
            findings.suspected |= only_fitted(tried)
            break
        pairs = tuple(pair for pair, _ in kept)
        names = {candidate.effect.name for candidate, _ in pairs}
        worse = tuple(pair for pair in tried if pair[0].effect.name not in names)
        (candidate, confirmation), ahead = kept[0]
        weight = weighed(last.ahead, ahead, ladder.probe, confirmation.fit)
        before, ladder.probe = ladder.probe, confirmation.fit
        if not weight.matters:
            findings.immaterial.append(Immaterial(pairs, weight))
            continue
        if before is not last.fit:
            # the ladder goes on without what is immaterial
            again = ladder.refitted(last, candidate.effect)
            if not again[1].holds:
                findings.suspected[candidate.effect.name] = "without what is immaterial beside it nothing of it holds"
                continue
            pairs = (again, *pairs[1:])
        findings.steps.append(ladder.stepped(pairs, worse, ahead, None))
        climbed, idle = findings.steps[-1].fit, _idle(findings.steps)
        if idle is not None:
            findings.steps = ladder.without(idle, findings.steps)
        findings.steps = _not_superseded(ladder, findings.steps)
        if findings.steps[-1].fit is not climbed:
            # what was found beside another ladder is looked for again beside this one
            ladder.probe = findings.steps[-1].fit
            findings.immaterial.clear()
    claimed = {c.effect.name for step in findings.steps for c, _ in step.chosen_from}
    claimed |= {c.effect.name for immaterial in findings.immaterial for c, _ in immaterial.chosen_from}
    findings.suspected = {name: why for name, why in sorted(findings.suspected.items()) if name not in claimed}
    return findings


def only_fitted(tried: Sequence[tuple[Candidate, Confirmation]]) -> dict[str, str]:
    """Return the effects that improve the fit and no prediction of what it was not fitted to, and why.

    Parameters
    ----------
    tried : sequence of (Candidate, Confirmation)
        Refitted beside everything that was found.
    """
    return {
        candidate.effect.name: f"it improves the fit; {unpredicted(confirmation)}"
        for candidate, confirmation in tried
        if confirmation.fits and not confirmation.predicts
    }


def _refitted(ladder: Ladder, findings: LikelihoodFindings) -> list[tuple[Candidate, Confirmation]]:
    """Refit what is certain beside everything found so far."""
    last, fit = findings.steps[-1], ladder.probe
    screened: Sequence[Candidate] = last.screened
    alone: Unseen
    if fit is last.fit:
        alone = ladder.unseen(last)
    else:
        screened, alone = (
            screen(fit, ladder.effects, ladder.workers, ladder.listener),
            unseen(fit, ladder.held, ladder.workers),
        )
    tried: list[tuple[Candidate, Confirmation]] = []
    for candidate in shortlist(screened, ladder.settings.level, ladder.settings.refits):
        if ladder.shooting is not None:
            certain = candidate_in_std(fit, candidate, ladder.shooting.horizon_s)
            if certain < ladder.settings.certain_std:
                findings.suspected[candidate.effect.name] = (
                    f"significant one step ahead, but leg by leg only {certain:.1f} standard errors from nothing"
                )
                continue
        # the score predicts the likelihood ratio, but not beside what is no ship; what is far behind the best refit
        # cannot come near it
        if is_ship(fit) and any(
            candidate.score * _MOST_GAIN < k.likelihood_ratio - WINDOW for _, k in tried if k.holds
        ):
            continue
        most = min((k.bic_change for _, k in tried if k.holds), default=np.inf) + WINDOW
        tried.append((candidate, ladder.confirmed(fit, alone, candidate, most)))
    return tried


def _kept(
    ladder: Ladder, findings: LikelihoodFindings, best: Sequence[tuple[Candidate, Confirmation]]
) -> list[tuple[tuple[Candidate, Confirmation], Ahead | None]]:
    """Return those of the best that legs have nothing against, with the model one leg ahead."""
    last, kept = findings.steps[-1], []
    for pair in best:
        effect = pair[0].effect
        ahead = ladder.ahead(last, effect)
        if _worse(last.ahead, ahead) or _raises(last.ahead, ahead):
            findings.suspected[effect.name] = "it makes the prediction one leg ahead worse"
        elif _is_nothing_by_legs(ladder, last, ahead, pair):
            findings.suspected[effect.name] = "fitted to legs, its size is within two standard errors of nothing"
        else:
            kept.append((pair, ahead))
    return kept


def _worse(before: Ahead | None, after: Ahead | None) -> bool:
    """Return whether a model predicts legs worse than another, or diverges where that does not."""
    return before is not None and (after is None or worsens(before, after))


def _raises(before: Ahead | None, after: Ahead | None) -> bool:
    """Return whether the misfit of manoeuvres left out rises by as much as an effect that matters lets it fall."""
    return before is not None and after is not None and paired(before.left_out, after.left_out).falls_by < -LEAST_PART


def _is_nothing_by_legs(ladder: Ladder, last: Step, ahead: Ahead | None, pair: tuple[Candidate, Confirmation]) -> bool:
    """Return whether predictions would take the parameters fitted to legs, and by these there is nothing of it.

    Of an error of an instrument legs say little: what the likelihood says of it stands.
    """
    effect, fit = pair[0].effect, pair[1].fit
    if ladder.shooting is None or ahead is None or effect.group == "sensor" or is_sized(ahead, effect):
        return False
    if ladder.probe is not last.fit:
        # without what is immaterial, which legs are not fitted with
        fit = ladder.refitted(last, effect)[1].fit
    return ladder.shooting.beside(ahead, fit).disagrees is not None


def _not_superseded(ladder: Ladder, steps: list[Step]) -> list[Step]:
    """Return the ladder without what was taken for the effect that was added last, where that alone does as well.

    Beside what it was taken for the true effect finds little left; the wrong one keeps a size of several standard
    errors, for the likelihood bends. So the question is what the last effect does without it. Where predictions chose
    the wrong one, and the last one predicts alike in its place, it stands there as if chosen so: they spoke for both.
    """
    last = steps[-1]
    assert last.added is not None
    for below, step in pairwise(steps[:-1]):
        assert step.added is not None
        beside = {candidate.effect.name: candidate for candidate in below.screened}
        first, second = beside.get(step.added.name), beside.get(last.added.name)
        if first is None or second is None or not alike(first, second) > ALIKE:
            continue
        by_prediction = step.stability is not None
        if by_prediction and last.predicts_by_legs and last.added.polynomial and not step.added.polynomial:
            # a term of a series goes wrong beyond the logs first, and of a model that lacks something the likelihood
            # does not choose the form
            continue
        ahead = ladder.ahead(below, last.added) if by_prediction else None
        alike_ahead = step.ahead is not None and ahead is not None and not worsens(step.ahead, ahead)
        without = ladder.in_place(step, steps, ahead) if alike_ahead else ladder.without(step.added, steps)
        gained = 2.0 * (last.fit.log_likelihood - without[-1].fit.log_likelihood)
        if gained - price_of(step.added, last.fit) < BIC_SAVING and not _worse(last.ahead, without[-1].ahead):
            return without
    return steps


def _idle(steps: Sequence[Step]) -> Effect | None:
    """Return an effect that the likelihood added before the last one and that is absent in the last fit, or None."""
    fit, at = steps[-1].fit, 0
    added = {step.added.name for step in steps[1:-1] if step.added is not None and step.stability is None}
    for effect in fit.model.effects:
        own = slice(at, at + len(effect.parameters))
        at = own.stop
        value, std = fit.values[own], fit.std[6:][own]
        if effect.name in added and not np.any(np.abs(value) > _SEEN * np.nan_to_num(std, nan=0.0)):
            return effect
    return None
