"""Maximum likelihood of a model over one run or several: hull and effects shared, noise levels each run's own."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.iteration import SILENT, Iteration, Listener
from kempf.pipeline.estimate.level_bounds import level_bounds, to_intensities
from kempf.pipeline.estimate.record.grid_run import GridRun, spread
from kempf.pipeline.estimate.search.block_arrow import Arrow, inverse
from kempf.pipeline.estimate.search.climb import Pass, Search, free, nobody
from kempf.pipeline.estimate.search.variances import climb_in_variances
from kempf.pipeline.estimate.sensitivity import N_LEVELS, Point
from kempf.pipeline.model.batch import MOST
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.model_spec import N_HULL, NOISE_PARAMETERS

#: converged when the log-likelihood that the shared parameters have still to gain falls below this: they lie within
#: 0.05 standard errors of the maximum then
DECREMENT = 1e-3
MAX_ITERATIONS = 60
#: largest change of an effect in one step of the search, in its own steps
_REACH = 5.0
#: no vessel answers faster than this, in her speed by her length: the quickest are at 8. A model that lacks, say, the
#: lag of the rudder would have a hull of any quickness for it, and the climb there has no end
SWIFTEST = 30.0
#: slope beyond which there is none
_STEEPEST = 1e100


@dataclass(frozen=True, eq=False)
class Linearised:
    """One run at a point: u, J and where its columns belong."""

    passed: Passed
    #: Shape (2 m,).
    u: Float
    #: Shape (2 m, c).
    J: Float
    #: Shape (c,). Places of the columns in `Point.vector`.
    index: list[int]


@dataclass(frozen=True, eq=False)
class ShipPart:
    """What a fit says of the ship and her effects, without lasting noise of instruments."""

    model: EffectModel
    #: hull, values: Shapes (6,) and (p,).
    hull: Float
    values: Float
    #: Shape (6 + p, 6 + p). With the noise unknown.
    covariance: Float

    @property
    def parameters(self) -> Float:
        """Hull and effects, shape (6 + p,)."""
        return np.concatenate([self.hull, self.values])

    @property
    def std(self) -> Float:
        """Standard errors, shape (6 + p,)."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, eq=False)
class Parabola:
    """A log-likelihood of what runs share, about its top."""

    #: Shape (6 + p,). Hull and effects where it is highest.
    top: Float
    #: Shape (6 + p, 6 + p).
    information: Float

    def scaled(self, unit: Float) -> Parabola:
        """Return it over parameters that are counted in units, shape (6 + p,)."""
        return Parabola(self.top / unit, self.information * np.outer(unit, unit))

    def loss(self, shared: Float) -> float:
        """Return by how much it is lower than at its top."""
        off = shared - self.top
        return float(0.5 * off @ self.information @ off)

    def score(self, shared: Float) -> Float:
        """Return its slope, shape (6 + p,)."""
        slope: Float = -self.information @ (shared - self.top)
        return slope


@dataclass(frozen=True, eq=False)
class PooledFit:
    """A model fitted to several runs."""

    model: EffectModel
    runs: tuple[RunFilter, ...]
    #: hull, values: Shared parameters.
    hull: Float
    values: Float
    #: Shape (runs, 6). Logarithms of the noise levels.
    levels: Float
    log_likelihood: float
    #: Shape (6 + p, 6 + p). Of hull and effects, from the expected information with the levels unknown but for those
    #: pressed against a bound; NaN where a bound of hull or effects is active.
    covariance: Float
    #: At the end, by the extended filter.
    linearised: tuple[Linearised, ...]
    converged: bool
    #: Why the search ended.
    reason: str
    iterations: int

    @property
    def parameters(self) -> Float:
        """Hull and effects, shape (6 + p,)."""
        return np.concatenate([self.hull, self.values])

    @property
    def std(self) -> Float:
        """Standard errors of hull and effects, shape (6 + p,)."""
        with np.errstate(invalid="ignore"):
            return np.sqrt(np.diag(self.covariance))

    @property
    def ship(self) -> ShipPart:
        """What it says of the ship."""
        return self.ship_part(self.covariance)

    @property
    def noise(self) -> tuple[tuple[str, float, float, str], ...]:
        """Lasting noise of instruments: name, value, standard error and unit of each of its parameters."""
        parameters = zip(self.model.names, self.model.parameters, self.values, self.std[N_HULL:], strict=True)
        every = [(name, float(x), float(std), p.unit) for name, (_, p), x, std in parameters]
        return tuple(row for row, own in zip(every, self.model.of_ship, strict=True) if not own)

    def ship_part(self, covariance: Float) -> ShipPart:
        """Return what it says of the ship, with another covariance of all parameters, shape (6 + p, 6 + p)."""
        own = np.concatenate([np.ones(N_HULL, dtype=np.bool_), self.model.of_ship])
        return ShipPart(self.model.ship, self.hull, self.values[own[N_HULL:]], covariance[np.ix_(own, own)])

    @property
    def count(self) -> int:
        """Measurements."""
        return sum(line.u.size // 2 for line in self.linearised)

    @property
    def last(self) -> Iteration:
        """Where it ended, as a listener hears it."""
        error = one_step_error(
            [filtered.run for filtered in self.runs], [line.passed.innovation for line in self.linearised]
        )
        return Iteration(self.iterations, self.log_likelihood, error, len(self.runs))

    def point(self, number: int) -> Point:
        """Where one run stands."""
        return Point(self.hull, self.values, self.levels[number])

    def sigmas(self, number: int) -> dict[str, float]:
        """Return the noise levels that one run has, those of disturbances in the long run, by name, SI."""
        filtered = self.runs[number]
        levels = np.exp(self.levels[number] - to_intensities(filtered.spec)).tolist()
        return {name: x for name, x, used in zip(NOISE_PARAMETERS, levels, filtered.levels_used(), strict=True) if used}


def fit(
    filtered: Sequence[RunFilter],
    hull: Float,
    levels: Float,
    values: Float,
    workers: Executor,
    max_iterations: int = MAX_ITERATIONS,
    wanted: float = -np.inf,
    listener: Listener = SILENT,
) -> PooledFit:
    """Climb to the maximum of the likelihood of several runs.

    Parameters
    ----------
    filtered : sequence of RunFilter
        Runs, all with one model.
    hull, levels, values : ndarray
        To start from, shapes (6,), (runs, 6) and (p,).
    workers : Executor
        Runs share it; sums are in the order of the runs.
    wanted : float, optional
        Log-likelihood without which the fit is of no use: where it is out of reach the climb is given up.
    listener : Listener, optional
        Notified of every iteration.
    """
    layout = CommonLikelihood(filtered, workers)
    model = layout.model
    # a number that happens to lie near 0 may grow to the size that it has in other ships
    least = 0.05 * np.abs(mariner_like(filtered[0].run.ship.length_m).array())
    begin = np.where(np.abs(hull) < least, np.copysign(least, hull), hull)
    if swiftness(begin, filtered[0].run.ship.length_m) > SWIFTEST:
        begin = hull
    theta = np.concatenate([begin, np.clip(values, model.low, model.high) / layout.unit, levels.ravel()])
    return ended(layout, climbed(layout, theta, max_iterations, wanted, listener))


def climbed(
    layout: CommonLikelihood,
    theta: Float,
    max_iterations: int = MAX_ITERATIONS,
    wanted: float = -np.inf,
    listener: Listener = SILENT,
) -> Search[Arrow]:
    """Climb a common likelihood from one start and tell of every iteration; see `fit`."""
    number = -1

    def report(step: Pass) -> None:
        nonlocal number
        number += 1
        listener.iterated(Iteration(number, step.log_likelihood, layout.error_at(step.theta), len(layout.filtered)))

    return climb_in_variances(
        layout, theta, max_iterations, DECREMENT, wanted, nobody if listener is SILENT else report
    )


def one_step_error(runs: Sequence[GridRun], innovations: Sequence[Float]) -> float:
    """Return the error of predictions one step ahead, as a share of the motion.

    Of each run and measurement the root mean square by the spread of what was measured; their mean.

    Parameters
    ----------
    innovations : sequence of ndarray of shape (n, 3)
        Of each run, NaN where not measured.
    """
    shares = []
    for run, innovation in zip(runs, innovations, strict=True):
        motion = spread(run.measured)
        made = np.isfinite(innovation).any(axis=0) & (motion > 0.0)
        with np.errstate(over="ignore"):  # of a filter that runs away
            shares.append(np.sqrt(np.nanmean(innovation[:, made] ** 2, axis=0)) / motion[made])
    every = np.concatenate(shares)
    return float(np.mean(every)) if every.size else np.nan


def ended(layout: CommonLikelihood, search: Search[Arrow]) -> PooledFit:
    """Return the fit that a search of the likelihood ended at."""
    theta, shared = search.theta, layout.shared
    movable = free(layout, theta, search.score)
    complement, _ = search.information.masked(movable).eliminated()
    index = np.flatnonzero(movable[:shared])
    back = layout.scale[index]
    covariance = np.full((shared, shared), np.nan)
    if np.isfinite(search.log_likelihood):
        covariance[np.ix_(index, index)] = inverse(complement)[np.ix_(index, index)] * np.outer(back, back)
    lines = layout.linearised_at(theta)
    value = sum(line.passed.log_likelihood for line in lines) if np.isfinite(search.log_likelihood) else -np.inf
    return PooledFit(
        model=layout.model,
        runs=tuple(layout.filtered),
        hull=theta[:N_HULL],
        values=theta[N_HULL:shared] * layout.unit,
        levels=theta[shared:].reshape(-1, N_LEVELS),
        log_likelihood=float(value),
        covariance=covariance,
        linearised=lines,
        converged=search.converged,
        reason=search.reason,
        iterations=len(search.passes) - 1,
    )


def swiftness(hull: Float, length_m: float) -> float:
    """Return how fast a hull answers, in speed by length: no less than the larger rate of its two modes.

    Parameters
    ----------
    hull : ndarray, shape (6,)
        Of eq. (16).
    """
    a11, a12, a21, a22 = hull[:4]
    return float((abs(a11) + abs(a22) + np.sqrt(abs(a12 * a21))) * length_m)


class CommonLikelihood:
    """The log-likelihood of several runs over one vector: hull, effects in units of their steps, six levels a run.

    With and without effects by the same filter, so that models can be compared. A climb has one of its own: it leaves
    out the derivatives of points that are no higher than its highest.

    Parameters
    ----------
    filtered : sequence of RunFilter
        Runs, all with one model.
    workers : Executor
        Runs share it; sums are in the order of the runs.
    before : Parabola, optional
        Of the log-likelihood of other runs of the ship, which is added.
    """

    def __init__(self, filtered: Sequence[RunFilter], workers: Executor, before: Parabola | None = None) -> None:
        self.filtered, self.workers, self.model = filtered, workers, filtered[0].model
        self.shared = N_HULL + len(self.model.names)
        runs = len(filtered)
        # effects are counted in steps of a size that the search may take at once
        self.unit = np.array([_REACH * abs(p.steps[0]) for _, p in self.model.parameters])
        least, most = level_bounds(filtered[0].spec)
        low = self.model.low_on(filtered[0].run.step_s) / self.unit
        self.low = np.concatenate([np.full(N_HULL, -np.inf), low, np.tile(least, runs)])
        self.high = np.concatenate([np.full(N_HULL, np.inf), self.model.high / self.unit, np.tile(most, runs)])
        self.scale = np.concatenate([np.ones(N_HULL), self.unit])
        used: Mask = np.concatenate([np.ones(self.shared, dtype=np.bool_), *(f.levels_used() for f in filtered)])
        self.active = used.astype(np.bool_)
        self.logarithms: Mask = np.arange(used.size) >= self.shared
        self.before = None if before is None else before.scaled(self.scale)
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
        return linearise(self.filtered, self._points(theta), self.workers)

    def error_at(self, theta: Float) -> float:
        """Return the error one step ahead, see `one_step_error`.

        At the highest point so far it costs nothing.
        """
        there = np.array_equal(theta, self.top)
        passes = [line.passed for line in self.lines] if there else self._passed(theta)
        return one_step_error([filtered.run for filtered in self.filtered], [passed.innovation for passed in passes])

    def full(self, theta: Float) -> tuple[float, Float, Arrow]:
        """Log-likelihood, score and expected information, summed in the order of the runs.

        A search takes no step that does not rise above all before, so that nobody asks for the derivatives of a point
        no higher than the highest: they are left at 0. None leads to a hull that answers faster than any vessel does:
        there is no likelihood.
        """
        s, runs = self.shared, len(self.filtered)
        length_m = self.filtered[0].run.ship.length_m
        if self.active[:N_HULL].any() and not swiftness(theta[:N_HULL], length_m) <= SWIFTEST:
            return -np.inf, np.zeros(theta.size), _nothing(s, runs)
        value, parts = self._summed(theta)
        scores, information = np.zeros((runs, s + N_LEVELS)), np.zeros((runs, s + N_LEVELS, s + N_LEVELS))
        for run, (own_score, own_information) in enumerate(parts):
            scores[run], information[run] = own_score, own_information
        if self.before is not None and parts:
            # other runs have no levels here: theirs goes with the first of these
            scores[0, :s] += self.before.score(theta[:s])
            information[0, :s, :s] += self.before.information
        score = np.concatenate([np.sum(scores[:, :s], axis=0), scores[:, s:].ravel()])
        arrow = Arrow(information[:, :s, :s], information[:, :s, s:], information[:, s:, s:], scores)
        if not (np.all(np.isfinite(score)) and np.all(np.isfinite(information))):
            # a step beside it the filter runs away: from there no way leads on
            return -np.inf, np.zeros(theta.size), _nothing(s, runs)
        return value, score, arrow

    def _summed(self, theta: Float) -> tuple[float, list[tuple[Float, Float]]]:
        """Return the log-likelihood of all runs, and score and information of each; none where nobody asks for them."""
        points = self._points(theta)
        begun = _begun(self.filtered, points, self.workers)
        value = sum(base.log_likelihood for base, _ in begun) - self._loss(theta)
        if not np.isfinite(value) or value <= self.highest:
            return value if np.isfinite(value) else -np.inf, []
        lines = _finished(self.filtered, points, begun, self.workers)
        parts = []
        for line in lines:
            J = np.zeros((line.u.size, self.shared + N_LEVELS))
            J[:, line.index] = line.J
            with np.errstate(over="ignore", invalid="ignore"):
                J[:, : self.shared] *= self.scale
                parts.append((J.T @ line.u, J.T @ J))
        if all(np.all(np.isfinite(information)) for _, information in parts):
            self.highest, self.top, self.lines = value, theta.copy(), lines
        return value, parts

    def _loss(self, theta: Float) -> float:
        return 0.0 if self.before is None else self.before.loss(theta[: self.shared])

    def _points(self, theta: Float) -> list[Point]:
        return [self.point(theta, i) for i in range(len(self.filtered))]

    def _passed(self, theta: Float) -> list[Passed]:
        return list(self.workers.map(sensitivity.passed, self.filtered, self._points(theta)))


def _nothing(shared: int, runs: int) -> Arrow:
    own = np.zeros((runs, N_LEVELS, N_LEVELS))
    return Arrow(
        np.zeros((runs, shared, shared)), np.zeros((runs, shared, N_LEVELS)), own, np.zeros((runs, shared + N_LEVELS))
    )


def linearise(filtered: Sequence[RunFilter], points: Sequence[Point], workers: Executor) -> tuple[Linearised, ...]:
    """Return u and J of every run at its point."""
    return _finished(filtered, points, _begun(filtered, points, workers), workers)


#: the pass of a run, and those columns of J that one group of lanes gives beside it
_Begun = tuple[Passed, list[Float]]


def _begun(filtered: Sequence[RunFilter], points: Sequence[Point], workers: Executor) -> list[_Begun]:
    def one(run: RunFilter, point: Point) -> _Begun:
        base, columns = sensitivity.with_columns(run, point, sensitivity.active(run)[: MOST - 1])
        return base, columns if np.isfinite(base.log_likelihood) else []

    return list(workers.map(one, filtered, points))


def _finished(
    filtered: Sequence[RunFilter], points: Sequence[Point], begun: Sequence[_Begun], workers: Executor
) -> tuple[Linearised, ...]:
    # a group of lanes of one run is the smallest piece of work: so three runs keep two cores busy
    jobs: list[tuple[int, list[int]]] = []
    for i, (base, columns) in enumerate(begun):
        if np.isfinite(base.log_likelihood):
            rest = sensitivity.active(filtered[i])[len(columns) :]
            jobs += [(i, rest[k : k + MOST]) for k in range(0, len(rest), MOST)]

    def more(job: tuple[int, list[int]]) -> list[Float]:
        i, wanted = job
        return sensitivity.columns(filtered[i], points[i], begun[i][0], wanted)

    jacobians = [list(columns) for _, columns in begun]
    for (i, _), columns in zip(jobs, workers.map(more, jobs), strict=True):
        jacobians[i] += columns
    return tuple(_line(run, base, own) for run, (base, _), own in zip(filtered, begun, jacobians, strict=True))


def _line(run: RunFilter, base: Passed, columns: Sequence[Float]) -> Linearised:
    if not columns:
        return Linearised(base, np.zeros(0), np.zeros((0, 0)), [])
    J = np.column_stack(columns)
    # a filter that runs away beside its point shows no slope there, and its square is no number
    J = np.where(np.abs(J) < _STEEPEST, J, 0.0)
    return Linearised(base, sensitivity.whitened(base), J, sensitivity.active(run))
