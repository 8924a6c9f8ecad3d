"""What the fitted parameters do to the whitened innovations: no effect can be seen that does the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.pooled_fit import Linearised


@dataclass(frozen=True, eq=False)
class Nuisance:
    """The innovations of all runs in one column, and an orthonormal basis of what the fitted parameters span."""

    #: Shape (N,).
    u: Float
    #: Shape (N, q).
    basis: Float

    def clean(self, columns: Float) -> Float:
        """Return columns without what the fitted parameters can imitate, shape (N, c)."""
        result: Float = columns - self.basis @ (self.basis.T @ columns)
        return result


def nuisance(lines: Sequence[Linearised], shared: int) -> Nuisance:
    """Return the basis of hull, effects and noise levels of all runs.

    Parameters
    ----------
    shared : int
        How many parameters the runs share; the others are each run's own.
    """
    # the levels of one run touch no other: their bases stand below each other, and only what is shared meets them all
    q_own, rest = without_levels(lines, shared)
    u = np.concatenate([line.u for line in lines])
    blocks = np.zeros((u.size, sum(q.shape[1] for q in q_own)))
    row = column = 0
    for q in q_own:
        blocks[row : row + q.shape[0], column : column + q.shape[1]] = q
        row, column = row + q.shape[0], column + q.shape[1]
    return Nuisance(u, np.column_stack([blocks, orthonormal(rest)]))


def without_levels(lines: Sequence[Linearised], shared: int) -> tuple[list[Float], Float]:
    """Return a basis of each run's noise levels, and of all runs the shared columns without what these span.

    Parameters
    ----------
    shared : int
        How many parameters the runs share.
    """
    common, own = zip(*(columns_of(line, shared) for line in lines), strict=True)
    bases = [orthonormal(columns) for columns in own]
    return bases, np.concatenate([c - q @ (q.T @ c) for c, q in zip(common, bases, strict=True)])


def columns_of(line: Linearised, shared: int) -> tuple[Float, Float]:
    """Return the columns of the shared parameters and of a run's own."""
    return (
        line.J[:, [k for k, i in enumerate(line.index) if i < shared]],
        line.J[:, [k for k, i in enumerate(line.index) if i >= shared]],
    )


def orthonormal(columns: Float) -> Float:
    """Return an orthonormal basis of what columns span, shape (N, q)."""
    norm = np.linalg.norm(columns, axis=0)
    kept = columns[:, norm > 0.0] / norm[norm > 0.0]
    if not kept.shape[1]:
        return np.zeros((columns.shape[0], 0))
    left, singular, _ = np.linalg.svd(kept, full_matrices=False)
    basis: Float = left[:, singular > 1e-9 * singular[0]]
    return basis
