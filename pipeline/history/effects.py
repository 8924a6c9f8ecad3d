"""How large a change is, in which parameters, and when: intervals simulated at the change that was found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.history.contrasts import scatter
from kempf.pipeline.history.scan import Stretch

_DRAWS = 400


@dataclass(frozen=True, eq=False)
class Contrast:
    """A change along every direction, relative."""

    #: before, change, std: Shape (..., n_direction). Level at the beginning, change, its standard error.
    before: Float
    change: Float
    std: Float


def step_at(one: Stretch, value: Float, k: int) -> Contrast:
    """Return the weighted means after a split less those before it.

    Parameters
    ----------
    value : ndarray, shape (..., n_set, n_parameter)
        Relative.
    k : int
        Sets before the split.
    """
    after = np.arange(one.variance.shape[0]) >= k
    return _regression(one, value, after.astype(float))


def drift_of(one: Stretch, value: Float) -> Contrast:
    """Return the straight line in time: level at the first set, change and its standard error per year."""
    return _regression(one, value, one.years)


def _regression(one: Stretch, value: Float, x: Float) -> Contrast:
    """Weighted least squares of z = before + change x, its variance moderated as in the statistics."""
    z = value @ one.along
    w = 1.0 / (one.variance + scatter(z, one.variance))
    W = np.sum(w, axis=-2)
    centre = np.sum(w * x[:, None], axis=-2) / W
    d = x[:, None] - centre[..., None, :]
    sxx = np.sum(w * d**2, axis=-2)
    change = np.sum(w * d * z, axis=-2) / sxx
    before = np.sum(w * z, axis=-2) / W - change * centre
    left = z - before[..., None, :] - change[..., None, :] * x[:, None]
    prior = one.settings.prior_dof
    phi = (prior + np.sum(w * left**2, axis=-2)) / (prior + x.size - 2)
    return Contrast(before, change, np.sqrt(phi / sxx))


@dataclass(frozen=True, eq=False)
class Intervals:
    """What the simulation at the change found."""

    #: Simultaneous 1 - level intervals of all parameters are the change +- width standard errors.
    width: float
    #: Shape (n_kept,). Splits that the data do not exclude; empty for a drift.
    splits: NDArray[np.int64]


def step_intervals(one: Stretch, k: int, level: float) -> Intervals:
    """Simulate the step that was found and see how far its estimates stray.

    The splits kept are those whose statistic lies no farther below the largest than that of the true split did in
    1 - level of the simulated histories (the inversion of a likelihood-ratio test: Siegmund 1988, "Confidence sets in
    change-point problems", International Statistical Review 56).
    """
    p, first = one.value.shape[1], one.settings.smallest_side
    found = step_at(one, one.value, k)
    after = (np.arange(one.value.shape[0]) >= k)[:, None]
    shift = found.change[p:]
    simulated = one.noise(_DRAWS, 1) + after * shift
    by_split = one.statistics(simulated).step.max(axis=-1)
    deficit = np.sqrt(by_split.max(axis=-1)) - np.sqrt(by_split[:, k - first])
    allowed = np.quantile(deficit, 1.0 - level)
    own = np.sqrt(one.statistics(one.value).step.max(axis=-1))
    strayed = np.empty(_DRAWS)
    where = np.argmax(by_split, axis=-1) + first
    for split in np.unique(where):
        chosen = where == split
        c = step_at(one, simulated[chosen], int(split))
        strayed[chosen] = np.max(np.abs(c.change[:, p:] - shift) / c.std[:, p:], axis=-1)
    return Intervals(
        float(np.quantile(strayed, 1.0 - level)), np.flatnonzero(own >= own.max() - allowed - 1e-12) + first
    )


def drift_intervals(one: Stretch, level: float) -> Intervals:
    """Simulate the drift that was found and see how far its estimates stray."""
    p = one.value.shape[1]
    rate = drift_of(one, one.value).change[p:]
    c = drift_of(one, one.noise(_DRAWS, 1) + one.years[:, None] * rate)
    strayed = np.max(np.abs(c.change[:, p:] - rate) / c.std[:, p:], axis=-1)
    return Intervals(float(np.quantile(strayed, 1.0 - level)), np.empty(0, dtype=np.int64))


def preference(one: Stretch) -> float:
    """Return BIC of the best step less BIC of a drift: negative prefers the step (Schwarz 1978, Ann. Stat. 6).

    Over the principal axes, in which the sets' errors are nearly independent; the unknown time costs a step one
    parameter more.
    """
    n, p = one.value.shape
    z = one.value @ one.along[:, :p]
    variance = one.variance[:, :p]
    w = 1.0 / (variance + scatter(z, variance))
    prior, first = one.settings.prior_dof, one.settings.smallest_side

    def misfit(x: Float) -> float:
        W = np.sum(w, axis=0)
        d = x[:, None] - np.sum(w * x[:, None], axis=0) / W
        left = z - np.sum(w * z, axis=0) / W
        left = left - d * np.sum(w * d * z, axis=0) / np.sum(w * d**2, axis=0)
        return float((prior + n) * np.sum(np.log(prior + np.sum(w * left**2, axis=0))))

    steps = [misfit((np.arange(n) >= k).astype(float)) for k in range(first, n - first + 1)]
    return float(min(steps) + np.log(n) - misfit(one.years))


def alone(one: Stretch, found: Contrast, width: float) -> list[tuple[int, float, float]]:
    """Return the parameters whose change alone explains what was found: index, change, standard error, relative.

    Parameters
    ----------
    found : Contrast
        The change along all directions.
    width : float
        Standard errors by which a principal axis may miss.
    """
    p = one.value.shape[1]
    U, change, std = one.along[:, :p], found.change[:p], found.std[:p]
    explained = []
    for j in range(p):
        information = float(np.sum((U[j] / std) ** 2))
        size = float(np.sum(U[j] * change / std**2)) / information
        if np.max(np.abs(change - U[j] * size) / std) <= width:
            explained.append((j, size, float(information**-0.5)))
    return explained
