"""A manoeuvre's part of the normal equations, its own unknowns eliminated: states window by window, then constants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.shooting.shot_run import Moved, ShotRun, Unknowns
from kempf.pipeline.shooting.windows import Rows

#: m/s, rad/s, rad, also by unit of a parameter: who is predicted beyond has run away; the square may be no number
_RUNAWAY = 1e100


@dataclass(frozen=True, eq=False)
class Scales:
    """What an error of each channel is measured in, and how many readings of a window speak for themselves."""

    #: Shape (3,). m/s, rad/s, rad.
    error: Float
    #: Shape (3,). Independent readings of a window.
    independent: Float


@dataclass(frozen=True, eq=False)
class Reduced:
    """One manoeuvre linearised at a point."""

    at: Unknowns
    #: Sum of squares, priors of the manoeuvre's own unknowns included.
    cost: float
    #: Shape (6 + p, 6 + p), (6 + p,). Of the shared unknowns, the own ones at their best.
    information: Float
    gradient: Float
    #: Shape (w, 6 + p). The windows' parts of the gradient.
    scores: Float
    #: Of every window, what gives its states and constants back from a step of the shared unknowns.
    _states: tuple[tuple[Float, Float], ...]
    _own: tuple[Float, Float]
    _used: Rows
    #: Shape (w, 3). Mean square error by window and channel in units of the scales; NaN where not measured.
    errors: Float

    def stepped(self, step: Float, share: float = 1.0) -> Unknowns:
        """Return the unknowns after a step of the shared ones, the manoeuvre's own moved along.

        Parameters
        ----------
        share : float, optional
            Of the step that the own unknowns would take by themselves.
        """
        basis, rest = self._own
        own_step = -share * rest - basis @ step
        own = self.at.own.copy()
        own[self._used] += own_step
        together = np.concatenate([step, own_step])
        starts = self.at.starts + np.array([-share * left - back @ together for back, left in self._states])
        return Unknowns(self.at.shared + step, own, starts)


def whitened(shot: ShotRun, predicted: Float, scales: Scales) -> tuple[Float, Float]:
    """Return the errors of every row in units of the scales, shape (m, 3), and their weights, 0 where not measured."""
    windows = shot.windows
    error = (windows.measured - predicted) / scales.error
    made = np.isfinite(windows.measured)
    many = np.zeros((windows.begins.size, 3))
    for i in range(3):
        many[:, i] = np.bincount(windows.of_row[made[:, i]], minlength=windows.begins.size)
    weight = np.sqrt(np.minimum(scales.independent, np.maximum(many, 1.0)) / np.maximum(many, 1.0))[windows.of_row]
    return np.where(made, error, 0.0), np.where(made, weight, 0.0)


def reduce(shot: ShotRun, at: Unknowns, scales: Scales, without: Moved | None = None) -> Reduced:
    """Linearise a manoeuvre and eliminate what is its own.

    Parameters
    ----------
    without : (ndarray, ndarray), optional
        See `ShotRun.moved`.
    """
    windows = shot.windows
    predicted, slopes = shot.moved(at, scales.error, without)
    if not (np.all(np.abs(predicted) < _RUNAWAY) and np.all(np.abs(slopes) < _RUNAWAY)):
        return _diverged(shot, at)
    error, weight = whitened(shot, predicted, scales)
    e = error * weight
    J = -slopes / scales.error[None, :, None] * weight[..., None]
    p, d = at.shared.size, shot.used.size
    std = np.maximum(windows.start_std, 1e-3 * scales.error)
    edges = np.searchsorted(windows.of_row, np.arange(windows.begins.size + 1))
    tall, left, states, cost = [], [], [], 0.0
    for w in range(windows.begins.size):
        rows = slice(edges[w], edges[w + 1])
        known = np.isfinite(windows.start[w])
        # what is predicted of the first instant against what was measured around it
        first = predicted[edges[w]]
        prior = np.where(known, (windows.start[w] - first) / std[w], 0.0)[known]
        slope = -(slopes[edges[w]] / std[w][:, None])[known]
        E = np.concatenate([e[rows].ravel(), prior])
        A = np.concatenate([J[rows].reshape(-1, J.shape[2]), slope])
        cost += float(E @ E)
        q, r = np.linalg.qr(A[:, p + d :])
        back = np.linalg.lstsq(r, q.T @ np.column_stack([A[:, : p + d], E]), rcond=1e-12)[0]
        states.append((back[:, :-1], back[:, -1]))
        tall.append(A[:, : p + d] - q @ (q.T @ A[:, : p + d]))
        left.append(E - q @ (q.T @ E))
    prior_own = at.own[shot.used] / shot.own_std[shot.used]
    cost += float(prior_own @ prior_own)
    lower = np.zeros((d, p + d))
    lower[:, p:] = np.diag(1.0 / shot.own_std[shot.used])
    A, E = np.concatenate([*tall, lower]), np.concatenate([*left, prior_own])
    q, r = np.linalg.qr(A[:, p:])
    back = np.linalg.lstsq(r, q.T @ np.column_stack([A[:, :p], E]), rcond=1e-12)[0]
    A, E = A[:, :p] - q @ (q.T @ A[:, :p]), E - q @ (q.T @ E)
    ends = np.cumsum([piece.shape[0] for piece in tall])[:-1]
    pieces = zip(np.split(A[: E.size - d], ends), np.split(E[: E.size - d], ends), strict=True)
    return Reduced(
        at=at,
        cost=cost,
        information=A.T @ A,
        gradient=A.T @ E,
        scores=np.array([a.T @ b for a, b in pieces]),
        _states=tuple(states),
        _own=(back[:, :-1], back[:, -1]),
        _used=shot.used,
        errors=squares(shot, error),
    )


def _diverged(shot: ShotRun, at: Unknowns) -> Reduced:
    """Return a manoeuvre under a model that runs away: it asks for nothing and costs more than anything."""
    p, d, w = at.shared.size, shot.used.size, shot.windows.begins.size
    none = tuple((np.zeros((3, p + d)), np.zeros(3)) for _ in range(w))
    errors = np.where(np.isfinite(shot.windows.start), np.inf, np.nan)
    nothing = np.zeros((p, p)), np.zeros(p), np.zeros((w, p))
    return Reduced(at, np.inf, *nothing, none, (np.zeros((d, p)), np.zeros(d)), shot.used, errors)


def squares(shot: ShotRun, error: Float) -> Float:
    """Return the mean square error by window and channel, shape (w, 3), NaN where not measured."""
    windows = shot.windows
    mean_squares = np.full((windows.begins.size, 3), np.nan)
    made = np.isfinite(windows.measured)
    for i in range(3):
        of = windows.of_row[made[:, i]]
        many = np.bincount(of, minlength=windows.begins.size)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            mean_squares[:, i] = np.bincount(of, error[made[:, i], i] ** 2, minlength=windows.begins.size) / many
    return mean_squares
