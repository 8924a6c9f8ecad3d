"""Steps of the search: damped Fisher scoring, and the curvature that steps themselves have shown.

Reference: Nocedal & Wright (2006), Numerical Optimization, ch. 6 and 10.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float, Mask

#: smallest pivot of a matrix with a unit diagonal that is solved as it is
_DETERMINED = 1e-5


def bfgs(curvature: Float, step: Float, fall: Float, free: Mask) -> Float:
    """Return the curvature corrected by what one step showed (Broyden-Fletcher-Goldfarb-Shanno).

    Parameters
    ----------
    curvature : ndarray, shape (n_theta, n_theta)
        Positive definite over the free parameters.
    step : ndarray, shape (n_theta,)
        Step taken.
    fall : ndarray, shape (n_theta,)
        Score before less score after it.
    free : ndarray of bool, shape (n_theta,)
        Parameters that moved.
    """
    s, y = np.where(free, step, 0.0), np.where(free, fall, 0.0)
    Bs = curvature @ s
    if s @ y <= 1e-10 * np.linalg.norm(s) * np.linalg.norm(y) or s @ Bs <= 0.0:
        return curvature
    # beside a filter that all but runs away derivatives are finite, and their squares are not
    with np.errstate(over="ignore", invalid="ignore"):
        updated: Float = curvature - np.outer(Bs, Bs) / (s @ Bs) + np.outer(y, y) / (s @ y)
    return updated if np.all(np.isfinite(updated)) else curvature


def damped_step(score: Float, information: Float, free: Mask, damping: float) -> Float:
    """Solve (I + damping diag I) step = score over the free parameters; 0 for the others, shape (n_theta,)."""
    step = np.zeros(score.size)
    index = np.flatnonzero(free)
    block = information[np.ix_(index, index)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    normalised = block / np.outer(scale, scale) + damping * np.eye(index.size)
    try:
        root = np.linalg.cholesky(normalised)
        determined = bool(np.min(np.diag(root)) > _DETERMINED)
    except np.linalg.LinAlgError:
        determined = False
    if determined:
        solution = np.linalg.solve(normalised, score[index] / scale)
    else:
        # a direction the data do not determine gets no step instead of an infinite one
        solution = np.linalg.lstsq(normalised, score[index] / scale, rcond=1e-13)[0]
    step[index] = solution / scale
    return step


class DenseSteps:
    """Steps of the search on a matrix; what a curvature of another form offers too."""

    def damped(self, score: Float, curvature: Float, free: Mask, damping: float) -> Float:
        """See `damped_step`."""
        return damped_step(score, curvature, free, damping)

    def within(self, score: Float, curvature: Float, free: Mask, damping: float, room: tuple[Float, Float]) -> Float:
        """Return the step as it is; what has no room is cut off after it."""
        return damped_step(score, curvature, free, damping)

    def counted(self, gain: float, score: Float, curvature: Float, free: Mask) -> float:
        """Return all of it."""
        return gain

    def corrected(self, curvature: Float, before: Float, here: Float, step: Float, fall: Float, free: Mask) -> Float:
        """Return the curvature with what all steps near the top have shown; see `bfgs`."""
        return bfgs(curvature, step, fall, free)
