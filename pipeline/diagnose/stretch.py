"""Which effect would explain a stretch of one manoeuvre: the score test of every effect on its instants alone.

The filter runs over whole manoeuvres, and only the sums of score and information stop at the ends of the stretch. With
u the whitened innovations at the fitted model, S what an effect would do to them and J what the fitted parameters do,
all of the fitted manoeuvres, an effect of size c leaves E u = (S - J (J'J)^-1 J'S) c behind: the fit has bent to it, in
every manoeuvre. With B an orthonormal basis of J, the rows of the stretch have the covariance V = I - B B', those of a
manoeuvre that was not fitted I + J C J' with C that of the shared parameters, both less what its own noise levels take.
Score and size are those of generalised least squares on these rows (Aitken 1936, Proceedings of the Royal Society of
Edinburgh 55); for a stretch of everything they are those of `kempf.pipeline.diagnose.screen`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.stats import chi2, false_discovery_control

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.confusion_sets import ALIKE
from kempf.pipeline.diagnose.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.screen import NOT_TESTABLE
from kempf.pipeline.diagnose.stretch_rows import Rows, rows_of
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.search.scoring import Mask
from kempf.schemas.effect import Effect

#: instants below which nothing is said: scores of fewer are not chi-squared
FEWEST = 20


@dataclass(frozen=True, eq=False)
class Sized:
    """Score of an effect and its size after one step of the search."""

    #: NaN where the rows say nothing of it.
    score: float
    #: change, std: Shape (p,). In the units of the parameters; of a shape the value at which it was tried, std NaN.
    change: Float
    std: Float


@dataclass(frozen=True, eq=False)
class StretchEffect:
    """One effect against a stretch."""

    effect: Effect
    here: Sized
    #: By all fitted manoeuvres.
    everywhere: Sized
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
    direction: Float | None = None
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
    rows = rows_of(base, fitted, number, inside)
    left = rows.left(rows.all_rows(base))
    about_mean = left[: left.size // 2]
    square, count = float(about_mean @ about_mean), about_mean.size
    whole = sum(int(np.isfinite(one.run.measured).any(axis=1).sum()) for one in base.runs)
    nothing = Explained(
        instants=rows.instants,
        measurements=count,
        square=square,
        p_misfit=float(chi2.sf(square, count)) if count else 1.0,
        of_its_length=max(1, whole // max(1, rows.instants)),
        effects=(),
    )
    if nothing.too_short:
        return nothing
    present = {effect.name for effect in base.model.effects}
    untested = [_untested(base, effect) for effect in effects.values() if effect.name not in present]
    tried = [one.effect for one in untested if not (one.missing or one.measured_by)]
    trials = [EffectTrial(effect, steps) for effect in tried for steps in _grid(effect)]
    moved: dict[str, list[tuple[EffectTrial, Float]]] = {}
    for trial, columns in zip(trials, responses(base, trials, workers), strict=True):
        if columns is not None:
            moved.setdefault(trial.effect.name, []).append((trial, columns))
    u = rows.all_rows(base)
    found = list(workers.map(lambda one: _best(rows, u, one, moved.get(one.effect.name, [])), untested))
    return replace(nothing, effects=_ranked(found))


def _untested(base: PooledFit, effect: Effect) -> StretchEffect:
    have = [filtered.run.channels for filtered in base.runs]
    unknown = np.full(len(effect.parameters), np.nan)
    none = Sized(np.nan, unknown, unknown)
    missing = tuple(c for c in effect.needs if any(c not in channels for channels in have))
    shown = tuple(c for c in effect.measured_by if all(c in channels for channels in have))
    return StretchEffect(effect, none, none, 1.0, 1.0, 0.0, np.nan, missing, shown)


def _grid(effect: Effect) -> list[tuple[float, ...]]:
    """Return the points at which an effect is tried, as the screen of a diagnosis does."""
    choices = [p.steps if k == 0 or p.shapes else p.steps[:1] for k, p in enumerate(effect.parameters)]
    return list(product(*choices))


def _best(rows: Rows, u: Float, nothing: StretchEffect, moved: Sequence[tuple[EffectTrial, Float]]) -> StretchEffect:
    """Return an effect at the point of its grid where it explains most of the stretch."""
    tested = [_tested(rows, u, trial, columns) for trial, columns in moved]
    if not tested:
        return nothing
    best = min(tested, key=lambda one: (one.p_value, -np.nan_to_num(one.here.score, nan=-1.0)))
    # the largest of several tries is larger than any one of them: Bonferroni
    return replace(best, p_value=min(1.0, len(tested) * best.p_value))


def _tested(rows: Rows, u: Float, trial: EffectTrial, columns: Float) -> StretchEffect:
    effect, steps = trial.effect, trial.steps
    left, errors = rows.left(columns), rows.left(u)
    own, free = rows.of_stretch(columns), rows.whitened(left)
    before, after = float(np.sum(own**2)), float(np.sum(free**2))
    absorption = 1.0 - min(1.0, after / before) if before > 0.0 else 1.0
    everywhere, _ = _sized(rows.known.clean(columns[: rows.known.u.size]), rows.known.u, effect, steps)
    if absorption > NOT_TESTABLE or np.any(np.sum(free**2, axis=0) == 0.0):
        unknown = np.full(len(effect.parameters), np.nan)
        return StretchEffect(effect, Sized(np.nan, unknown, unknown), everywhere, 1.0, 1.0, 0.0, absorption)
    here, estimate = _sized(free, rows.whitened(errors), effect, steps)
    half = errors.size // 2
    rest = errors[:half] - (left @ estimate)[:half]
    square = float(errors[:half] @ errors[:half])
    return StretchEffect(
        effect=effect,
        here=here,
        everywhere=everywhere,
        p_value=float(chi2.sf(here.score, estimate.size)) if _plausible(effect, here.change) else 1.0,
        p_adjusted=1.0,
        explained=1.0 - float(rest @ rest) / square if square > 0.0 else 0.0,
        absorption=absorption,
        direction=free @ estimate,
    )


def _sized(columns: Float, errors: Float, effect: Effect, steps: tuple[float, ...]) -> tuple[Sized, Float]:
    """Return score and size by least squares, and the estimate of what makes the effect."""
    change, std = np.array(steps, dtype=np.float64), np.full(len(steps), np.nan)
    information = columns.T @ columns
    scale = np.sqrt(np.diag(information))
    if np.any(scale == 0.0):
        return Sized(np.nan, np.full(len(steps), np.nan), std), np.zeros(columns.shape[1])
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-9, hermitian=True) / np.outer(scale, scale)
    gradient = columns.T @ errors
    estimate: Float = inverse @ gradient
    made = np.array([not p.shapes for p in effect.parameters])
    change[made], std[made] = estimate, np.sqrt(np.diag(inverse))
    return Sized(float(gradient @ estimate), change, std), estimate


def _plausible(effect: Effect, change: Float) -> bool:
    """Tell whether the change goes where the effect can be at all: a rudder cannot answer before it moves."""
    inside = [np.clip(x, p.low, p.high) for x, p in zip(change, effect.parameters, strict=True)]
    return any(x != 0.0 for x, p in zip(inside, effect.parameters, strict=True) if not p.shapes)


def _ranked(found: Sequence[StretchEffect]) -> tuple[StretchEffect, ...]:
    """Return effects with their p-values adjusted for their number, the least likely to be nothing first."""
    tested = [one for one in found if np.isfinite(one.here.score)]
    adjusted = false_discovery_control([one.p_value for one in tested], method="by") if tested else []
    tested = [replace(one, p_adjusted=float(p)) for one, p in zip(tested, adjusted, strict=True)]
    tested.sort(key=lambda one: (one.p_value == 1.0, -one.here.score, one.effect.name))
    rest = sorted((one for one in found if not np.isfinite(one.here.score)), key=lambda one: one.effect.name)
    return (*(replace(one, alike=_alike(one, tested)) for one in tested), *rest)


def _alike(one: StretchEffect, others: Sequence[StretchEffect]) -> tuple[str, ...]:
    return tuple(o.effect.name for o in others if o is not one and _cosine_squared(one, o) > ALIKE)


def _cosine_squared(one: StretchEffect, other: StretchEffect) -> float:
    a, b = one.direction, other.direction
    if a is None or b is None:
        return 0.0
    both = float(a @ a) * float(b @ b)
    return float(a @ b) ** 2 / both if both > 0.0 else 0.0
