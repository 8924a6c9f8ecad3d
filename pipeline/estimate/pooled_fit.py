"""Maximum likelihood of a model with effects over several runs: hull and effects shared, noise levels by run."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.search import climb as search
from kempf.pipeline.estimate.search.scoring import Mask
from kempf.pipeline.estimate.sensitivity import N_HULL, N_LEVELS, Point
from kempf.pipeline.model.batch import MOST
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.model_spec import ModelSpec

#: converged when the log-likelihood still to be gained falls below this
_DECREMENT = 1e-2
_MAX_ITERATIONS = 40
#: largest change of an effect in one step of the search, in its own steps
_REACH = 5.0
#: bounds of the noise levels, SI: three intensities per root second and three standard deviations
LOWEST = np.log(np.array([1e-7, 1e-9, 1e-5, 1e-5, 1e-7, 1e-6]))
HIGHEST = np.log(np.array([0.3, 0.03, 1.0, 10.0, 0.5, 1.0]))


@dataclass(frozen=True, eq=False)
class Linearised:
    """One run at a point: u, J and where its columns belong.

    Attributes
    ----------
    passed : Passed
    u : ndarray, shape (2 m,)
    J : ndarray, shape (2 m, c)
    index : ndarray, shape (c,)
        Places of the columns in `Point.vector`.
    """

    passed: Passed
    u: Float
    J: Float
    index: list[int]


@dataclass(frozen=True, eq=False)
class PooledFit:
    """A model fitted to several runs.

    Attributes
    ----------
    model : EffectModel
    runs : tuple of RunFilter
    hull, values : ndarray
        Shared parameters.
    levels : ndarray, shape (runs, 6)
        Logarithms of the noise levels.
    log_likelihood : float
    covariance : ndarray, shape (6 + p, 6 + p)
        Of hull and effects, from the expected information with the levels unknown; NaN where a bound is active.
    linearised : tuple of Linearised
        At the end.
    converged : bool
    reason : str
        Why the search ended.
    iterations : int
    """

    model: EffectModel
    runs: tuple[RunFilter, ...]
    hull: Float
    values: Float
    levels: Float
    log_likelihood: float
    covariance: Float
    linearised: tuple[Linearised, ...]
    converged: bool
    reason: str
    iterations: int

    @property
    def std(self) -> Float:
        """Standard errors of hull and effects, shape (6 + p,)."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(np.diag(self.covariance))

    @property
    def count(self) -> int:
        """Measurements."""
        return sum(one.u.size // 2 for one in self.linearised)

    def point(self, number: int) -> Point:
        """Where one run stands."""
        return Point(self.hull, self.values, self.levels[number])


def fit(
    model: EffectModel,
    runs: Sequence[GridRun],
    spec: ModelSpec,
    hull: Float,
    levels: Float,
    values: Float,
    workers: Executor,
    *,
    max_iterations: int = _MAX_ITERATIONS,
) -> PooledFit:
    """Fit a model to several runs from a start.

    Parameters
    ----------
    model : EffectModel
    runs : sequence of GridRun
    spec : ModelSpec
        Disturbances.
    hull, levels, values : ndarray
        To start from, shapes (6,), (runs, 6) and (p,).
    workers : Executor
        Runs share it; sums are in the order of the runs.
    max_iterations : int, optional
    """
    filtered = tuple(RunFilter(run, model, spec) for run in runs)
    return climb(filtered, hull, np.clip(levels, LOWEST, HIGHEST), values, workers, max_iterations)


def climb(
    filtered: tuple[RunFilter, ...],
    hull: Float,
    levels: Float,
    values: Float,
    workers: Executor,
    max_iterations: int,
    wanted: float = -np.inf,
) -> PooledFit:
    """Climb to the maximum by damped Fisher scoring; given up where the log-likelihood ``wanted`` is out of reach."""
    model = filtered[0].model
    layout = CommonLikelihood(filtered, workers)
    # a number that happens to lie near 0 may grow to the size that it has in other ships
    least = 0.05 * np.abs(mariner_like(filtered[0].run.ship.length_m).array())
    begin = np.where(np.abs(hull) < least, np.copysign(least, hull), hull)
    theta = np.concatenate([begin, np.clip(values, model.low, model.high) / layout.unit, levels.ravel()])
    found = search.climb(layout, theta, max_iterations, _DECREMENT, wanted)
    theta, score, information = found.theta, found.score, found.information
    lines = layout.linearised_at(theta)
    shared = layout.shared
    free = search.free(layout, theta, score)
    covariance = np.full((shared, shared), np.nan)
    index = np.flatnonzero(free)
    block = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    inverse = np.linalg.pinv(block / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)
    first = np.flatnonzero(index < shared)
    back = layout.scale[index[first]]
    covariance[np.ix_(index[first], index[first])] = inverse[np.ix_(first, first)] * np.outer(back, back)
    return PooledFit(
        model=model,
        runs=filtered,
        hull=theta[:N_HULL],
        values=theta[N_HULL:shared] * layout.unit,
        levels=theta[shared:].reshape(-1, N_LEVELS),
        log_likelihood=found.log_likelihood,
        covariance=covariance,
        linearised=lines,
        converged=found.converged,
        reason=found.reason,
        iterations=len(found.passes) - 1,
    )


class CommonLikelihood:
    """The log-likelihood of several runs over one vector: hull, effects in units of their steps, six levels a run."""

    def __init__(self, filtered: Sequence[RunFilter], workers: Executor) -> None:
        self.filtered, self.workers, self.model = filtered, workers, filtered[0].model
        self.shared = N_HULL + len(self.model.names)
        runs = len(filtered)
        # effects are counted in steps of a size that the search may take at once
        self.unit = np.array([_REACH * abs(p.steps[0]) for _, p in self.model.parameters])
        self.low = np.concatenate([np.full(N_HULL, -np.inf), self.model.low / self.unit, np.tile(LOWEST, runs)])
        self.high = np.concatenate([np.full(N_HULL, np.inf), self.model.high / self.unit, np.tile(HIGHEST, runs)])
        self.scale = np.concatenate([np.ones(N_HULL), self.unit, [1.0]])
        used: Mask = np.concatenate([np.ones(self.shared, dtype=np.bool_), *(f.levels_used() for f in filtered)])
        self.active = used.astype(np.bool_)
        self.highest, self.top = -np.inf, np.zeros(0)
        self.lines: tuple[Linearised, ...] = ()

    def point(self, theta: Float, run: int) -> Point:
        """Return what of the vector one run has."""
        first = self.shared + N_LEVELS * run
        values = theta[N_HULL : self.shared] * self.unit
        return Point(theta[:N_HULL], values, theta[first : first + N_LEVELS])

    def linearised_at(self, theta: Float) -> tuple[Linearised, ...]:
        """Return u and J of every run, those of the highest point so far without computing them anew."""
        if np.array_equal(theta, self.top):
            return self.lines
        return self._linearised(theta, self._passed(theta))

    def _passed(self, theta: Float) -> list[Passed]:
        numbers = range(len(self.filtered))
        return list(self.workers.map(lambda i: sensitivity.passed(self.filtered[i], self.point(theta, i)), numbers))

    def _linearised(self, theta: Float, bases: Sequence[Passed]) -> tuple[Linearised, ...]:
        return linearise(self.filtered, [self.point(theta, i) for i in range(len(bases))], bases, self.workers)

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        """Log-likelihood, score and expected information, summed in the order of the runs.

        A search takes no step that does not rise above all before, so that nobody asks for the derivatives of a point
        no higher than the highest: they are left at 0, a dozen passes each spared.
        """
        n = theta.size
        score, information = np.zeros(n), np.zeros((n, n))
        bases = self._passed(theta)
        value = sum(base.log_likelihood for base in bases)
        if not np.isfinite(value):
            return -np.inf, score, information
        if value <= self.highest:
            return value, score, information
        lines = self._linearised(theta, bases)
        for run, line in enumerate(lines):
            at = [i if i < self.shared else i + N_LEVELS * run for i in line.index]
            J = line.J * self.scale[[min(i, self.shared) for i in line.index]]
            with np.errstate(over="ignore", invalid="ignore"):
                score[at] += J.T @ line.u
                information[np.ix_(at, at)] += J.T @ J
        if not (np.all(np.isfinite(score)) and np.all(np.isfinite(information))):
            # a step beside it the filter runs away: from there no way leads on
            return -np.inf, np.zeros(n), np.zeros((n, n))
        self.highest, self.top, self.lines = value, theta.copy(), lines
        return value, score, information


def linearise(
    filtered: Sequence[RunFilter], points: Sequence[Point], bases: Sequence[Passed], workers: Executor
) -> tuple[Linearised, ...]:
    """Return u and J of every run at its point, ``bases`` being the passes there."""
    # a group of lanes of one run is the smallest piece of work: so three runs keep two cores busy
    jobs: list[tuple[int, list[int]]] = []
    for i, (one, base) in enumerate(zip(filtered, bases, strict=True)):
        if np.isfinite(base.log_likelihood):
            wanted = sensitivity.active(one)
            jobs += [(i, wanted[k : k + MOST]) for k in range(0, len(wanted), MOST)]
    made = workers.map(lambda job: sensitivity.columns(filtered[job[0]], points[job[0]], bases[job[0]], job[1]), jobs)
    found: list[list[tuple[int, Float]]] = [[] for _ in bases]
    for (i, wanted), columns in zip(jobs, made, strict=True):
        found[i] += zip(wanted, columns, strict=True)
    return tuple(_line(base, own) for base, own in zip(bases, found, strict=True))


def _line(base: Passed, columns: Sequence[tuple[int, Float]]) -> Linearised:
    if not columns:
        return Linearised(base, np.zeros(0), np.zeros((0, 0)), [])
    J = np.column_stack([column for _, column in columns])
    return Linearised(base, sensitivity.whitened(base), np.nan_to_num(J), [index for index, _ in columns])
