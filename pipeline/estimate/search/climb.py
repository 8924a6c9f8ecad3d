"""The climb to a maximum of a log-likelihood: damped Fisher scoring far away, quasi-Newton near the top.

Where the model lacks something the expected information is not the curvature, and scoring alone creeps. One run is
climbed by logarithms of its noise levels, several together by variances (decision 0036).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.estimate.search.scoring import DenseSteps
from kempf.schemas.model_spec import N_HULL

#: with less log-likelihood than this to gain, steps tell more of the curvature than the expected information
_NEAR = 5.0
#: share of its promise that a step must keep for the expected information to be trusted with the next one
_KEPT = 0.1
#: damping after a step that did not rise: less changes only the weakest directions, and steps fail along others too
_DAMPED = 0.1
#: a step that does not rise is shortened so, so many times, before the damping grows: its direction is mostly good,
#: and damping turns it towards the steepest rise, which creeps
_SHORTER, _TRIES = 0.3, 3
#: a logarithm that falls by more than this in a step, with less than so much left to gain, is on its way to nothing
_SINKING, _LITTLE = 0.2, 0.05
#: a climb that is to reach a height is given up where so many times its promise would not take it there: promises are
#: kept within a factor of two or so, but for those of the first steps
_HOPE, _FIRST = 4.0, 3
#: so many steps in a row that leave the likelihood where it ends and come to less than this share of their promise say
#: that it is highest there: beyond it ships answer faster than any vessel does
_AT_THE_END, _VAIN = 4, 0.02


#: the form that information and curvature have
C = TypeVar("C")
C_co = TypeVar("C_co", covariant=True)


class Objective(Protocol[C_co]):
    """What can be climbed: theta begins with the six hull parameters.

    Attributes
    ----------
    active, logarithms : ndarray of bool, shape (n_theta,)
        What may move; which are logarithms of what may be nothing.
    low, high : ndarray, shape (n_theta,)
        Bounds.
    """

    active: Mask
    logarithms: Mask
    low: Float
    high: Float

    def full(self, theta: Float) -> tuple[float, Float, C_co]:
        """Log-likelihood, score and expected information."""

    def room(self, theta: Float, *, far: bool) -> tuple[Float, Float]:
        """Return by how much a step, far from the top or near it, may move theta down (negative) and up."""


class Steps(Protocol[C]):
    """How steps are made from a curvature of this form."""

    def damped(self, score: Float, curvature: C, free: Mask, damping: float) -> Float:
        """Solve (I + damping diag I) step = score over what is free; 0 for the rest."""

    def within(self, score: Float, curvature: C, free: Mask, damping: float, room: tuple[Float, Float]) -> Float:
        """Return the same step made for the room there is, see `Objective.room`; what still leaves it is cut off."""

    def counted(self, gain: float, score: Float, curvature: C, free: Mask) -> float:
        """Return how much of a promised gain of log-likelihood says that the search must go on."""

    def corrected(self, curvature: C, before: C, here: C, step: Float, fall: Float, free: Mask) -> C:
        """Return a curvature corrected by what one step showed: by so much the score fell.

        ``curvature`` is what the step was made from, ``before`` and ``here`` is the information at its ends.
        """


@dataclass(frozen=True, eq=False)
class Pass:
    """One step of a search: where it stood, and what it promised before (NaN for the start)."""

    theta: Float
    log_likelihood: float
    expected_gain: float
    damping: float


def nobody(_: Pass) -> None:
    """Take no notice of a step."""


@dataclass(frozen=True, eq=False)
class Search(Generic[C]):
    """Where a search ended and how it got there."""

    theta: Float
    log_likelihood: float
    score: Float
    information: C
    converged: bool
    reason: str
    passes: tuple[Pass, ...]


class Bounded(Protocol):
    """What has bounds; see `Objective`."""

    active: Mask
    low: Float
    high: Float


def pressed(at: Float, low: Float, high: Float, score: Float) -> Mask:
    """Return which elements are at a bound, and their score drives them beyond it, shape (n,)."""
    against: Mask = ((at <= low) & (score < 0.0)) | ((at >= high) & (score > 0.0))
    return against


def free(objective: Bounded, theta: Float, score: Float) -> Mask:
    """Return which elements may move: active and not pressed against a bound."""
    return objective.active & ~pressed(theta, objective.low, objective.high, score)


def climb(objective: Objective[Float], start: Float, max_iterations: int, decrement: float) -> Search[Float]:
    """Climb from one start, the information a matrix; see `climb_by`."""
    return climb_by(DenseSteps(), objective, start, max_iterations, decrement)


def climb_by(
    steps: Steps[C],
    objective: Objective[C],
    start: Float,
    max_iterations: int,
    decrement: float,
    wanted: float = -np.inf,
    report: Callable[[Pass], None] = nobody,
) -> Search[C]:
    """Climb from one start.

    Parameters
    ----------
    start : ndarray, shape (n_theta,)
    decrement : float
        Converged when half the squared Newton decrement, the log-likelihood still to be gained, falls below this.
    wanted : float, optional
        Log-likelihood without which the end is of no use: where it is out of reach the climb is given up.
    report : callable, optional
        Called with the start and every step as soon as it is made.

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
    curvature, damping, scale = information, 1e-3, np.abs(theta[:N_HULL])
    converged, reason = False, "the iterations allowed ran out"
    passes = [Pass(theta, value, np.nan, damping)]
    report(passes[0])
    vain = 0
    for _ in range(max_iterations):
        movable = free(objective, theta, score)
        # the log-likelihood that the quadratic model still promises
        gain = float(0.5 * score @ steps.damped(score, curvature, movable, 0.0))
        if steps.counted(gain, score, curvature, movable) < decrement:
            converged, reason = True, "the log-likelihood still to be gained is below the limit"
            break
        if len(passes) > _FIRST and value + _HOPE * gain < wanted:
            reason = "what is wanted is out of reach"
            break
        if vain == _AT_THE_END:
            reason = "it still rises where the likelihood ends"
            break
        point, far, ends = None, gain > _NEAR, False
        low, high = objective.room(theta, far=far)
        while damping < 1e9:
            step = steps.within(score, curvature, movable, damping, (low, high))
            step = np.clip(_shortened(step, theta, scale), low, high)
            point, there, beyond = _risen(objective, theta, value, step)
            ends = ends or beyond
            if point is not None:
                break
            damping = max(10.0 * damping, _DAMPED)
        if point is None:
            converged, reason = gain < 1e-3, "no step raises the log-likelihood any more"
            break
        damping = damping / 10.0 if damping > 1e-9 else 0.0
        vain = vain + 1 if ends and there[0] - value < _VAIN * gain else 0
        if gain < _LITTLE:
            point, there = _sunk(objective, theta, point, there)
        if far and there[0] - value > _KEPT * gain:
            curvature = there[2]
        else:
            base = there[2] if far else curvature
            curvature = steps.corrected(base, information, there[2], point - theta, score - there[1], movable)
        theta, (value, score, information) = point, there
        passes.append(Pass(theta, value, gain, damping))
        report(passes[-1])
    return Search(theta, value, score, information, converged, reason, tuple(passes))


def _risen(
    objective: Objective[C], theta: Float, value: float, step: Float
) -> tuple[Float | None, tuple[float, Float, C], bool]:
    """Return where along a step the log-likelihood has risen, None if nowhere tried, and what it is there.

    Then whether the step leads to where there is no likelihood.
    """
    ends = False
    for shortened in range(_TRIES + 1):
        candidate = np.clip(theta + _SHORTER**shortened * step, objective.low, objective.high)
        # with derivatives at once: nearly every step rises, and then they are wanted
        there = objective.full(candidate)
        if there[0] > value:
            return candidate, there, ends
        ends = ends or not np.isfinite(there[0])
    return None, there, ends


def _sunk(
    objective: Objective[C], theta: Float, point: Float, there: tuple[float, Float, C]
) -> tuple[Float, tuple[float, Float, C]]:
    """Let levels that sink go to their lower bounds at once, where that is higher still.

    The log-likelihood goes with the square of a level near nothing, so that by its logarithm every step goes only a
    part of the way, and the same part again.
    """
    sinking: Mask = (point - theta < -_SINKING) & (there[1] < 0.0) & (point > objective.low) & objective.logarithms
    if not sinking.any():
        return point, there
    bottom = np.where(sinking, objective.low, point)
    lower = objective.full(bottom)
    return (bottom, lower) if lower[0] > there[0] else (point, there)


def _shortened(step: Float, theta: Float, scale: Float) -> Float:
    """Shorten a step of the hull that would at once double one of its parameters or leave the scale of the start.

    Far from the maximum the quadratic model sends the ship into regions where she answers absurdly fast.
    """
    reach = np.maximum(np.abs(theta[:N_HULL]), scale)
    # a parameter that began at nothing and is still there has no scale to leave
    large = np.max(np.abs(step[:N_HULL]) / np.where(reach > 0.0, reach, np.inf))
    shortened = step.copy()
    shortened[:N_HULL] *= min(1.0, 1.0 / float(large + 1e-300))
    return shortened
