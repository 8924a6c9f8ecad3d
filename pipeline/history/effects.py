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


def step_at(stretch: Stretch, value: Float, k: int) -> Contrast:
    """Return the weighted means after a split less those before it.

    Parameters
    ----------
    value : ndarray, shape (..., n_set, n_parameter)
        Relative.
    k : int
        Sets before the split.
    """
    after = np.arange(stretch.variance.shape[0]) >= k
    return _regression(stretch, value, after.astype(float))


def drift_of(stretch: Stretch, value: Float) -> Contrast:
    """Return the straight line in time: level at the first set, change and its standard error per year."""
    return _regression(stretch, value, stretch.years)


def _regression(stretch: Stretch, value: Float, x: Float) -> Contrast:
    """Weighted least squares of z = before + change x, its variance moderated as in the statistics."""
    z = value @ stretch.along
    w = 1.0 / (stretch.variance + scatter(z, stretch.variance))
    W = np.sum(w, axis=-2)
    centre = np.sum(w * x[:, None], axis=-2) / W
    d = x[:, None] - centre[..., None, :]
    sxx = np.sum(w * d**2, axis=-2)
    change = np.sum(w * d * z, axis=-2) / sxx
    before = np.sum(w * z, axis=-2) / W - change * centre
    left = z - before[..., None, :] - change[..., None, :] * x[:, None]
    prior = stretch.settings.prior_dof
    phi = (prior + np.sum(w * left**2, axis=-2)) / (prior + x.size - 2)
    return Contrast(before, change, np.sqrt(phi / sxx))


@dataclass(frozen=True, eq=False)
class Intervals:
    """What the simulation at the change found."""

    #: Simultaneous 1 - level intervals of all parameters are the change +- width standard errors.
    width: float
    #: Shape (n_kept,). Splits that the data do not exclude; empty for a drift.
    splits: NDArray[np.int64]


def step_intervals(stretch: Stretch, k: int, level: float) -> Intervals:
    """Simulate the step that was found and see how far its estimates stray.

    The splits kept are those whose statistic lies no farther below the largest than that of the true split did in
    1 - level of the simulated histories (the inversion of a likelihood-ratio test: Siegmund 1988, "Confidence sets in
    change-point problems", International Statistical Review 56).
    """
    p, first = stretch.value.shape[1], stretch.settings.smallest_side
    contrast = step_at(stretch, stretch.value, k)
    after = (np.arange(stretch.value.shape[0]) >= k)[:, None]
    shift = contrast.change[p:]
    simulated = stretch.noise(_DRAWS, 1) + after * shift
    by_split = stretch.statistics(simulated).step.max(axis=-1)
    deficit = np.sqrt(by_split.max(axis=-1)) - np.sqrt(by_split[:, k - first])
    allowed = np.quantile(deficit, 1.0 - level)
    own = np.sqrt(stretch.statistics(stretch.value).step.max(axis=-1))
    strayed = np.empty(_DRAWS)
    where = np.argmax(by_split, axis=-1) + first
    for split in np.unique(where):
        chosen = where == split
        c = step_at(stretch, simulated[chosen], int(split))
        strayed[chosen] = np.max(np.abs(c.change[:, p:] - shift) / c.std[:, p:], axis=-1)
    return Intervals(
        float(np.quantile(strayed, 1.0 - level)), np.flatnonzero(own >= own.max() - allowed - 1e-12) + first
    )


def drift_intervals(stretch: Stretch, level: float) -> Intervals:
    """Simulate the drift that was found and see how far its estimates stray."""
    p = stretch.value.shape[1]
    rate = drift_of(stretch, stretch.value).change[p:]
    c = drift_of(stretch, stretch.noise(_DRAWS, 1) + stretch.years[:, None] * rate)
    strayed = np.max(np.abs(c.change[:, p:] - rate) / c.std[:, p:], axis=-1)
    return Intervals(float(np.quantile(strayed, 1.0 - level)), np.empty(0, dtype=np.int64))


def preference(stretch: Stretch) -> float:
    """Return BIC of the best step less BIC of a drift: negative prefers the step (Schwarz 1978, Ann. Stat. 6).

    Over the principal axes, in which the sets' errors are nearly independent; the unknown time costs a step one
    parameter more.
    """
    n, p = stretch.value.shape
    z = stretch.value @ stretch.along[:, :p]
    variance = stretch.variance[:, :p]
    w = 1.0 / (variance + scatter(z, variance))
    prior, first = stretch.settings.prior_dof, stretch.settings.smallest_side

    def misfit(x: Float) -> float:
        W = np.sum(w, axis=0)
        d = x[:, None] - np.sum(w * x[:, None], axis=0) / W
        left = z - np.sum(w * z, axis=0) / W
        left = left - d * np.sum(w * d * z, axis=0) / np.sum(w * d**2, axis=0)
        return float((prior + n) * np.sum(np.log(prior + np.sum(w * left**2, axis=0))))

    steps = [misfit((np.arange(n) >= k).astype(float)) for k in range(first, n - first + 1)]
    return float(min(steps) + np.log(n) - misfit(stretch.years))


def alone(stretch: Stretch, contrast: Contrast, width: float) -> list[tuple[int, float, float]]:
    """Return the parameters whose change alone explains what was found: index, change, standard error, relative.

    Parameters
    ----------
    contrast : Contrast
        The change along all directions.
    width : float
        Standard errors by which a principal axis may miss.
    """
    p = stretch.value.shape[1]
    U, change, std = stretch.along[:, :p], contrast.change[:p], contrast.std[:p]
    explained = []
    for j in range(p):
        information = float(np.sum((U[j] / std) ** 2))
        size = float(np.sum(U[j] * change / std**2)) / information
        if np.max(np.abs(change - U[j] * size) / std) <= width:
            explained.append((j, size, float(information**-0.5)))
    return explained
