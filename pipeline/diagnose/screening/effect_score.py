"""What every score of an effect shares: channels, points at which it is tried, its size, the number of tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effect import Effect

#: Share of an effect that the fitted parameters imitate, above which it cannot be tested.
NOT_TESTABLE = 0.999


@dataclass(frozen=True, eq=False)
class Solved:
    """An effect by least squares on innovations that are free of what the fitted parameters imitate."""

    score: float
    #: Shape (c,). What its columns are multiplied by.
    estimate: Float
    #: change, std: Shape (p,). In the units of its parameters; of a shape the value it was tried at, std NaN.
    change: Float
    std: Float


def solved(columns: Float, errors: Float, effect: Effect, steps: tuple[float, ...]) -> Solved:
    """Return score and size of an effect.

    Parameters
    ----------
    columns : ndarray, shape (N, c)
        What it does, none of them nothing.
    errors : ndarray, shape (N,)
    steps : tuple of float
        Where on its grid it is tried.
    """
    information = columns.T @ columns
    scale = np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-9, hermitian=True) / np.outer(scale, scale)
    gradient = columns.T @ errors
    estimate = inverse @ gradient
    makes = np.array([not p.shapes for p in effect.parameters])
    change, std = np.array(steps, dtype=np.float64), np.full(len(steps), np.nan)
    change[makes], std[makes] = estimate, np.sqrt(np.diag(inverse))
    return Solved(float(gradient @ estimate), estimate, change, std)


def missing_channels(base: PooledFit, effect: Effect) -> tuple[str, ...]:
    """Return the channels that an effect needs and some of the runs lack."""
    return tuple(c for c in effect.needs if any(c not in filtered.run.channels for filtered in base.runs))


def measuring_channels(base: PooledFit, effect: Effect) -> tuple[str, ...]:
    """Return the channels that show an effect already in every run."""
    return tuple(c for c in effect.measured_by if all(c in filtered.run.channels for filtered in base.runs))


def grid(effect: Effect) -> list[tuple[float, ...]]:
    """Return the points at which an effect is tried: its first parameter and those of shape over all their steps."""
    choices = [p.steps if k == 0 or p.shapes else p.steps[:1] for k, p in enumerate(effect.parameters)]
    return list(product(*choices))


def plausible(effect: Effect, change: Float) -> bool:
    """Return whether the change goes where the effect can be at all: a rudder cannot answer before it moves."""
    inside = [np.clip(x, p.low, p.high) for x, p in zip(change, effect.parameters, strict=True)]
    return any(x != 0.0 for x, p in zip(inside, effect.parameters, strict=True) if not p.shapes)


def cosine_squared(direction: Float, other: Float) -> float:
    """Return the squared cosine between what two effects would explain, 0 to 1."""
    if direction.size != other.size or not direction.size:
        return 0.0
    both = float(direction @ direction) * float(other @ other)
    return float(direction @ other) ** 2 / both if both > 0.0 else 0.0


def adjusted(p_values: Sequence[float]) -> list[float]:
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
