"""Diagnosis: structure by prediction one leg ahead, then by likelihood; and what says whether anything is left.

Effects are added one at a time. First those that make manoeuvres left out better predicted one leg ahead
(`kempf.pipeline.diagnose.steps.by_prediction`), then those that the likelihood is sure of
(`kempf.pipeline.diagnose.steps.by_likelihood`): what of these changes neither a prediction nor a parameter by more
than its error is listed as immaterial and stays out of the ladder. Held-out manoeuvres are chosen before the first
screen and never fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

from kempf.pipeline.channels.found_instants import FoundInstants
from kempf.pipeline.diagnose.screening.found_instants import FittedRuns, LayOut, at_found_instants, fitted_runs
from kempf.pipeline.diagnose.screening.resolution import MAY_IMITATE, Unresolved, unresolved
from kempf.pipeline.diagnose.screening.ridge_reference import RidgeReference, ridge_reference_of
from kempf.pipeline.diagnose.screening.screen import screen
from kempf.pipeline.diagnose.settings import STANDARD, DiagnosisSettings
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.diagnose.steps.by_likelihood import certain_ones
from kempf.pipeline.diagnose.steps.by_prediction import predicting_better
from kempf.pipeline.diagnose.steps.final_sizes import Size, final_sizes
from kempf.pipeline.diagnose.steps.immaterial import Immaterial
from kempf.pipeline.diagnose.steps.ladder import Ladder
from kempf.pipeline.diagnose.steps.ladder_step import Step, make_step, step_of, without_members
from kempf.pipeline.diagnose.verdicts.remainder import something_left
from kempf.pipeline.diagnose.verdicts.remaining_misfit import RemainingMisfit, remaining_misfit
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.plain_fit import PlainFit
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.shooting.ahead import Ahead, shooting_range
from kempf.schemas.effect import Effect
from kempf.schemas.enumeration import counted
from kempf.schemas.model_spec import ModelSpec


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a diagnosis found; `kempf.pipeline.diagnose.verdicts.sentences` puts it in words."""

    #: The plain model, then with one given effect more after the other; the last one is diagnosed.
    way: tuple[PooledFit, ...]
    #: The same but the diagnosed one, as rungs; empty where that is plain.
    given: tuple[Step, ...]
    #: The diagnosed model first; the effects of the others are claimed.
    steps: tuple[Step, ...]
    #: By name, how large the effects of ``steps`` are in the last of these; and what else is in their sets, in place of
    #: them.
    sizes: Mapping[str, Size]
    #: Steps after them whose effects only the likelihood chose, while something that no effect explains is left, or
    #: readings do not resolve her motion: they improve the fit and may imitate that.
    imitating: tuple[Step, ...]
    #: Whether something is left that the catalogue does not name.
    something_left: bool
    #: Which readings are too far apart for such a ship; None where they resolve her motion.
    unresolved: Unresolved | None
    #: before, after: The flexible reference beside the plain model and beside the last; None with a single run.
    before: RidgeReference | None
    after: RidgeReference | None
    #: Certain, and changing nothing that a user predicts.
    immaterial: tuple[Immaterial, ...]
    #: Significant one step ahead, but not beyond what errors that hang together allow, or making predictions worse: by
    #: name, why.
    suspected: Mapping[str, str]
    #: What the last model claimed leaves one leg ahead; None with a single run, or where it runs away.
    remaining: RemainingMisfit | None
    fitted: tuple[GridRun, ...]
    held: tuple[GridRun, ...]
    plain: PlainFit
    settings: DiagnosisSettings
    #: The diagnosed model and those on the way to it, as parameter sets are fitted: with the instants of measurement as
    #: they are taken. It is what was diagnosed where none were found.
    as_taken: FittedRuns
    #: By number of the log, the instants that were found, at which the runs are laid out.
    found: Mapping[int, FoundInstants]


def diagnose(
    runs: Sequence[GridRun],
    spec: ModelSpec,
    effects: Mapping[str, Effect],
    workers: Executor,
    settings: DiagnosisSettings = STANDARD,
    given: Sequence[Effect] = (),
    listener: Listener = SILENT,
    lay_out: LayOut | None = None,
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
    listener : Listener, optional
        Notified of what is being done and of every iteration.
    lay_out : callable, optional
        Lays all runs out at other instants of measurement; without it they stay as they are.
    """
    chosen, apart = split(runs)
    listener.begins(f"fitting the model to {len(chosen)} manoeuvres, {len(apart)} held out")
    as_taken = made = fitted_runs(runs, spec, given, workers, listener)
    if lay_out is not None:
        made = at_found_instants(as_taken, lay_out, given, workers, listener)
    fits, base = made.fits, made.fits[-1]
    held = [made.runs[i] for i in apart]
    shooting = None
    if len(chosen) > 1:
        listener.begins("predicting one leg ahead")
        shooting = shooting_range([filtered.run for filtered in base.runs], held, base.runs[0].spec, workers)
    listener.begins(f"screening {counted(len(effects), 'effect')}")
    screened = screen(base, effects, workers, listener)
    models: Sequence[Ahead | None] = [None] * len(fits) if shooting is None else shooting.way(fits)
    rungs = tuple(step_of(fit, held, ahead, workers) for fit, ahead in zip(fits[:-1], models[:-1], strict=True))
    first = make_step(base, None, (), (), held, screened, workers, models[-1])
    before = ridge_reference_of(base, workers) if len(chosen) > 1 else None
    ladder = Ladder(shooting, effects, held, workers, settings, listener, base)
    steps = predicting_better(ladder, [first])
    findings = certain_ones(ladder, steps)
    steps = findings.steps
    listener.begins("measuring what is left")
    after = before
    if before is not None and ladder.probe is not base:
        after = ridge_reference_of(ladder.probe, workers)
    left = something_left(steps, before, after)
    too_far = unresolved(made.runs)
    kept = _claimed(steps) if left or too_far is not None else len(steps)
    ahead = steps[kept - 1].ahead
    listener.begins("sizing what was found")
    claimed = without_members(steps[:kept])
    sizes = final_sizes(claimed, workers, listener)
    return Diagnosis(
        way=fits,
        given=rungs,
        steps=tuple(claimed),
        sizes=sizes,
        imitating=tuple(steps[kept:]),
        something_left=left,
        unresolved=too_far,
        before=before,
        after=after,
        immaterial=() if too_far else tuple(findings.immaterial),
        suspected={**findings.suspected, **_imitating(findings.immaterial)} if too_far else findings.suspected,
        remaining=None if ahead is None else remaining_misfit(ahead, workers),
        fitted=tuple(filtered.run for filtered in base.runs),
        held=tuple(held),
        plain=made.plain,
        settings=settings,
        as_taken=as_taken,
        found=made.found,
    )


def _imitating(immaterial: Sequence[Immaterial]) -> dict[str, str]:
    """Return why effects that are certain by their likelihood are not, where readings are too far apart, by name."""
    return {candidate.effect.name: MAY_IMITATE for one in immaterial for candidate, _ in one.chosen_from}


def _claimed(steps: Sequence[Step]) -> int:
    """Return how many steps are claimed though something else may be there: those that predictions of legs chose.

    What was chosen by its prediction of manoeuvres left out, and by every repetition without one of them, is there
    though something else may be missing too; what only the likelihood sees may imitate that.
    """
    return max(number for number, step in enumerate(steps) if number == 0 or step.stability is not None) + 1
