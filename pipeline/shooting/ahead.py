"""Models of a vessel judged one leg ahead: fitted by shooting, each manoeuvre predicted by what the others say."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun, spread
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.terms.ordinary import driven_by_noise
from kempf.pipeline.shooting import shooting_fit
from kempf.pipeline.shooting.inflation import inflation
from kempf.pipeline.shooting.left_out import LeftOut, left_out
from kempf.pipeline.shooting.normal_equations import NormalEquations
from kempf.pipeline.shooting.paired import Paired, paired
from kempf.pipeline.shooting.reduced import Scales
from kempf.pipeline.shooting.scales import scaled
from kempf.pipeline.shooting.shooting_fit import ShootingFit, alone
from kempf.pipeline.shooting.shot_run import Moved, ShotRun
from kempf.pipeline.shooting.windows import Windows, leg_s, windows_of
from kempf.schemas.effect import Effect
from kempf.schemas.model_spec import N_HULL, ModelSpec

#: standard errors, and least part of the misfit, by which fits one step and one leg ahead disagree
_DISAGREE, _LEAST = 3.0, 0.1


@dataclass(frozen=True, eq=False)
class Ahead:
    """One model, and how it predicts one leg ahead."""

    fit: ShootingFit
    #: Of the fitted manoeuvres, each by the parameters of the others.
    left_out: LeftOut
    #: held, held_windows: Of the held-out manoeuvres.
    held: LeftOut
    held_windows: tuple[Windows, ...]
    #: Shape (3,). Spread of v, r and psi as measured; NaN where not measured.
    motion: Float
    #: How far ahead, s.
    horizon_s: float
    #: Of the fitted manoeuvres by the parameters that the likelihood gives one step ahead; None where not known.
    one_step: LeftOut | None = None

    @property
    def disagrees(self) -> Paired | None:
        """How much better legs are predicted by the parameters fitted to them than by the likelihood's, one step ahead.

        None where they predict alike: then the likelihood's, which uses all that the readings say, are the better ones.
        """
        if self.one_step is None:
            return None
        comparison = paired(self.one_step, self.own)
        return comparison if comparison.in_std > _DISAGREE and comparison.falls_by > _LEAST else None

    @property
    def std(self) -> Float:
        """Standard errors of hull and effects, shape (6 + p,), with the factor of `inflation`."""
        own: Float = np.sqrt(np.maximum(np.diag(self.fit.covariance), 0.0))
        return inflation(self.own.mean, self.left_out.mean) * own

    @property
    def model(self) -> EffectModel:
        """The model."""
        return self.fit.shots[0].model

    @property
    def names(self) -> frozenset[str]:
        """Names of its effects."""
        return frozenset(effect.name for effect in self.model.effects)

    @property
    def own(self) -> LeftOut:
        """Of the fitted manoeuvres by the parameters fitted to them."""
        return LeftOut(self.fit.errors, tuple(part.errors for part in self.fit.parts))

    def percent(self, errors: LeftOut) -> Float:
        """Return the error of every manoeuvre, mean over channels, per cent of the motion; infinite where it diverges.

        Parameters
        ----------
        errors : LeftOut
            One of those of this model.
        """
        percents = []
        for error in errors.errors:
            known = np.flatnonzero(~np.isnan(error).all(axis=0))
            mean = np.sqrt(np.nanmean(error[:, known], axis=0))
            percents.append(100.0 * float(np.mean(mean * self.fit.scales.error[known] / self.motion[known])))
        return np.array(percents)


@dataclass(frozen=True, eq=False)
class ShootingRange:
    """The manoeuvres of a vessel in windows, with the units that errors are measured in."""

    spec: ModelSpec
    #: Length of a window.
    horizon_s: float
    fitted: tuple[Windows, ...]
    held: tuple[Windows, ...]
    scales: Scales
    motion: Float
    #: Without effects.
    plain: Ahead
    workers: Executor

    def refitted(self, model: EffectModel, shared: Float, near: Ahead) -> Ahead:
        """Fit a model from somewhere, the states of a model near it."""
        shots = [ShotRun(windows, model, self.spec) for windows in self.fitted]
        begin = [part.at for part in near.fit.parts]
        return self.judged(shooting_fit.fit(shots, shared, self.scales, self.workers, begin))

    def judged(self, fit: ShootingFit) -> Ahead:
        """Let a fitted model predict what it has not seen."""
        model = fit.shots[0].model
        shots = [ShotRun(windows, model, self.spec) for windows in self.held]
        predictions = list(self.workers.map(lambda shot: alone(shot, fit.shared, self.scales), shots))
        held = LeftOut(np.array([m for m, _, _ in predictions]), tuple(e for _, _, e in predictions))
        return Ahead(fit, left_out(fit, self.workers), held, self.held, self.motion, self.horizon_s)

    def beside(self, ahead: Ahead, fit: PooledFit) -> Ahead:
        """Return a model with how the likelihood's parameters of it predict legs, nothing shared being fitted."""
        shared = fit.ship.parameters
        pairs = [(shot, part.at) for shot, part in zip(ahead.fit.shots, ahead.fit.parts, strict=True)]
        predictions = list(self.workers.map(lambda pair: alone(pair[0], shared, self.scales, pair[1]), pairs))
        return replace(
            ahead, one_step=LeftOut(np.array([m for m, _, _ in predictions]), tuple(e for _, _, e in predictions))
        )

    def with_effect(self, base: Ahead, effect: Effect) -> Ahead | None:
        """Fit a model with one effect more; None where it runs away at every size that is tried."""
        model = base.model.with_effect(effect)
        tried = []
        for size in _sizes(effect):
            start = self._begun(model, base, size)
            if start is not None:
                tried.append((start[0], start[1]))
        if not tried:
            return None
        _, shared = min(tried, key=lambda pair: pair[0])
        return self.refitted(model, shared, base)

    def way(self, fits: Sequence[PooledFit]) -> tuple[Ahead, ...]:
        """Return the models of fits by likelihood one leg ahead.

        Each is begun from the sizes that the likelihood gives its effects and, as in a diagnosis, from the model before
        it: where something is lacking, the former may lie beyond a hill.

        Parameters
        ----------
        fits : sequence of PooledFit
            Of the fitted manoeuvres, each with one effect more than the one before.
        """
        models: list[Ahead] = []
        for fit in fits:
            near = models[-1] if models else self.plain
            ship = fit.ship
            if ship.model.effects:
                begun = [self.refitted(ship.model, np.concatenate([near.fit.hull, ship.values]), near)]
                if len(ship.model.effects) == len(near.model.effects) + 1:
                    begun += [model for model in [self.with_effect(near, ship.model.effects[-1])] if model is not None]
                near = min(begun, key=lambda model: model.fit.cost)
            models.append(self.beside(near, fit))
        return tuple(models)

    def with_effects(self, base: Ahead, effects: Sequence[Effect], shared: Float) -> Ahead:
        """Fit a model with several effects more.

        Parameters
        ----------
        shared : ndarray, shape (6 + p,)
            Hull and effects to start from.
        """
        return self.refitted(EffectModel((*base.model.effects, *effects)), shared, base)

    def linearised(self, base: Ahead, effects: Sequence[Effect]) -> NormalEquations | None:
        """Return the normal equations of a model with several effects more, none of them there yet."""
        model = EffectModel((*base.model.effects, *effects))
        absent = [p.absent for effect in effects for p in effect.parameters]
        shared = np.concatenate([base.fit.shared, absent])
        shots = [ShotRun(windows, model, self.spec) for windows in self.fitted]
        at = [replace(part.at, shared=shared) for part in base.fit.parts]
        return shooting_fit.linearised(shots, at, self.scales, self.workers, self._moved(base))

    def without(self, base: Ahead, effect: Effect) -> Ahead:
        """Fit a model with one effect less."""
        at = dict(zip(base.model.names, base.fit.values, strict=True))
        model = EffectModel(tuple(e for e in base.model.effects if e.name != effect.name))
        shared = np.concatenate([base.fit.hull, [at[name] for name in model.names]])
        return self.refitted(model, shared, base)

    def screened(self, base: Ahead, effects: Iterable[Effect]) -> list[tuple[float, Effect]]:
        """Return what the sum of squares would fall to with each effect, by linearisation, the smallest first.

        What only noise drives, as waves, moves no window, and is left out.
        """
        ranking, without = [], self._moved(base)
        for effect in effects:
            if driven_by_noise(effect):
                continue
            model = base.model.with_effect(effect)
            begun = (self._begun(model, base, size, without) for size in _sizes(effect))
            starts = [start for start in begun if start is not None]
            if starts:
                ranking.append((min(cost for cost, _ in starts), effect))
        return sorted(ranking, key=lambda pair: (pair[0], pair[1].name))

    def _begun(
        self, model: EffectModel, base: Ahead, size: Float, without: Sequence[Moved] | None = None
    ) -> tuple[float, Float] | None:
        """Return what the sum of squares should fall to from a size of the last effect, and where to begin.

        ``without`` is what the model predicts without that effect; it serves where there is nothing of it.
        """
        shared = np.concatenate([base.fit.shared, size])
        shots = [ShotRun(windows, model, self.spec) for windows in self.fitted]
        at = [replace(part.at, shared=shared) for part in base.fit.parts]
        pairs = zip(size, model.effects[-1].parameters, strict=True)
        absent = all(value == p.absent for value, p in pairs if not p.shapes)
        here = shooting_fit.linearised(shots, at, self.scales, self.workers, without if absent else None)
        return None if here is None else (shooting_fit.foreseen(here), shared)

    def _moved(self, base: Ahead) -> list[Moved]:
        """Return what a model predicts where it was fitted, with the derivatives."""
        return shooting_fit.moved(base.fit.shots, [part.at for part in base.fit.parts], self.scales, self.workers)


def shooting_range(
    runs: Sequence[GridRun], held: Sequence[GridRun], spec: ModelSpec, workers: Executor
) -> ShootingRange:
    """Cut the manoeuvres of a vessel into windows of one leg and fit the plain model to them.

    Parameters
    ----------
    runs, held : sequence of GridRun
        To fit, and not to.
    """
    horizon = leg_s([*runs, *held])
    fitted, unseen = (tuple(windows_of(run, horizon) for run in part) for part in (runs, held))
    motion = np.mean([spread(run.measured) for run in runs], axis=0)
    measured = np.isfinite(np.concatenate([run.measured for run in runs])).any(axis=0)
    motion = np.where(measured, motion, np.nan)
    plain = scaled([ShotRun(windows, EffectModel(), spec) for windows in fitted], workers)
    shooting = ShootingRange(spec, horizon, fitted, unseen, plain.scales, motion, None, workers)  # type: ignore[arg-type]
    return replace(shooting, plain=shooting.judged(plain))


def ahead_of(fits: Sequence[PooledFit], held: Sequence[GridRun], workers: Executor) -> tuple[Ahead | None, ...]:
    """Return models one leg ahead, see `ShootingRange.way`; None where a single manoeuvre is fitted.

    Parameters
    ----------
    fits : sequence of PooledFit
        Of the same manoeuvres, each with one effect more than the one before.
    held : sequence of GridRun
        Held out.
    """
    first = fits[0]
    if len(first.runs) < 2:
        return (None,) * len(fits)
    return shooting_range([filtered.run for filtered in first.runs], held, first.runs[0].spec, workers).way(fits)


def _sizes(effect: Effect) -> list[Float]:
    """Return sizes of an effect to begin with: none of it, where its slope shows there, else over its steps."""
    choices = [
        p.steps if (k == 0 and len(p.steps) > 1) or p.shapes else (p.absent,) for k, p in enumerate(effect.parameters)
    ]
    return [np.array(size, dtype=np.float64) for size in product(*choices)]


def at_bounds(ahead: Ahead, last: int = 1) -> bool:
    """Return whether a parameter of the last effects, of one by default, ended at a bound."""
    own = sum(len(effect.parameters) for effect in ahead.model.effects[-last:])
    low, high = ahead.model.at_bounds(ahead.fit.shared[N_HULL:])
    return bool(np.any((low | high)[-own:]))
