"""The screen: what every candidate would add to the fitted model, without refitting it.

Score (Lagrange multiplier) statistic of each candidate with all fitted parameters as nuisance: with the candidate's
columns S of the whitened innovations and S' = (I - P_0) S what the fitted ones cannot imitate, LM = e'S'(S'S')^-1 S'e,
chi-squared with as many degrees of freedom as the candidate has parameters, and the expected parameter change
(S'S')^-1 S'e. Reference: Breusch & Pagan (1980), "The Lagrange multiplier test and its applications to model
specification in econometrics", Review of Economic Studies 47; Saris, Satorra & Sorbom (1987), "The detection and
correction of specification errors in structural equation models", Sociological Methodology 17.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.stats import chi2

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.effect_responses import EffectTrial, responses
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import Linearised, PooledFit
from kempf.pipeline.estimate.sensitivity import N_HULL
from kempf.schemas.effect import Effect

#: share of an effect that the fitted parameters imitate, above which it cannot be tested
NOT_TESTABLE = 0.999


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
    #: Shape (N,). S' times the change: what the effect would explain of the whitened innovations.
    direction: Float
    #: Where on its grid it was tried.
    steps: tuple[float, ...]
    #: Channels of the runs that show it already; then it is not scored.
    measured_by: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Nuisance:
    """The innovations of all runs in one column, and an orthonormal basis of what the fitted parameters span."""

    #: Shape (N,).
    u: Float
    #: Shape (N, q).
    basis: Float

    def clean(self, columns: Float) -> Float:
        """Return columns without what the fitted parameters can imitate, shape (N, c)."""
        result: Float = columns - self.basis @ (self.basis.T @ columns)
        return result


def nuisance(lines: Sequence[Linearised], shared: int) -> Nuisance:
    """Return the basis of hull, effects and noise levels of all runs.

    Parameters
    ----------
    shared : int
        How many parameters the runs share; the others are each run's own.
    """
    own = [line.J[:, [k for k, i in enumerate(line.index) if i >= shared]] for line in lines]
    common = [line.J[:, [k for k, i in enumerate(line.index) if i < shared]] for line in lines]
    # the levels of one run touch no other: their bases stand below each other, and only what is shared meets them all
    q_own = [_orthonormal(columns) for columns in own]
    rest = np.concatenate([c - q @ (q.T @ c) for c, q in zip(common, q_own, strict=True)])
    u = np.concatenate([line.u for line in lines])
    blocks = np.zeros((u.size, sum(q.shape[1] for q in q_own)))
    row = column = 0
    for q in q_own:
        blocks[row : row + q.shape[0], column : column + q.shape[1]] = q
        row, column = row + q.shape[0], column + q.shape[1]
    return Nuisance(u, np.column_stack([blocks, _orthonormal(rest)]))


def _orthonormal(columns: Float) -> Float:
    norm = np.linalg.norm(columns, axis=0)
    kept = columns[:, norm > 0.0] / norm[norm > 0.0]
    if not kept.shape[1]:
        return np.zeros((columns.shape[0], 0))
    left, singular, _ = np.linalg.svd(kept, full_matrices=False)
    basis: Float = left[:, singular > 1e-9 * singular[0]]
    return basis


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
        Told of what has been tried.
    """
    present = {effect.name for effect in base.model.effects}
    chosen = [effect for effect in effects.values() if effect.name not in present]
    known = nuisance(base.linearised, N_HULL + len(base.model.names))
    scored = _scored(base, known, chosen, workers, listener)
    adjusted = _adjusted([candidate.p_value for candidate in scored])
    scored = [replace(candidate, p_adjusted=p) for candidate, p in zip(scored, adjusted, strict=True)]
    return sorted(scored, key=lambda candidate: (-np.nan_to_num(candidate.score, nan=-1.0), candidate.effect.name))


def _missing_channels(base: PooledFit, effect: Effect) -> tuple[str, ...]:
    """Return the channels that an effect needs and some of the runs lack."""
    return tuple(c for c in effect.needs if any(c not in filtered.run.channels for filtered in base.runs))


def _measuring_channels(base: PooledFit, effect: Effect) -> tuple[str, ...]:
    """Return the channels that show an effect already in every run."""
    return tuple(c for c in effect.measured_by if all(c in filtered.run.channels for filtered in base.runs))


def score(base: PooledFit, effect: Effect, workers: Executor) -> Candidate:
    """Score one effect beside a fitted model; its p-value is adjusted for its own grid alone."""
    (candidate,) = _scored(base, nuisance(base.linearised, N_HULL + len(base.model.names)), [effect], workers)
    return replace(candidate, p_adjusted=candidate.p_value)


def _scored(
    base: PooledFit, known: Nuisance, effects: Sequence[Effect], workers: Executor, listener: Listener = SILENT
) -> list[Candidate]:
    nothing = [_untested(base, effect) for effect in effects]
    # what a channel shows already is in the inputs: scored beside them it would imitate something else
    tried = [candidate.effect for candidate in nothing if not (candidate.missing or candidate.measured_by)]
    trials = [EffectTrial(effect, steps) for effect in tried for steps in _grid(effect)]
    columns = responses(base, trials, workers, listener)
    moved = {(trial.effect.name, trial.steps): column for trial, column in zip(trials, columns, strict=True)}
    return list(workers.map(lambda candidate: _best(known, candidate, moved), nothing))


def _untested(base: PooledFit, effect: Effect) -> Candidate:
    unknown = np.full(len(effect.parameters), np.nan)
    missing, measured_by = _missing_channels(base, effect), _measuring_channels(base, effect)
    return Candidate(effect, np.nan, 1.0, 1.0, unknown, unknown, np.nan, missing, np.zeros(0), (), measured_by)


def _best(
    known: Nuisance, nothing: Candidate, moved: Mapping[tuple[str, tuple[float, ...]], Float | None]
) -> Candidate:
    """Return an effect at the point of its grid where it explains most, or untested where there is none."""
    best, tries = nothing, 0
    for steps in _grid(nothing.effect):
        columns = moved.get((nothing.effect.name, steps))
        if columns is None:
            continue
        tries += 1
        tested = _tested(known, columns, nothing.effect, steps)
        if best is nothing or tested.p_value < best.p_value or np.isnan(best.score):
            best = tested
    # the largest of several tries is larger than any one of them: Bonferroni
    return replace(best, p_value=min(1.0, max(tries, 1) * best.p_value))


def _grid(effect: Effect) -> list[tuple[float, ...]]:
    """Return the points at which an effect is tried: its first parameter and those of shape over all their steps."""
    choices = [p.steps if k == 0 or p.shapes else p.steps[:1] for k, p in enumerate(effect.parameters)]
    return list(product(*choices))


def _tested(known: Nuisance, columns: Float, effect: Effect, steps: tuple[float, ...]) -> Candidate:
    clean = known.clean(columns)
    before, after = float(np.sum(columns**2)), float(np.sum(clean**2))
    absorption = 1.0 - after / before if before > 0.0 else 1.0
    unknown = np.full(len(effect.parameters), np.nan)
    if absorption > NOT_TESTABLE or before == 0.0 or np.any(np.sum(clean**2, axis=0) == 0.0):
        return Candidate(effect, np.nan, 1.0, 1.0, unknown, unknown, absorption, (), np.zeros(0), steps)
    information = clean.T @ clean
    scale = np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-9, hermitian=True) / np.outer(scale, scale)
    gradient = clean.T @ known.u
    estimate = inverse @ gradient
    score = float(gradient @ estimate)
    made = np.array([not p.shapes for p in effect.parameters])
    change, std = np.array(steps, dtype=np.float64), unknown.copy()
    change[made], std[made] = estimate, np.sqrt(np.diag(inverse))
    return Candidate(
        effect=effect,
        score=score,
        p_value=float(chi2.sf(score, estimate.size)) if _plausible(effect, change) else 1.0,
        p_adjusted=1.0,
        change=change,
        std=std,
        absorption=absorption,
        missing=(),
        direction=clean @ estimate,
        steps=steps,
    )


def _plausible(effect: Effect, change: Float) -> bool:
    """Tell whether the change goes where the effect can be at all: a rudder cannot answer before it moves."""
    inside = [np.clip(x, p.low, p.high) for x, p in zip(change, effect.parameters, strict=True)]
    return any(x != 0.0 for x, p in zip(inside, effect.parameters, strict=True) if not p.shapes)


def _adjusted(p_values: Sequence[float]) -> list[float]:
    """Adjust p-values for their number under any dependence (Benjamini & Yekutieli 2001, Annals of Statistics 29)."""
    p = np.asarray(p_values)
    if not p.size:
        return []
    order = np.argsort(p, kind="stable")
    m = p.size
    harmonic = float(np.sum(1.0 / np.arange(1, m + 1)))
    raised = p[order] * m * harmonic / np.arange(1, m + 1)
    smallest = np.minimum(1.0, np.minimum.accumulate(raised[::-1])[::-1])
    result = np.empty(m)
    result[order] = smallest
    return [float(x) for x in result]
