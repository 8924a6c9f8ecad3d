"""A fit whose instruments measured at instants that are not quite known: what it would be with them free.

The instants of values in rows that sample their instruments (`kempf.pipeline.channels.instruments`) are known to a part
of a row, those behind stamps that several readings share to a part of the time that the stamp stands for
(`kempf.pipeline.ingest.bursts`): some hundredths of a second, up to half a second. A fit believes them, and its hull is
off by what they are off, in every manoeuvre of the log to one side. Here they are parameters of each log, with what is
known of them as a normal distribution, and are found together with hull and effects by one step of Gauss and Newton:
what that leaves is shown by `benchmarks.identify.unsure_instants`. A diagnosis lays the runs out anew at the instants
that the step finds, and the next one goes on from there (`kempf.pipeline.diagnose.screening.found_instants`).

The lateness of a velocity that may be smoothed (`kempf.pipeline.channels.undelayed_speeds`) is known no better, and is
not found: a hull imitates it nearly to the last, and the rest goes by the shape of the noise. It moves nothing, and
what it may do to the hull counts among the errors (Schmidt 1966, "Application of state-space methods to navigation
problems", Advances in Control Systems 3: parameters that are considered, not estimated).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from math import hypot
from types import MappingProxyType

import numpy as np

from kempf.pipeline.channels.found_instants import FoundInstants
from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.diagnose.screening.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.screening.nuisance import columns_of, orthonormal
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.level_bounds import level_bounds
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.pipeline.estimate.search.climb import pressed
from kempf.pipeline.estimate.sensitivity import difference
from kempf.schemas.effect import Effect
from kempf.schemas.effects import get
from kempf.schemas.model_spec import HULL_PARAMETERS

#: the effect by which the instants of an instrument are late, by field of `InstantErrors`
_LATE: Mapping[str, str] = MappingProxyType(
    {
        "velocity_s": "gnss_latency",
        "heading_s": "heading_latency",
        "yaw_rate_s": "gyro_latency",
        "rudder_s": "dead_time",
    }
)
#: by how much they are tried, s
_STEP_S = 0.05
#: standard deviations of an instant that lies anywhere in a row or a second: to its end, which is the most that it is
#: moved, and over the whole of it, by which two instruments may be apart
_MOST, _APART = 3.0**0.5, 12.0**0.5
#: standard errors from which the size of an effect is seen
_SEEN = 2.0
#: how far beyond the most an instant may be found that lies there: it has an error, too
_BEYOND = 1.25


@dataclass(frozen=True, eq=False)
class WithInstants:
    """What unsure instants do to a fit."""

    #: With hull and effects as they are beside instants that are free; the very same where all are known.
    fit: PooledFit
    #: Shape (6 + p, 6 + p). What is not known of the instants adds to the covariance of the fit.
    covariance: Float
    #: By number of the log, what is found of its instants, together with what was found before.
    found: Mapping[int, FoundInstants] = field(default_factory=dict)
    #: Twice the log-likelihood that it gains.
    gain: float = 0.0
    #: Whether all that is found of them may be in the rows alone; else something is late itself.
    within_rows: bool = True

    def std(self, size: int) -> Float:
        """Return the standard errors of the last parameters, wider by what the runs disagree about, shape (size,)."""
        own = agreement_of(self.fit).widened ** 2 * np.diag(self.fit.covariance) + np.diag(self.covariance)
        with np.errstate(invalid="ignore"):
            std: Float = np.sqrt(own)[-size:]
        return std


def with_instants(fit: PooledFit, workers: Executor, step: Float | float = 0.0) -> WithInstants:
    """Return a fit with the instants of its instruments free, as far as they are not known.

    Parameters
    ----------
    fit : PooledFit
        At its maximum, or a step from it.
    workers : Executor
        Share the passes; nothing depends on it.
    step : ndarray, shape (6 + p,), optional
        To the maximum: with all instants as logged it is 0, beside others whose instants are free it is not.
    """
    covariance, step = np.nan_to_num(fit.covariance), np.zeros(fit.covariance.shape[0]) + step
    rows = _rows(fit, workers)
    late = [*rows, *_smoothed(fit, workers)]
    if not late:
        return WithInstants(_moved(fit, step), np.zeros_like(covariance))
    std_s = np.array([one.std_s[log] for one in rows for log in one.logs])
    foreign = np.array([one.foreign for one in rows for _ in one.logs])
    before_s = np.array([one.found_s[log] for one in rows for log in one.logs])
    places, parts = [], 0
    for one in late:
        places.append({log: parts + k for k, log in enumerate(one.logs)})
        parts += len(one.logs)
    shared, m = covariance.shape[0], std_s.size
    across, own, score = np.zeros((shared, parts)), np.zeros((m, parts)), np.zeros(m)
    first = 0
    for number, (filtered, line) in enumerate(zip(fit.runs, fit.linearised, strict=True)):
        log, part = filtered.run.day, slice(first, first + line.u.size)
        first += line.u.size
        # every log is late by itself: what others are late by is nothing to this run
        at = np.array([place[log] for place in places if log in place], dtype=np.intp)
        if not at.size:
            continue
        column = np.column_stack([one.column[part] for one in late if log in one.std_s])
        common, levels = columns_of(line, shared)
        basis = orthonormal(levels[:, _unbound(fit, number, line.u @ levels)])
        column = column - basis @ (basis.T @ column)
        free = at[at < m]
        across[np.ix_(np.array([i for i in line.index if i < shared], dtype=np.intp), at)] += common.T @ column
        own[np.ix_(free, at)] += column[:, : free.size].T @ column
        score[free] += foreign[free] * (column[:, : free.size].T @ line.u)
    # what every column does beside the hull, and each to the hull
    beside, to_hull = own - across[:, :m].T @ covariance @ across, covariance @ across
    score -= foreign * (across[:, :m].T @ step + before_s * std_s**-2.0)
    late_information = beside[:, :m] + np.diag(std_s**-2.0)
    late_covariance = inverse(late_information)
    total_s, most_s = before_s + late_covariance @ score, _MOST * std_s
    late_s = np.clip(total_s, -most_s, most_s) - before_s
    # at the maximum the scores of what is shared are zero
    moved = _moved(fit, step - to_hull[:, :m] @ late_s)
    # the instants of rows follow a lateness that is only considered
    considered = to_hull[:, m:] - to_hull[:, :m] @ late_covariance @ beside[:, m:]
    added: Float = to_hull[:, :m] @ late_covariance @ to_hull[:, :m].T + considered @ considered.T
    before = {filtered.run.day: filtered.run.instant_errors.found for filtered in fit.runs}
    found = _found(before, rows, before_s + late_s)
    gain = float(late_s @ (2.0 * score - late_information @ late_s))
    return WithInstants(moved, added, found, gain, bool(np.all(np.abs(total_s) <= _BEYOND * most_s)))


def _found(before: Mapping[int, FoundInstants], rows: Sequence[_Late], late_s: Float) -> dict[int, FoundInstants]:
    """Return latenesses, in the order of the instruments and then of their logs, by log."""
    values, found = iter(late_s.tolist()), dict(before)
    for one in rows:
        for log in one.logs:
            found[log] = replace(found[log], **{one.of: next(values)})
    return found


def _moved(fit: PooledFit, step: Float) -> PooledFit:
    """Return a fit a step farther, within the bounds of its effects; the very same without a step."""
    if not np.any(step):
        return fit
    hull, values = np.split(fit.parameters + step, [len(HULL_PARAMETERS)])
    return replace(fit, hull=hull, values=np.clip(values, fit.model.low, fit.model.high))


def _unbound(fit: PooledFit, number: int, score: Float) -> Mask:
    """Return which noise levels of a run are unknown in the covariance of a fit: not those pressed against a bound.

    Parameters
    ----------
    score : ndarray
        Of the levels that the linearised run has, in their order.

    Returns
    -------
    ndarray of bool
        In the same order.
    """
    shared = fit.covariance.shape[0]
    own = [i - shared for i in fit.linearised[number].index if i >= shared]
    at, low, high = (levels[own] for levels in (fit.levels[number], *level_bounds(fit.runs[number].spec)))
    return ~pressed(at, low, high, score)


def within_rows(fit: PooledFit, effect: Effect, found: WithInstants) -> bool:
    """Return whether the last effect of a fit may be in the instants of its logs alone.

    So may be a latency no larger than what is not known of them, and an effect of one parameter, such as a rudder lag,
    whose size is seen where the instants are taken for exact and is not where they are free.

    Parameters
    ----------
    found : WithInstants
        The fit with its instants free.
    """
    return _is_within(fit, effect) or _is_lost(fit, effect, found)


def _is_lost(fit: PooledFit, effect: Effect, found: WithInstants) -> bool:
    if len(effect.parameters) != 1 or found.covariance[-1, -1] == 0.0:
        return False
    exact_std, free_std = agreement_of(fit).widened * fit.std[-1], found.std(1)[0]
    return bool(abs(fit.values[-1]) >= _SEEN * exact_std and abs(found.fit.values[-1]) < _SEEN * free_std)


def _is_within(fit: PooledFit, effect: Effect) -> bool:
    of = next((field for field, name in _LATE.items() if name == effect.name), None)
    if of is None:
        return False
    own = (of, "smoothing_s") if of == "velocity_s" else (of,)
    std_s = max(hypot(*(getattr(filtered.run.instant_errors, field) for field in own)) for filtered in fit.runs)
    return bool(abs(fit.values[-1]) < _APART * std_s)


def row_around(runs: Sequence[GridRun], effect: Effect, size_s: float) -> float | None:
    """Return the time between rows, s, where an effect is a latency that is shorter; otherwise None.

    Rows that hold the last reading of each instrument can produce a latency of that size, and the table does not show
    that they do.

    Parameters
    ----------
    runs : sequence of GridRun
        The shortest time counts; logs of messages have none.
    size_s : float
        Of the latency.
    """
    row_s = min(run.instant_errors.row_s for run in runs)
    return row_s if effect.name in _LATE.values() and abs(size_s) < row_s else None


@dataclass(frozen=True, eq=False)
class _Late:
    """What the lateness of one instrument does, in every log by itself."""

    #: Shape (N,). To the innovations of all runs, a second of it.
    column: Float
    #: Standard deviation of the lateness by log, s; only logs of which it is not known.
    std_s: Mapping[int, float]
    #: Field of `InstantErrors`; "" of a lateness that is only considered.
    of: str = ""
    #: What was found of it before, by log.
    found_s: Mapping[int, float] = field(default_factory=dict)
    #: 0 where the model has the latency itself, which imitates it in full: at the maximum nothing is left of it to be
    #: found.
    foreign: float = 1.0

    @property
    def logs(self) -> list[int]:
        """The logs, in order."""
        return sorted(self.std_s)


def _rows(fit: PooledFit, workers: Executor) -> list[_Late]:
    """Return what a second of lateness does, of every instrument whose instants are not known in some log."""
    known = [filtered.run.instant_errors for filtered in fit.runs]
    unsure = [(of, effect) for of, effect in _LATE.items() if any(getattr(errors, of) for errors in known)]
    has = [effect.name for effect in fit.model.effects]
    tried = [effect for _, effect in unsure if effect not in has]
    by_effect = dict(
        zip(tried, responses(fit, [EffectTrial(get(name), (_STEP_S,)) for name in tried], workers), strict=True)
    )
    rows = []
    for of, effect in unsure:
        column = _own(fit, has.index(effect)) if effect in has else by_effect[effect]
        if column is not None:
            std_s = _by_log(fit, [getattr(errors, of) for errors in known])
            before_s = {filtered.run.day: getattr(filtered.run.instant_errors.found, of) for filtered in fit.runs}
            rows.append(_Late(column.ravel(), std_s, of, before_s, float(effect not in has)))
    return rows


def _smoothed(fit: PooledFit, workers: Executor) -> list[_Late]:
    """Return what a lateness that is a standard error larger does, where a velocity may be late; else nothing.

    In each run it is by the error that it has there. The readings themselves change, so that what they are late by as a
    signal and what they have lost of their noise is in it.
    """
    late = [float(filtered.run.instant_errors.smoothing_s > 0.0) for filtered in fit.runs]
    if not any(late):
        return []
    column = np.concatenate(list(workers.map(lambda number: _less_late(fit, number), range(len(fit.runs)))))
    return [_Late(column, _by_log(fit, late))]


def _less_late(fit: PooledFit, number: int) -> Float:
    """Return what a standard error more of lateness, undone, does to the innovations of a run, shape (2 m,)."""
    filtered, line = fit.runs[number], fit.linearised[number]
    run = filtered.run
    if run.lateral_by_late is None:
        return np.zeros(line.u.size)
    measured = run.measured.copy()
    measured[:, 0] += _STEP_S * run.lateral_by_late
    other = replace(filtered, run=replace(run, measured=measured))
    passed = other.run_filter(fit.hull, np.exp(fit.levels[number]), fit.values)
    return run.instant_errors.smoothing_s * difference(line.passed, passed, _STEP_S)


def _by_log(fit: PooledFit, errors: Sequence[float]) -> dict[int, float]:
    """Return the errors of runs by their logs, those that are not nothing."""
    return {filtered.run.day: s for filtered, s in zip(fit.runs, errors, strict=True) if s > 0.0}


def _own(fit: PooledFit, number: int) -> Float | None:
    """Return the column of the only parameter of one of the model's effects; None where it stands at a bound."""
    at = len(HULL_PARAMETERS) + sum(len(effect.parameters) for effect in fit.model.effects[:number])
    if any(at not in line.index for line in fit.linearised):
        return None
    return np.concatenate([line.J[:, line.index.index(at)] for line in fit.linearised])
