"""Maximum likelihood of a model with effects over several runs: hull and effects shared, noise levels each run's own."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from pipeline.diagnose import sensitivity
from pipeline.diagnose.filtered import Filtered, Passed
from pipeline.diagnose.run import Run
from pipeline.diagnose.sensitivity import N_HULL, N_LEVELS, Point
from pipeline.identify.scoring import damped_step
from pipeline.model.augmented import Augmented
from pipeline.model.ship import mariner_like
from pipeline.normalise.series import Float
from schemas.model_spec import ModelSpec

#: converged when the log-likelihood still to be gained falls below this
_DECREMENT = 1e-2
_MAX_ITERATIONS = 40
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
class Fit:
    """A model fitted to several runs.

    Attributes
    ----------
    model : Augmented
    runs : tuple of Filtered
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
    iterations : int
    """

    model: Augmented
    runs: tuple[Filtered, ...]
    hull: Float
    values: Float
    levels: Float
    log_likelihood: float
    covariance: Float
    linearised: tuple[Linearised, ...]
    converged: bool
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
    model: Augmented,
    runs: Sequence[Run],
    spec: ModelSpec,
    hull: Float,
    levels: Float,
    values: Float,
    workers: Executor,
    *,
    max_iterations: int = _MAX_ITERATIONS,
) -> Fit:
    """Fit a model to several runs from a start.

    Parameters
    ----------
    model : Augmented
    runs : sequence of Run
    spec : ModelSpec
        Disturbances.
    hull, levels, values : ndarray
        To start from, shapes (6,), (runs, 6) and (p,).
    workers : Executor
        Runs share it; sums are in the order of the runs.
    max_iterations : int, optional
    """
    filtered = tuple(Filtered(run, model, spec) for run in runs)
    return climb(filtered, hull, np.clip(levels, LOWEST, HIGHEST), values, workers, max_iterations)


def climb(
    filtered: tuple[Filtered, ...], hull: Float, levels: Float, values: Float, workers: Executor, max_iterations: int
) -> Fit:
    """Climb to the maximum by damped Fisher scoring."""
    model = filtered[0].model
    layout = _Layout(filtered)
    theta = np.concatenate([hull, np.clip(values, model.low, model.high), levels.ravel()])
    damping, converged, count = 1e-4, False, 0
    lines = _linearise(filtered, layout, theta, workers)
    value, score, information = layout.gather(lines)
    for count in range(1, max_iterations + 1):  # noqa: B007 - told at the end
        free = layout.free(theta, score)
        step = damped_step(score, information, free, 0.0)
        if 0.5 * float(score @ step) < _DECREMENT:
            converged = True
            break
        rose = False
        while damping < 1e8 and not rose:
            step = damped_step(score, information, free, damping)
            candidate = layout.clipped(theta + layout.bounded(step, theta))
            found = _linearise(filtered, layout, candidate, workers)
            there = layout.gather(found)
            rose = there[0] > value
            damping = damping / 10.0 if rose else max(damping * 10.0, 1e-3)
        if not rose:
            break
        theta, lines, (value, score, information) = candidate, found, there
    shared = layout.shared
    free = layout.free(theta, score)
    covariance = np.full((shared, shared), np.nan)
    index = np.flatnonzero(free)
    block = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    inverse = np.linalg.pinv(block / np.outer(scale, scale), rcond=1e-12, hermitian=True) / np.outer(scale, scale)
    first = np.flatnonzero(index < shared)
    covariance[np.ix_(index[first], index[first])] = inverse[np.ix_(first, first)]
    return Fit(
        model=model,
        runs=filtered,
        hull=theta[:N_HULL],
        values=theta[N_HULL:shared],
        levels=theta[shared:].reshape(-1, N_LEVELS),
        log_likelihood=value,
        covariance=covariance,
        linearised=lines,
        converged=converged,
        iterations=count,
    )


class _Layout:
    """Where everything stands in the common vector: hull, effects, then six levels a run."""

    def __init__(self, filtered: Sequence[Filtered]) -> None:
        self.model = filtered[0].model
        self.shared = N_HULL + len(self.model.names)
        runs = len(filtered)
        # a number that happens to lie near 0 may grow to the size that it has in other ships
        self.typical = 0.5 * np.abs(mariner_like(filtered[0].run.ship.length_m).array())
        self.low = np.concatenate([np.full(N_HULL, -np.inf), self.model.low, np.tile(LOWEST, runs)])
        self.high = np.concatenate([np.full(N_HULL, np.inf), self.model.high, np.tile(HIGHEST, runs)])
        self.used = np.concatenate([np.ones(self.shared, dtype=bool), *(f.levels_used() for f in filtered)])

    def point(self, theta: Float, run: int) -> Point:
        first = self.shared + N_LEVELS * run
        return Point(theta[:N_HULL], theta[N_HULL : self.shared], theta[first : first + N_LEVELS])

    def places(self, index: list[int], run: int) -> list[int]:
        return [i if i < self.shared else i + N_LEVELS * run for i in index]

    def gather(self, lines: Sequence[Linearised]) -> tuple[float, Float, Float]:
        n = self.used.size
        value, score, information = 0.0, np.zeros(n), np.zeros((n, n))
        for run, line in enumerate(lines):
            value += line.passed.log_likelihood
            if not np.isfinite(value):
                return -np.inf, score, information
            at = self.places(line.index, run)
            score[at] += line.J.T @ line.u
            information[np.ix_(at, at)] += line.J.T @ line.J
        return value, score, information

    def free(self, theta: Float, score: Float) -> np.ndarray:
        held = ((theta <= self.low) & (score < 0.0)) | ((theta >= self.high) & (score > 0.0))
        return self.used & ~held

    def clipped(self, theta: Float) -> Float:
        return np.clip(theta, self.low, self.high)

    def bounded(self, step: Float, theta: Float) -> Float:
        """Shorten a step that would double the hull, or move a level by more than e."""
        reach = np.maximum(np.abs(theta[:N_HULL]), self.typical)
        result = step * min(1.0, 1.0 / max(float(np.max(np.abs(step[:N_HULL]) / reach)), 1e-300))
        result[self.shared :] = np.clip(step[self.shared :], -1.0, 1.0)
        return result


def _linearise(
    filtered: Sequence[Filtered], layout: _Layout, theta: Float, workers: Executor
) -> tuple[Linearised, ...]:
    def one(run: int) -> Linearised:
        return linearise(filtered[run], layout.point(theta, run))

    return tuple(workers.map(one, range(len(filtered))))


def linearise(filtered: Filtered, point: Point) -> Linearised:
    """Return u and J of one run at a point."""
    base = sensitivity.passed(filtered, point)
    if not np.isfinite(base.log_likelihood):
        return Linearised(base, np.zeros(0), np.zeros((0, 0)), [])
    found = list(sensitivity.columns(filtered, point, base))
    J = np.column_stack([column for _, column in found])
    return Linearised(base, sensitivity.whitened(base), np.nan_to_num(J), [index for index, _ in found])


def with_model(base: Fit, model: Augmented, values: Float, workers: Executor, *, max_iterations: int = 25) -> Fit:
    """Fit another model to the same runs, starting where one stands.

    Parameters
    ----------
    base : Fit
    model : Augmented
    values : ndarray, shape (p,)
        Start of the effects.
    """
    filtered = tuple(replace(one, model=model) for one in base.runs)
    return climb(filtered, base.hull, base.levels, values, workers, max_iterations)
