"""The screen: what every candidate would add to the fitted model, without refitting it.

Score (Lagrange multiplier) statistic of each candidate with all fitted parameters as nuisance: with the candidate's
columns S of the whitened innovations and S' = (I - P_0) S what the fitted ones cannot imitate, LM = e'S'(S'S')^-1 S'e,
chi-squared with as many degrees of freedom as the candidate has parameters, and the expected parameter change
(S'S')^-1 S'e. Both S and e allow for what of the speed may be noise
(`kempf.pipeline.diagnose.screening.speed_noise`). Reference: Breusch & Pagan (1980), "The Lagrange multiplier test and
its applications to model specification in econometrics", Review of Economic Studies 47; Saris, Satorra & Sorbom (1987),
"The detection and correction of specification errors in structural equation models", Sociological Methodology 17.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.screening.effect_score import (
    NOT_TESTABLE,
    adjusted,
    grid,
    measuring_channels,
    missing_channels,
    plausible,
    solved,
)
from kempf.pipeline.diagnose.screening.nuisance import Nuisance, nuisance
from kempf.pipeline.diagnose.screening.speed_noise import SpeedNoise, speed_noise
from kempf.pipeline.distributions import chi2_tail
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effect import Effect
from kempf.schemas.model_spec import N_HULL


def _nothing() -> Float:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Candidate:
    """One effect against the fitted model."""

    effect: Effect
    #: LM; NaN where the effect cannot be tested.
    score: float
    #: p_value, p_adjusted: Of the score; the second by Benjamini & Yekutieli (2001) over the catalogue.
    p_value: float
    p_adjusted: float
    #: change, std: Shape (p,). Expected parameter change and its standard error, in the parameters' units.
    change: Float
    std: Float
    #: Share of the effect's whitened trace that the fitted parameters imitate.
    absorption: float
    #: Channels it needs that the runs lack.
    missing: tuple[str, ...]
    #: Shape (N,). S' times the change: what the effect would explain of ``innovations``.
    direction: Float
    #: Where on its grid it was tried.
    steps: tuple[float, ...]
    #: Channels of the runs that show it already; then it is not scored.
    measured_by: tuple[str, ...] = ()
    #: Shape (N,). e; its product with ``direction`` is the score.
    innovations: Float = field(default_factory=_nothing)


def screen(
    base: PooledFit, effects: Mapping[str, Effect], workers: Executor, listener: Listener = SILENT
) -> list[Candidate]:
    """Score every effect that the model does not have yet, the highest first.

    Parameters
    ----------
    base : PooledFit
        The fitted model.
    effects : mapping
        Catalogue.
    workers : Executor
        Effects share it; nothing depends on it.
    listener : Listener, optional
        Notified of what has been tried.
    """
    present = {effect.name for effect in base.model.effects}
    chosen = [effect for effect in effects.values() if effect.name not in present]
    scored = _scored(base, chosen, workers, listener)
    raised = adjusted([candidate.p_value for candidate in scored])
    scored = [replace(candidate, p_adjusted=p) for candidate, p in zip(scored, raised, strict=True)]
    return sorted(scored, key=lambda candidate: (-np.nan_to_num(candidate.score, nan=-1.0), candidate.effect.name))


def score(base: PooledFit, effect: Effect, workers: Executor) -> Candidate:
    """Score one effect beside a fitted model; its p-value is adjusted for its own grid alone."""
    (candidate,) = _scored(base, [effect], workers)
    return replace(candidate, p_adjusted=candidate.p_value)


def _scored(
    base: PooledFit, effects: Sequence[Effect], workers: Executor, listener: Listener = SILENT
) -> list[Candidate]:
    nothing = [_untested(base, effect) for effect in effects]
    # what a channel shows already is in the inputs: scored beside them it would imitate something else
    tried = [candidate.effect for candidate in nothing if not (candidate.missing or candidate.measured_by)]
    trials = [EffectTrial(effect, steps) for effect in tried for steps in grid(effect)]
    columns = responses(base, trials, workers, listener)
    moved = {(trial.effect.name, trial.steps): column for trial, column in zip(trials, columns, strict=True)}
    noise = speed_noise(base, workers)
    known = nuisance(noise.of(base).linearised, N_HULL + len(base.model.names))
    return list(workers.map(lambda candidate: _best(known, noise, candidate, moved), nothing))


def _untested(base: PooledFit, effect: Effect) -> Candidate:
    unknown = np.full(len(effect.parameters), np.nan)
    missing, measured_by = missing_channels(base, effect), measuring_channels(base, effect)
    return Candidate(effect, np.nan, 1.0, 1.0, unknown, unknown, np.nan, missing, np.zeros(0), (), measured_by)


def _best(
    known: Nuisance, noise: SpeedNoise, nothing: Candidate, moved: Mapping[tuple[str, tuple[float, ...]], Float | None]
) -> Candidate:
    """Return an effect at the point of its grid where it explains most, or untested where there is none."""
    best, tries = nothing, 0
    for steps in grid(nothing.effect):
        columns = moved.get((nothing.effect.name, steps))
        if columns is None:
            continue
        tries += 1
        tested = _tested(known, noise.beside(columns), nothing.effect, steps)
        if best is nothing or tested.p_value < best.p_value or np.isnan(best.score):
            best = tested
    # the largest of several tries is larger than any one of them: Bonferroni
    return replace(best, p_value=min(1.0, max(tries, 1) * best.p_value))


def _tested(known: Nuisance, columns: Float, effect: Effect, steps: tuple[float, ...]) -> Candidate:
    clean = known.clean(columns)
    before, after = float(np.sum(columns**2)), float(np.sum(clean**2))
    absorption = 1.0 - after / before if before > 0.0 else 1.0
    unknown = np.full(len(effect.parameters), np.nan)
    if absorption > NOT_TESTABLE or before == 0.0 or np.any(np.sum(clean**2, axis=0) == 0.0):
        return Candidate(effect, np.nan, 1.0, 1.0, unknown, unknown, absorption, (), np.zeros(0), steps)
    solution = solved(clean, known.u, effect, steps)
    return Candidate(
        effect=effect,
        score=solution.score,
        p_value=chi2_tail(solution.score, solution.estimate.size) if plausible(effect, solution.change) else 1.0,
        p_adjusted=1.0,
        change=solution.change,
        std=solution.std,
        absorption=absorption,
        missing=(),
        direction=clean @ solution.estimate,
        steps=steps,
        innovations=known.u,
    )
