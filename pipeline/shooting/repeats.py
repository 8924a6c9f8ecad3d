"""Legs that repeat each other: how much of what a model leaves is noise of the experiment, and would differ again.

Two windows of different manoeuvres that begin in the same state, at the same speed and heading, and see the same
rudder are one experiment made twice. What a model that goes by these leaves of the one it leaves of the other too; what
the two remainders differ by is noise: sea, wind, instruments, and what was measured wrongly at the beginning. It is the
split of a residual into lack of fit and pure error, half the mean square of the differences of pairs, with near
replicates in place of exact ones (Daniel & Wood 1971, "Fitting Equations to Data", ch. 7). The small difference of
beginnings and rudder is taken off by the model, each remainder being against its own prediction; what the model lacks
still differs the more, the farther two windows are apart, with the square of their distance, so that the share of noise
is read off at distance nothing.

Its error is that of a jackknife over manoeuvres, as pairs that share one are not independent (Arvesen 1969,
"Jackknifing U-statistics", Annals of Mathematical Statistics 40).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.grid_run import SHAFT_COLUMN
from kempf.pipeline.shooting.reduced import Scales, whitened
from kempf.pipeline.shooting.shooting_fit import ShootingFit, alone
from kempf.pipeline.shooting.shot_run import ShotRun, Unknowns
from kempf.pipeline.shooting.windows import Windows, windows_of

#: windows whose courses differ by at most this part of their size nearly repeat each other
NEAR = 0.3
#: pairs of windows, and manoeuvres that have them, from which the noise is known
FEWEST_PAIRS, FEWEST_MANOEUVRES = 10, 4
#: windows among which the one that repeats another is looked for begin so many times in the time of one
_DENSE = 12
#: instants of a window at which courses are compared
_POINTS = 17
#: part of the usual size of a course below which it counts as that large: at rest all windows are alike
_LEAST = 0.25
#: steps of Gauss-Newton by which a window finds its beginning
_STEPS = 2
#: how many courses there are
_COURSES = 8


@dataclass(frozen=True)
class Repeats:
    """What windows that nearly repeat each other say of the noise of the experiment."""

    #: Part of their misfit that is noise, and its standard error; None where too few repeat each other. Chance may take
    #: it below 0 and above 1.
    share: float | None
    std: float | None
    #: Their mean square error in units of the scales, channels summed; 0 where there are none.
    misfit: float
    #: pairs, manoeuvres: Of windows, and how many manoeuvres they are of.
    pairs: int
    manoeuvres: int


@dataclass(frozen=True, eq=False)
class _Swept:
    """One manoeuvre under the model, in windows that begin often."""

    #: Windows that begin in the time of half a window.
    half: int
    #: Shape (w, rows, 3). What the model leaves, in units of the scales; NaN where not measured.
    left: Float
    #: Shape (w, points, 8). What windows are compared by: rudder, v, r, change of heading, speed, shaft speed, and sine
    #: and cosine of the heading.
    courses: Float


def repeats(fit: ShootingFit, held: Sequence[Windows], horizon_s: float, workers: Executor) -> Repeats:
    """Return how much of what a fitted model leaves is noise, by windows that nearly repeat each other.

    Parameters
    ----------
    held : sequence of Windows
        Of manoeuvres that were not fitted.
    horizon_s : float
        Length of a window.
    """
    first = fit.shots[0]

    def own(windows: Windows) -> Float:
        shot = ShotRun(windows, first.model, first.spec)
        return alone(shot, fit.shared, fit.scales)[1].own

    every = [(shot.windows, part.at.own) for shot, part in zip(fit.shots, fit.parts, strict=True)]
    every += list(zip(held, workers.map(own, held), strict=True))
    results = list(workers.map(lambda pair: _swept(pair[0], pair[1], first, fit.shared, fit.scales, horizon_s), every))
    swept = [result for result in results if result is not None]
    floor = _floor(swept) if swept else np.zeros(_COURSES)
    rows = [
        (float(i), float(j), apart, *_differ(swept[i].left[a], swept[j].left[b]))
        for i, j in combinations(range(len(swept)), 2)
        if swept[i].left.shape[1] == swept[j].left.shape[1]
        for a, b, apart in _near(swept[i], swept[j], floor)
    ]
    return _summed(np.array([row for row in rows if row[4] > 0.0]).reshape(-1, 5))


def _swept(
    windows: Windows, own: Float, like: ShotRun, shared: Float, scales: Scales, horizon_s: float
) -> _Swept | None:
    """Let a manoeuvre run in windows that begin often; None where it has no whole one, or the model runs away."""
    run = windows.run
    dense = windows_of(run, horizon_s, 1.0 / _DENSE)
    length = int(dense.ends[0] - dense.begins[0])
    whole = dense.ends - dense.begins == length
    dense = replace(
        dense,
        begins=dense.begins[whole],
        ends=dense.ends[whole],
        start=dense.start[whole],
        start_std=dense.start_std[whole],
    )
    shot = ShotRun(dense, like.model, like.spec)
    at = Unknowns(shared, own, np.nan_to_num(dense.start))
    for _ in range(_STEPS):
        at = replace(at, starts=_begun(shot, at, scales))
    predicted = shot.predicted(shared[:, None], own[:, None], at.starts[..., None])[..., 0]
    if not np.all(np.isfinite(predicted)):
        return None
    shape = (dense.begins.size, length + 1, 3)
    left = ((dense.measured - predicted) / scales.error).reshape(shape)
    points = np.round(np.linspace(0, length, _POINTS)).astype(np.int64)
    rows, motion = dense.begins[:, None] + points, predicted.reshape(shape)[:, points]
    heading = run.heading_rad[rows]
    courses = [run.rudder_rad[rows], motion[..., 0], motion[..., 1], motion[..., 2] - motion[:, :1, 2]]
    courses += [run.speed_m_s[rows], run.inputs[::ROWS, SHAFT_COLUMN][rows], np.sin(heading), np.cos(heading)]
    half = max(1, length // 2 // max(1, length // _DENSE))
    return _Swept(half, left, np.stack(courses, axis=-1))


def _begun(shot: ShotRun, at: Unknowns, scales: Scales) -> Float:
    """Return the states at the beginnings after a step of Gauss-Newton, all else staying as it is; shape (w, 3)."""
    windows, by = shot.windows, 1e-3 * scales.error
    starts = np.tile(at.starts[..., None], 4)
    for j in range(3):
        starts[:, j, 1 + j] += by[j]
    predicted = shot.predicted(at.shared[:, None].repeat(4, 1), at.own[:, None].repeat(4, 1), starts)
    slopes = (predicted[..., 1:] - predicted[..., :1]) / by
    error, weight = whitened(shot, predicted[..., 0], scales)
    edges = np.searchsorted(windows.of_row, np.arange(windows.begins.size + 1))
    std = np.maximum(windows.start_std, 1e-3 * scales.error)
    result = at.starts.copy()
    for w in range(windows.begins.size):
        rows, known = slice(edges[w], edges[w + 1]), np.isfinite(windows.start[w])
        J = (slopes[rows] / scales.error[:, None] * weight[rows][..., None]).reshape(-1, 3)
        e = (error[rows] * weight[rows]).ravel()
        # what is predicted of the first instant against what was measured around it
        first = ((windows.start[w] - predicted[edges[w], :, 0]) / std[w])[known]
        slope = (slopes[edges[w]] / std[w][:, None])[known]
        J, e = np.concatenate([J, slope]), np.concatenate([e, first])
        if np.all(np.isfinite(J)) and np.all(np.isfinite(e)):
            result[w] += np.linalg.lstsq(J, e, rcond=1e-12)[0]
    return result


def _floor(swept: Sequence[_Swept]) -> Float:
    """Return the mean squares below which a course counts as that large, shape (8,)."""
    squares = np.mean(np.concatenate([np.mean(manoeuvre.courses**2, axis=1) for manoeuvre in swept]), axis=0)
    result: Float = _LEAST**2 * squares
    return result


def _near(one: _Swept, other: _Swept, floor: Float) -> list[tuple[int, int, float]]:
    """Return pairs of windows that nearly repeat each other, with the squares of their distances.

    Those of the first manoeuvre lie half a window apart, each with the nearest of the other.
    """
    size, pairs = np.mean(other.courses**2, axis=1), []
    for a in range(0, one.courses.shape[0], one.half):
        apart = np.mean((other.courses - one.courses[a]) ** 2, axis=1)
        scale = np.maximum(0.5 * (size + np.mean(one.courses[a] ** 2, axis=0)), floor)
        part = np.divide(apart, scale, out=np.zeros_like(apart), where=scale > 0.0)
        # forces go with the square of speeds, so that these count twice; a heading is one thing, in rad
        part[:, 4:6] *= 4.0
        part[:, 6] = apart[:, 6] + apart[:, 7]
        worst = np.max(part[:, :7], axis=1)
        b = int(np.argmin(worst))
        if worst[b] <= NEAR**2:
            pairs.append((a, b, float(worst[b])))
    return pairs


def _differ(a: Float, b: Float) -> tuple[float, float]:
    """Return half the mean square of the difference of two remainders, and their mean square, channels summed."""
    both = np.isfinite(a) & np.isfinite(b)
    many = np.maximum(np.count_nonzero(both, axis=0), 1)
    a, b = np.where(both, a, 0.0), np.where(both, b, 0.0)
    halves = (0.5 * np.sum(x, axis=0) / many for x in ((a - b) ** 2, a**2 + b**2))
    difference, misfit = (float(np.sum(x)) for x in halves)
    return difference, misfit


def _summed(rows: Float) -> Repeats:
    """Return what pairs say: a row each of manoeuvre, manoeuvre, squared distance, half difference and misfit."""
    names = np.unique(rows[:, :2])
    misfit = float(np.mean(rows[:, 4])) if rows.size else 0.0
    nothing = Repeats(None, None, misfit, rows.shape[0], names.size)
    if rows.shape[0] < FEWEST_PAIRS or names.size < FEWEST_MANOEUVRES:
        return nothing
    rests = [rows[(rows[:, 0] != name) & (rows[:, 1] != name)] for name in names]
    if min(rest.shape[0] for rest in rests) < 3:
        return nothing
    without = np.array([_share(rest) for rest in rests])
    std = float(np.sqrt((names.size - 1) * np.var(without)))
    return replace(nothing, share=_share(rows), std=std)


def _share(rows: Float) -> float:
    """Return the share of noise at distance nothing, by least squares weighted with the pairs' misfit."""
    root = np.sqrt(rows[:, 4])
    A = np.column_stack([root, root * rows[:, 2]])
    return float(np.linalg.lstsq(A, rows[:, 3] / root, rcond=1e-12)[0][0])
