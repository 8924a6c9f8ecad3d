"""The normal equations of what manoeuvres share, hull and effects, and the steps that they ask for within bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.shooting.reduced import Reduced
from kempf.pipeline.shooting.shot_run import ShotRun
from kempf.schemas.model_spec import N_HULL

#: standard deviation of the weak prior of the hull's parameters, parts of those of an ordinary hull of her length
_HULL_WIDE = 1.0


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Hull and effects of several manoeuvres, linearised at a point."""

    #: Shape (6 + p,).
    at: Float
    #: low, high: Shape (6 + p,). Bounds.
    low: Float
    high: Float
    #: Sum of squares there, with the priors.
    cost: float
    #: Shape (6 + p, 6 + p), (6 + p,). With the prior of the hull.
    information: Float
    gradient: Float

    @property
    def scale(self) -> Float:
        """What makes the information's diagonal one, shape (6 + p,)."""
        scale: Float = np.sqrt(np.maximum(np.diag(self.information), 1e-300))
        return scale

    def of(self, columns: NDArray[np.intp]) -> NormalEquations:
        """Return those of some of the unknowns, the others kept where they are."""
        return NormalEquations(
            *(self.at[columns], self.low[columns], self.high[columns], self.cost),
            *(self.information[np.ix_(columns, columns)], self.gradient[columns]),
        )

    def step(self, damping: float) -> Float:
        """Return the damped step within the bounds; what would leave them is put on them.

        Parameters
        ----------
        damping : float
            Of Levenberg, in parts of the information's diagonal.
        """
        scale, at = self.scale, self.at
        A = self.information / np.outer(scale, scale) + damping * np.eye(at.size)
        g = self.gradient / scale
        step, free = np.zeros(at.size), np.ones(at.size, dtype=bool)
        for _ in range(at.size):
            held = step * scale
            held[free] = 0.0
            step[free] = np.linalg.lstsq(A[np.ix_(free, free)], -(g + A @ held)[free], rcond=1e-14)[0] / scale[free]
            out = free & ((at + step < self.low) | (at + step > self.high))
            if not out.any():
                break
            step[out] = np.clip(at + step, self.low, self.high)[out] - at[out]
            free &= ~out
        return step

    def cost_after(self, step: Float) -> float:
        """Return the sum of squares after a step, were everything linear."""
        return self.cost + 2.0 * float(self.gradient @ step) + float(step @ self.information @ step)


def normal_equations(shots: Sequence[ShotRun], parts: Sequence[Reduced]) -> NormalEquations:
    """Add the manoeuvres' parts of the normal equations and the prior.

    Parameters
    ----------
    shots : sequence of ShotRun
        All with one model.
    parts : sequence of Reduced
        At one point; its cost is infinite where one diverges.
    """
    model, at = shots[0].model, parts[0].at.shared
    precision, pull = prior(shots[0], at)
    away = np.divide(pull, precision, out=np.zeros_like(pull), where=precision > 0.0)
    cost = sum(part.cost for part in parts) + float(away @ pull)
    return NormalEquations(
        at=at,
        low=np.concatenate([np.full(N_HULL, -np.inf), model.low]),
        high=np.concatenate([np.full(N_HULL, np.inf), model.high]),
        cost=cost if np.isfinite(cost) else float("inf"),
        information=np.sum([part.information for part in parts], axis=0) + np.diag(precision),
        gradient=np.sum([part.gradient for part in parts], axis=0) + pull,
    )


def prior(shot: ShotRun, shared: Float) -> tuple[Float, Float]:
    """Return precision and gradient of the prior of the shared parameters, shape (6 + p,) each."""
    ordinary = mariner_like(shot.windows.run.ship.length_m).array()
    precision = np.zeros(shared.size)
    precision[:N_HULL] = 1.0 / (_HULL_WIDE * ordinary) ** 2
    gradient = np.zeros(shared.size)
    gradient[:N_HULL] = (shared[:N_HULL] - ordinary) * precision[:N_HULL]
    return precision, gradient
