"""The climb to a maximum of a log-likelihood: damped Fisher scoring far away, quasi-Newton near the top.

Where the model lacks something the expected information is not the curvature, and scoring alone creeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pipeline.identify.scoring import Mask, bfgs, damped_step, newton_decrement
from pipeline.normalise.series import Float

#: with less log-likelihood than this to gain, steps tell more of the curvature than the expected information
_NEAR = 5.0
#: share of its promise that a step must keep for the expected information to be trusted with the next one
_KEPT = 0.1
#: damping after a step that did not rise: less changes only the weakest directions, and steps fail along others too
_DAMPED = 0.1
_HULL = 6


class Objective(Protocol):
    """What can be climbed: theta begins with the six hull parameters, the rest are logarithms."""

    active: Mask
    low: Float
    high: Float

    def full(self, theta: Float) -> tuple[float, Float, Float]:
        """Log-likelihood, score and expected information."""


@dataclass(frozen=True, eq=False)
class Pass:
    """One step of a search: where it stood, and what it promised before (NaN for the start)."""

    theta: Float
    log_likelihood: float
    expected_gain: float
    damping: float


@dataclass(frozen=True, eq=False)
class Search:
    """Where a search ended and how it got there."""

    theta: Float
    log_likelihood: float
    score: Float
    information: Float
    converged: bool
    reason: str
    passes: tuple[Pass, ...]


def free(objective: Objective, theta: Float, score: Float) -> Mask:
    """Return which elements may move: active and not pressed against a bound."""
    pressed: Mask = ((theta <= objective.low) & (score < 0)) | ((theta >= objective.high) & (score > 0))
    return objective.active & ~pressed


def climb(objective: Objective, start: Float, max_iterations: int, decrement: float) -> Search:
    """Climb from one start.

    Parameters
    ----------
    objective : Objective
    start : ndarray, shape (n_theta,)
    max_iterations : int
    decrement : float
        Converged when half the squared Newton decrement, the log-likelihood still to be gained, falls below this.

    Returns
    -------
    Search
        With a log-likelihood of -inf where the start has none.
    """
    theta = np.clip(start, objective.low, objective.high)
    value, score, information = objective.full(theta)
    if not np.isfinite(value):
        reason = "the start has no likelihood"
        return Search(theta, -np.inf, score, information, converged=False, reason=reason, passes=())
    curvature, damping, scale = information, 1e-3, np.abs(theta[:_HULL])
    converged, reason = False, "the iterations allowed ran out"
    passes = [Pass(theta, value, np.nan, damping)]
    for _ in range(max_iterations):
        movable = free(objective, theta, score)
        gain = newton_decrement(score, curvature, movable)
        if gain < decrement:
            converged, reason = True, "the log-likelihood still to be gained is below the limit"
            break
        found = None
        while damping < 1e9:
            step = _bounded(damped_step(score, curvature, movable, damping), theta, scale)
            candidate = np.clip(theta + step, objective.low, objective.high)
            # with derivatives at once: nearly every step rises, and then they are wanted
            there = objective.full(candidate)
            if there[0] > value:
                found = candidate
                break
            damping = max(10.0 * damping, _DAMPED)
        if found is None:
            converged, reason = gain < 1e-3, "no step raises the log-likelihood any more"
            break
        damping = damping / 10.0 if damping > 1e-9 else 0.0
        step, before = found - theta, score
        rise, far = there[0] - value, gain > _NEAR
        theta, (value, score, information) = found, there
        if far and rise > _KEPT * gain:
            curvature = information
        else:
            curvature = bfgs(information if far else curvature, step, before - score, movable)
        passes.append(Pass(theta, value, gain, damping))
    return Search(theta, value, score, information, converged, reason, tuple(passes))


def _bounded(step: Float, theta: Float, scale: Float) -> Float:
    """Shorten a step that would at once double a hull parameter or leave the scale of the start.

    Far from the maximum the quadratic model sends the ship into regions where she answers absurdly fast.
    """
    reach = np.maximum(np.abs(theta[:_HULL]), scale)
    bounded = step * min(1.0, 1.0 / float(np.max(np.abs(step[:_HULL]) / reach) + 1e-300))
    bounded[_HULL:] = np.clip(step[_HULL:], -1.0, 1.0)
    return bounded
