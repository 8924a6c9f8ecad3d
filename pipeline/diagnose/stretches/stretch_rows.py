"""The rows of a stretch among the whitened innovations of a fit.

What the fitted parameters leave in them, and how that is correlated; formulas are in
`kempf.pipeline.diagnose.stretches.stretch`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.diagnose.screening.nuisance import Nuisance, columns_of, nuisance, orthonormal, without_levels
from kempf.pipeline.estimate.pooled_fit import Linearised, PooledFit
from kempf.schemas.model_spec import N_HULL

#: part of a variance below which rounding made it
_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a stretch; columns are over all fitted manoeuvres, then over that of the stretch if it is no such."""

    #: Of the fitted manoeuvres.
    known: Nuisance
    #: Shape (2 m,). Places of the stretch's rows in a column.
    at: NDArray[np.int64]
    instants: int
    #: None where the manoeuvre of the stretch was fitted.
    apart: Apart | None
    #: towards, factor: Shapes (2 m, q) and (q,). The whitened rows are x + towards (factor * towards' x).
    towards: Float
    factor: Float

    @staticmethod
    def all_rows(base: PooledFit) -> Float:
        """Return the whitened innovations as a column."""
        return np.concatenate([line.u for line in base.linearised])

    def of_stretch(self, columns: Float) -> Float:
        """Return the rows of the stretch as they are."""
        rows: Float = columns[self.at]
        return rows

    def left(self, columns: Float) -> Float:
        """Return the rows of the stretch without what the fitted parameters imitate of whole columns."""
        n = self.known.u.size
        if self.apart is None:
            return self.of_stretch(self.known.clean(columns))
        return self.of_stretch(np.concatenate([columns[:n], self.apart.clean(columns[:n], columns[n:])]))

    def whitened(self, rows: Float) -> Float:
        """Return rows, as `left` gives them, free of correlation and of variance 1; 0 where nothing can be seen."""
        inner = self.towards.T @ rows
        result: Float = rows + self.towards @ (self.factor * inner.T).T
        return result


@dataclass(frozen=True, eq=False)
class Apart:
    """A manoeuvre that was not fitted: shared parameters come from the others, noise levels are its own."""

    #: Shape (n, s). Its columns of the shared parameters, in units of their errors.
    shared: Float
    #: Shape (N, s). Orthonormal: what those are to the fitted manoeuvres, whose own levels are taken out.
    by_others: Float
    #: Shape (n, q). Basis of its own noise levels.
    levels: Float

    def clean(self, fitted: Float, own: Float) -> Float:
        """Return columns of this manoeuvre without what the parameters imitate that the others determine."""
        return self.without_levels(own - self.shared @ (self.by_others.T @ fitted))

    def without_levels(self, columns: Float) -> Float:
        """Return columns without what its own levels imitate."""
        result: Float = columns - self.levels @ (self.levels.T @ columns)
        return result


def rows_of(base: PooledFit, fitted: Sequence[bool], number: int, inside: Mask) -> Rows:
    """Return the rows of some instants of a manoeuvre.

    Parameters
    ----------
    base : PooledFit
        Fitted manoeuvres, then at most the one of the stretch.
    fitted : sequence of bool
    number : int
        Manoeuvre of the stretch.
    inside : ndarray of bool, shape (n,)
        Its instants.
    """
    shared = N_HULL + len(base.model.names)
    lines = [line for line, used in zip(base.linearised, fitted, strict=True) if used]
    known = nuisance(lines, shared)
    line = base.linearised[number]
    of_instant, _ = np.nonzero(np.isfinite(line.passed.innovation))
    own = np.flatnonzero(inside[of_instant])
    first = sum(manoeuvre.u.size for manoeuvre in base.linearised[:number])
    at = first + np.concatenate([own, own + of_instant.size])
    instants = int(np.unique(of_instant[own]).size)
    if fitted[number]:
        basis = known.basis[at]
        return Rows(known, at, instants, None, *_whitening(basis, -np.ones(basis.shape[1])))
    apart = _apart(lines, line, shared)
    parts = [part[at - first] for part in (apart.levels, apart.without_levels(apart.shared))]
    signs = np.concatenate([-np.ones(parts[0].shape[1]), np.ones(parts[1].shape[1])])
    return Rows(known, at, instants, apart, *_whitening(np.column_stack(parts), signs))


def _apart(lines: Sequence[Linearised], line: Linearised, shared: int) -> Apart:
    """Return what the fitted manoeuvres say of the parameters that another one shares with them."""
    common, levels = columns_of(line, shared)
    _, others = without_levels(lines, shared)
    norm = np.linalg.norm(others, axis=0)
    used = norm > 0.0
    left, singular, right = np.linalg.svd(others[:, used] / norm[used], full_matrices=False)
    kept = singular > _NOTHING * singular[0]
    factor = (right[kept].T / singular[kept]) / norm[used][:, None]
    return Apart(common[:, used] @ factor, left[:, kept], orthonormal(levels))


def _whitening(parts: Float, signs: Float) -> tuple[Float, Float]:
    """Return how rows of the covariance I + parts diag(signs) parts' are whitened."""
    basis, triangle = np.linalg.qr(parts)
    excess, turned = np.linalg.eigh(triangle @ (signs[:, None] * triangle.T))
    variance = 1.0 + excess
    seen = variance > _NOTHING
    factor = np.where(seen, 1.0 / np.sqrt(np.where(seen, variance, 1.0)), 0.0) - 1.0
    return basis @ turned, factor
