"""Which effect would explain a stretch of one manoeuvre: the score test of every effect on its instants alone.

The filter runs over whole manoeuvres, and only the sums of score and information stop at the ends of the stretch. With
u the whitened innovations at the fitted model, S what an effect would do to them and J what the fitted parameters do,
all of the fitted manoeuvres, an effect of size c leaves E u = (S - J (J'J)^-1 J'S) c behind: the fit has bent to it, in
every manoeuvre. With B an orthonormal basis of J, the rows of the stretch have the covariance V = I - B B', those of a
manoeuvre that was not fitted I + J C J' with C that of the shared parameters, both less what its own noise levels take.
Score and size are those of generalised least squares on these rows (Aitken 1936, Proceedings of the Royal Society of
Edinburgh 55); for a stretch of everything they are those of `kempf.pipeline.diagnose.screening.screen`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.diagnose.screening.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.screening.effect_score import (
    NOT_TESTABLE,
    Solved,
    adjusted,
    cosine_squared,
    grid,
    measuring_channels,
    missing_channels,
    plausible,
    solved,
)
from kempf.pipeline.diagnose.screening.speed_noise import speed_noise
from kempf.pipeline.diagnose.steps.confusion_sets import ALIKE
from kempf.pipeline.diagnose.stretches.stretch_rows import Rows, rows_of
from kempf.pipeline.distributions import chi2_tail
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effect import Effect

#: instants below which nothing is said: scores of fewer are not chi-squared
FEWEST = 20


@dataclass(frozen=True, eq=False)
class StretchEffect:
    """One effect against a stretch."""

    effect: Effect
    #: Of the stretch; NaN where its rows say nothing of it.
    here: Solved
    #: By all fitted manoeuvres.
    everywhere: Solved
    #: p_value, p_adjusted: Of the score here; the second by Benjamini & Yekutieli (2001) over all that were tested.
    p_value: float
    p_adjusted: float
    #: Share of the stretch's sum of squares that it would take away.
    explained: float
    #: Share of what it does to the stretch that the fitted parameters imitate.
    absorption: float
    #: Channels it needs that the manoeuvres lack, and those that show it already.
    missing: tuple[str, ...] = ()
    measured_by: tuple[str, ...] = ()
    #: Shape (2 m,). What it would explain of the rows, free of correlation.
    direction: Float = field(default_factory=lambda: np.zeros(0))
    #: Names of effects that would explain the stretch in the same way.
    alike: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Explained:
    """A stretch, and every effect against it."""

    #: Instants and measurements in it.
    instants: int
    measurements: int
    #: Sum of its squared whitened innovations; as large as ``measurements`` where the model is right.
    square: float
    #: p-value of that sum.
    p_misfit: float
    #: How many stretches as long as this one the manoeuvres hold.
    of_its_length: int
    #: The highest score first, then what is not testable; none where there are fewer than `FEWEST` instants.
    effects: tuple[StretchEffect, ...]

    @property
    def too_short(self) -> bool:
        """Whether there are too few instants."""
        return self.instants < FEWEST

    @property
    def beyond(self) -> float:
        """Share of the sum of squares beyond what a right model leaves."""
        return max(0.0, 1.0 - self.measurements / self.square) if self.square > 0.0 else 0.0


def explain(
    base: PooledFit, fitted: Sequence[bool], number: int, inside: Mask, effects: Mapping[str, Effect], workers: Executor
) -> Explained:
    """Score every effect that the model does not have on a stretch of one manoeuvre.

    Parameters
    ----------
    base : PooledFit
        The model at its fitted parameters, over the manoeuvres that it was fitted to and, where the stretch lies in
        another one, that one too.
    fitted : sequence of bool
        Which of these it was fitted to.
    number : int
        Which one the stretch lies in.
    inside : ndarray of bool, shape (n,)
        Which of its instants.
    effects : mapping
        Catalogue.
    workers : Executor
        Effects share it; nothing depends on it.
    """
    noise = speed_noise(base, workers)
    allowing = noise.of(base)
    rows = rows_of(allowing, fitted, number, inside)
    errors = rows.left(rows.all_rows(allowing))
    about_mean = errors[: errors.size // 2]
    square, count = float(about_mean @ about_mean), about_mean.size
    whole = sum(int(np.isfinite(filtered.run.measured).any(axis=1).sum()) for filtered in base.runs)
    nothing = Explained(
        instants=rows.instants,
        measurements=count,
        square=square,
        p_misfit=chi2_tail(square, count) if count else 1.0,
        of_its_length=max(1, whole // max(1, rows.instants)),
        effects=(),
    )
    if nothing.too_short:
        return nothing
    present = {effect.name for effect in base.model.effects}
    untested = [_untested(base, effect) for effect in effects.values() if effect.name not in present]
    tried = [candidate.effect for candidate in untested if not (candidate.missing or candidate.measured_by)]
    trials = [EffectTrial(effect, steps) for effect in tried for steps in grid(effect)]
    moved: dict[str, list[tuple[EffectTrial, Float]]] = {}
    for trial, columns in zip(trials, responses(base, trials, workers), strict=True):
        if columns is not None:
            moved.setdefault(trial.effect.name, []).append((trial, columns))
    free = rows.whitened(errors)

    def tested(candidate: StretchEffect) -> StretchEffect:
        every = moved.get(candidate.effect.name, [])
        return _best(candidate, [_tested(rows, errors, free, trial, noise.beside(columns)) for trial, columns in every])

    candidates = list(workers.map(tested, untested))
    return replace(nothing, effects=_ranked(candidates))


def _untested(base: PooledFit, effect: Effect) -> StretchEffect:
    none = _unknown(effect)
    missing, shown = missing_channels(base, effect), measuring_channels(base, effect)
    return StretchEffect(effect, none, none, 1.0, 1.0, 0.0, np.nan, missing, shown)


def _unknown(effect: Effect) -> Solved:
    unknown = np.full(len(effect.parameters), np.nan)
    return Solved(np.nan, np.zeros(0), unknown, unknown)


def _best(nothing: StretchEffect, tested: Sequence[StretchEffect]) -> StretchEffect:
    """Return an effect at the point of its grid where it explains most of the stretch."""
    if not tested:
        return nothing
    best = min(tested, key=lambda candidate: (candidate.p_value, -np.nan_to_num(candidate.here.score, nan=-1.0)))
    # the largest of several tries is larger than any one of them: Bonferroni
    return replace(best, p_value=min(1.0, len(tested) * best.p_value))


def _tested(rows: Rows, errors: Float, free: Float, trial: EffectTrial, columns: Float) -> StretchEffect:
    """Score one trial.

    Parameters
    ----------
    errors, free : ndarray, shape (2 m,)
        Innovations of the stretch without what the fitted parameters imitate, and these free of correlation.
    columns : ndarray, shape (N, c)
        What the effect does to all manoeuvres.
    """
    effect, steps = trial.effect, trial.steps
    left = rows.left(columns)
    own, seen = rows.of_stretch(columns), rows.whitened(left)
    before, after = float(np.sum(own**2)), float(np.sum(seen**2))
    absorption = 1.0 - min(1.0, after / before) if before > 0.0 else 1.0
    fitted = rows.known.clean(columns[: rows.known.u.size])
    everywhere = solved(fitted, rows.known.u, effect, steps) if _is_all_seen(fitted) else _unknown(effect)
    if absorption > NOT_TESTABLE or not _is_all_seen(seen):
        return StretchEffect(effect, _unknown(effect), everywhere, 1.0, 1.0, 0.0, absorption)
    here = solved(seen, free, effect, steps)
    half = errors.size // 2
    rest = errors[:half] - (left @ here.estimate)[:half]
    square = float(errors[:half] @ errors[:half])
    return StretchEffect(
        effect=effect,
        here=here,
        everywhere=everywhere,
        p_value=chi2_tail(here.score, here.estimate.size) if plausible(effect, here.change) else 1.0,
        p_adjusted=1.0,
        explained=1.0 - float(rest @ rest) / square if square > 0.0 else 0.0,
        absorption=absorption,
        direction=seen @ here.estimate,
    )


def _is_all_seen(columns: Float) -> bool:
    return bool(np.all(np.sum(columns**2, axis=0) > 0.0))


def _ranked(candidates: Sequence[StretchEffect]) -> tuple[StretchEffect, ...]:
    """Return effects with their p-values adjusted for their number, the least likely to be nothing first."""
    tested = [candidate for candidate in candidates if np.isfinite(candidate.here.score)]
    raised = adjusted([candidate.p_value for candidate in tested])
    tested = [replace(candidate, p_adjusted=p) for candidate, p in zip(tested, raised, strict=True)]
    tested.sort(key=lambda candidate: (candidate.p_value == 1.0, -candidate.here.score, candidate.effect.name))
    rest = sorted(
        (candidate for candidate in candidates if not np.isfinite(candidate.here.score)),
        key=lambda candidate: candidate.effect.name,
    )
    return (*(replace(candidate, alike=_alike(candidate, tested)) for candidate in tested), *rest)


def _alike(candidate: StretchEffect, others: Sequence[StretchEffect]) -> tuple[str, ...]:
    return tuple(
        o.effect.name for o in others if o is not candidate and cosine_squared(candidate.direction, o.direction) > ALIKE
    )
