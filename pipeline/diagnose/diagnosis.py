"""Diagnosis: screen, confirm, sets, step, and the reference that says whether anything is left.

Effects are added one at a time, the simplest of the best set first, until no candidate stands the tests. Held-out
manoeuvres are chosen before the first screen and never fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.diagnose.confirm import Confirmation, Unseen, confirm, unseen
from kempf.pipeline.diagnose.confusion_sets import WINDOW, shortlist, undecided
from kempf.pipeline.diagnose.forward_selection import is_ship, staged
from kempf.pipeline.diagnose.ladder_step import Step, make_step
from kempf.pipeline.diagnose.ridge_reference import RidgeReference, ridge_reference_of
from kempf.pipeline.diagnose.screen import Candidate, score, screen
from kempf.pipeline.diagnose.settings import STANDARD, DiagnosisSettings
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.estimate.plain_fit import PlainFit
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.effect import Effect
from kempf.schemas.model_spec import ModelSpec

Announce = Callable[[str], None]
#: how many times its score a refit gains at most, as far as has been seen; a hull bent by what is missing hides much
_MOST_GAIN = 10.0
#: standard errors from nothing below which an effect added before is taken out again
_SEEN = 2.0


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a diagnosis found; `kempf.pipeline.diagnose.verdict` puts it in words."""

    #: The plain model, then with one given effect more after the other; the last one is diagnosed.
    way: tuple[PooledFit, ...]
    #: The diagnosed model first.
    steps: tuple[Step, ...]
    #: before, after: The flexible reference beside the plain model and beside the last; None with a single run.
    before: RidgeReference | None
    after: RidgeReference | None
    fitted: tuple[GridRun, ...]
    held: tuple[GridRun, ...]
    plain: PlainFit
    settings: DiagnosisSettings


def _silent(_: str) -> None:
    return


def diagnose(
    runs: Sequence[GridRun],
    spec: ModelSpec,
    effects: Mapping[str, Effect],
    workers: Executor,
    settings: DiagnosisSettings = STANDARD,
    given: Sequence[Effect] = (),
    announce: Announce = _silent,
) -> Diagnosis:
    """Find what a vessel's model lacks.

    Parameters
    ----------
    runs : sequence of GridRun
        All usable manoeuvres in order of time.
    spec : ModelSpec
        Disturbances.
    effects : mapping
        Catalogue.
    given : sequence of Effect, optional
        Effects that the model has already.
    announce : callable, optional
        Called with what is being done, for a progress line.
    """
    chosen, left = split(runs)
    announce(f"fitting the model to {len(chosen)} manoeuvres, {len(left)} held out")
    plain, fits = staged([runs[i] for i in chosen], spec, given, workers)
    base = fits[-1]
    held = [runs[i] for i in left]
    announce(f"screening {len(effects)} effects")
    steps = [make_step(base, None, (), (), held, screen(base, effects, workers), workers)]
    before = ridge_reference_of(base, workers) if len(chosen) > 1 else None
    while len(steps) <= settings.most_steps:
        last = steps[-1]
        tried: list[tuple[Candidate, Confirmation]] = []
        worth = shortlist(last.screened, settings.level, settings.refits)
        if not worth:
            break
        alone = _unseen(last, held, workers)
        for candidate in worth:
            # the score predicts the likelihood ratio, but not beside what is no ship; what is far behind the best refit
            # cannot come near it
            if is_ship(last.fit.hull) and any(
                candidate.score * _MOST_GAIN < k.likelihood_ratio - WINDOW for _, k in tried if k.holds
            ):
                continue
            announce(f"step {len(steps)}: refitting with {candidate.effect.title}")
            most = min((k.bic_change for _, k in tried if k.holds), default=np.inf) + WINDOW
            tried.append((candidate, confirm(last.fit, alone, candidate, held, workers, most)))
        best = undecided([pair for pair in tried if pair[1].holds])
        if not best:
            steps[-1] = replace(last, refused=(*last.refused, *tried))
            break
        names = {candidate.effect.name for candidate, _ in best}
        worse = tuple(pair for pair in tried if pair[0].effect.name not in names)
        fit = best[0][1].fit
        announce(f"step {len(steps)}: screening beside {best[0][0].effect.title}")
        screened = screen(fit, effects, workers)
        steps.append(make_step(fit, best[0][0].effect, tuple(best), worse, held, screened, workers))
        idle = _idle(steps)
        if idle is not None:
            announce(f"step {len(steps) - 1}: {idle.title} is no longer significant")
            steps = _without(idle, steps, held, effects, workers)
    announce("measuring what is left")
    after = ridge_reference_of(steps[-1].fit, workers) if before is not None and len(steps) > 1 else before
    fitted = tuple(filtered.run for filtered in base.runs)
    return Diagnosis(tuple(fits), tuple(steps), before, after, fitted, tuple(held), plain, settings)


def _unseen(step: Step, held: Sequence[GridRun], workers: Executor) -> Unseen:
    """Return how a rung predicts what it did not see; its confirmation has asked that already."""
    return step.chosen_from[0][1].unseen if step.chosen_from else unseen(step.fit, held, workers)


def _idle(steps: Sequence[Step]) -> Effect | None:
    """Return an effect added before the last one that is absent in the last fit, None where all are significant."""
    fit, at = steps[-1].fit, 0
    added = {step.added.name for step in steps[1:-1] if step.added is not None}
    for effect in fit.model.effects:
        own = slice(at, at + len(effect.parameters))
        at = own.stop
        value, std = fit.values[own], fit.std[6:][own]
        if effect.name in added and not np.any(np.abs(value) > _SEEN * np.nan_to_num(std, nan=0.0)):
            return effect
    return None


def _without(
    idle: Effect, steps: list[Step], held: Sequence[GridRun], effects: Mapping[str, Effect], workers: Executor
) -> list[Step]:
    """Climb the ladder again without an effect; what was refused on the way stays listed."""
    made = [steps[0]]
    refused = [pair for old in steps[1:] for pair in (*old.chosen_from, *old.refused)]
    for step in steps[1:]:
        if step.added is None or step.added.name == idle.name:
            continue
        base = made[-1].fit
        candidate = score(base, step.added, workers)
        confirmation = confirm(base, _unseen(made[-1], held, workers), candidate, held, workers)
        others = tuple(pair for pair in refused if pair[0].effect.name != step.added.name)
        screened = screen(confirmation.fit, effects, workers)
        made.append(
            make_step(confirmation.fit, step.added, ((candidate, confirmation),), others, held, screened, workers)
        )
    return made
