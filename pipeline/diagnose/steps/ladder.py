"""What a ladder is climbed with: manoeuvres, catalogue and settings; a step put on it, and one taken out again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

from kempf.pipeline.diagnose.screening.instrument_noise import with_instrument_noise
from kempf.pipeline.diagnose.screening.screen import Candidate, score, screen
from kempf.pipeline.diagnose.settings import DiagnosisSettings
from kempf.pipeline.diagnose.steps.confirm import Confirmation, Unseen, confirm, unseen
from kempf.pipeline.diagnose.steps.ladder_step import Step, make_step
from kempf.pipeline.estimate.iteration import Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.shooting.ahead import Ahead, ShootingRange
from kempf.schemas.effect import Effect

Pairs = tuple[tuple[Candidate, Confirmation], ...]


@dataclass(eq=False)
class Ladder:
    """What a ladder is climbed with."""

    #: None where one manoeuvre alone is fitted.
    shooting: ShootingRange | None
    effects: Mapping[str, Effect]
    held: Sequence[GridRun]
    workers: Executor
    settings: DiagnosisSettings
    listener: Listener
    #: The model with everything that was found, immaterial or not: what is left is looked for beside it.
    probe: PooledFit
    #: Refits that were climbed to the end: who predicts and who asks the likelihood ask for the same ones.
    refits: dict[tuple[PooledFit, str], Confirmation] = field(default_factory=dict)
    #: Effects of which nothing came, whatever size and hull they began from: they race no more.
    in_vain: set[str] = field(default_factory=set)

    def confirmed(
        self, base: PooledFit, alone: Unseen, candidate: Candidate, most_bic: float = float("inf")
    ) -> Confirmation:
        """Refit a model with one effect more, see `kempf.pipeline.diagnose.steps.confirm.confirm`."""
        known = self.refits.get((base, candidate.effect.name))
        if known is not None:
            return known
        self.listener.begins(f"refitting with {candidate.effect.title}")
        name = candidate.effect.name
        race = name not in self.in_vain
        confirmation = confirm(base, alone, candidate, self.held, self.workers, most_bic, self.listener, race=race)
        if confirmation.likelihood_ratio <= 0.0:
            self.in_vain.add(name)
        if not confirmation.outdone:
            self.refits[base, name] = confirmation
        return confirmation

    def refitted(self, last: Step, effect: Effect) -> tuple[Candidate, Confirmation]:
        """Refit the model of a rung with one effect more, of which that rung's screen need not know."""
        candidate = score(last.fit, effect, self.workers)
        return candidate, self.confirmed(last.fit, self.unseen(last), candidate)

    def unseen(self, step: Step) -> Unseen:
        """Return how a rung predicts what it did not see; its confirmation has asked that already."""
        if step.chosen_from and step.chosen_from[0][1].fit is step.fit:
            return step.chosen_from[0][1].unseen
        return unseen(step.fit, self.held, self.workers)

    def ahead(self, last: Step, effect: Effect) -> Ahead | None:
        """Return the model of a rung with one effect more one leg ahead, None where it diverges or nothing is shot."""
        if self.shooting is None or last.ahead is None:
            return None
        return self.shooting.with_effect(last.ahead, effect)

    def stepped(self, close: Pairs, others: Pairs, ahead: Ahead | None, stability: float | None) -> Step:
        """Return the rung of the first of what these data do not distinguish.

        Parameters
        ----------
        close, others : tuple of (Candidate, Confirmation)
            Chosen from, and refused.
        """
        candidate, best = close[0]
        self.listener.begins(f"screening beside {candidate.effect.title}")
        fit = with_instrument_noise(best.fit, self.workers, self.listener)
        screened = screen(fit, self.effects, self.workers, self.listener)
        if self.shooting is not None and ahead is not None:
            ahead = self.shooting.beside(ahead, fit)
        step = make_step(fit, candidate.effect, close, others, self.held, screened, self.workers, ahead)
        return replace(step, stability=stability)

    def without(self, idle: Effect, steps: Sequence[Step]) -> list[Step]:
        """Climb the ladder again without an effect; what was refused on the way stays listed."""
        self.listener.begins(f"{idle.title} is no longer needed")
        kept = [step for step in steps[1:] if step.added is not None and step.added.name != idle.name]
        return self._climbed([steps[0]], kept, steps, {idle.name: None})

    def in_place(self, step: Step, steps: Sequence[Step], ahead: Ahead | None) -> list[Step]:
        """Climb the ladder again with the last effect in the place of the one of a rung, which stays in its set.

        Parameters
        ----------
        step : Step
            One of ``steps``, chosen by predictions: what takes its place keeps its stability.
        ahead : Ahead or None
            The model below that rung with the last effect, one leg ahead.
        """
        last = steps[-1].added
        assert last is not None
        assert step.added is not None
        self.listener.begins(f"{last.title} in place of {step.added.title}")
        at = next(number for number, rung in enumerate(steps) if rung is step)
        below, kept = list(steps[:at]), [rung for rung in steps[at + 1 : -1] if rung.added is not None]
        others = tuple(pair for pair in step.chosen_from if pair[0].effect.name != last.name)
        refused = tuple(pair for pair in step.refused if pair[0].effect.name != last.name)
        again = self.stepped((self.refitted(below[-1], last), *others), refused, ahead, step.stability)
        names = {step.added.name: last.name}
        below = [replace(rung, together=_renamed(rung.together, names)) for rung in below]
        again = replace(again, together=_renamed(step.together, names))
        return self._climbed([*below, again], kept, steps, names)

    def _climbed(
        self, rungs: list[Step], kept: Sequence[Step], steps: Sequence[Step], names: Mapping[str, str | None]
    ) -> list[Step]:
        """Put the effects of rungs on others once more.

        Parameters
        ----------
        names : mapping of str to (str or None)
            What takes the place of an effect that is gone, if anything does.
        """
        chosen = {candidate.effect.name for rung in rungs for candidate, _ in rung.chosen_from}
        chosen |= {step.added.name for step in kept if step.added is not None}
        refused = [
            pair for old in steps[1:] for pair in (*old.chosen_from, *old.refused) if pair[0].effect.name not in chosen
        ]
        for step in kept:
            assert step.added is not None
            pair, ahead = self.refitted(rungs[-1], step.added), self.ahead(rungs[-1], step.added)
            again = self.stepped((pair,), tuple(refused), ahead, step.stability)
            rungs.append(replace(again, together=_renamed(step.together, names)))
        return rungs


def _renamed(together: Sequence[str], names: Mapping[str, str | None]) -> tuple[str, ...]:
    """Return the effects that belong together with other names; one alone belongs with nothing."""
    now = tuple(dict.fromkeys(name for old in together if (name := names.get(old, old)) is not None))
    return now if len(now) > 1 else ()
