"""The information of a pool: an arrow of a matrix, one corner that all share and one block a member beside it.

Members touch each other through the hull alone, so the arrow is solved through its Schur complement, at a cost linear
in members. What steps show of the curvature besides is kept as the steps themselves. References: Golub & Van Loan
(2013), Matrix Computations, sect. 3.2; Nocedal & Wright (2006), Numerical Optimization, sect. 7.2 (limited memory).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.search.scoring import Mask

#: eigenvalues of a block with a unit diagonal below this count for nothing, their directions get no step
_NOTHING = 1e-13
#: weight of the gain that is promised beside that of the shared parameters
_OF_ALL = 0.01


@dataclass(frozen=True, eq=False)
class Arrow:
    """A symmetric matrix over (shared, first member's own, second member's own, ...)."""

    #: Shape (n_shared, n_shared).
    shared: Float
    #: Shape (n_members, n_shared, n_own). Shared rows of each member's columns.
    coupling: Float
    #: Shape (n_members, n_own, n_own).
    own: Float
    #: Each of shape (n_shared + n_members n_own,). Steps taken since, and by how much the score fell on each.
    shown: tuple[tuple[Float, Float], ...] = ()

    def masked(self, free: Mask) -> Arrow:
        """Return it with the rows and columns of what is not free taken out, a one on their diagonal."""
        n, (members, _, width) = self.shared.shape[0], self.coupling.shape
        a, b = free[:n].astype(float), free[n:].reshape(members, width).astype(float)
        return replace(
            self,
            shared=self.shared * np.outer(a, a) + np.diag(1.0 - a),
            coupling=self.coupling * a[None, :, None] * b[:, None, :],
            own=self.own * b[:, :, None] * b[:, None, :] + (1.0 - b)[:, :, None] * np.eye(width),
        )

    def times(self, vector: Float) -> Float:
        """Return the product with a vector, the steps shown left out."""
        n, (members, _, width) = self.shared.shape[0], self.coupling.shape
        x, z = vector[:n], vector[n:].reshape(members, width)
        top = self.shared @ x + np.sum(np.einsum("mij,mj->mi", self.coupling, z), axis=0)
        rest = np.einsum("mji,j->mi", self.coupling, x) + np.einsum("mij,mj->mi", self.own, z)
        return np.concatenate([top, rest.ravel()])

    def eliminated(self) -> tuple[Float, Float]:
        """Return the Schur complement of the shared block, and what takes each member's own rows to the shared ones.

        Returns
        -------
        complement : ndarray, shape (n_shared, n_shared)
            Information on what is shared, everything else unknown.
        carried : ndarray, shape (n_members, n_shared, n_own)
            Coupling times the inverse of the own block.
        """
        carried = self.coupling @ inverse(self.own)
        complement: Float = self.shared - np.sum(carried @ np.swapaxes(self.coupling, 1, 2), axis=0)
        return complement, carried

    def solve(self, right: Float, damping: float = 0.0) -> Float:
        """Return the solution of (arrow + damping diag arrow) x = right, the steps shown left out.

        Parameters
        ----------
        right : ndarray, shape (n_shared + n_members n_own,)
        """
        n, (members, _, width) = self.shared.shape[0], self.coupling.shape
        stiff = replace(
            self,
            shared=self.shared + damping * np.diag(np.diag(self.shared)),
            own=self.own * (1.0 + damping * np.eye(width)),
        )
        top, rest = right[:n], right[n:].reshape(members, width)
        complement, carried = stiff.eliminated()
        x = inverse(complement) @ (top - np.sum(np.einsum("mij,mj->mi", carried, rest), axis=0))
        z = np.einsum("mij,mj->mi", inverse(stiff.own), rest) - np.einsum("mji,j->mi", carried, x)
        return np.concatenate([x, z.ravel()])


class ArrowSteps:
    """Steps of the search on an arrow; see `kempf.pipeline.estimate.search.scoring.DenseSteps`."""

    def damped(self, score: Float, curvature: Arrow, free: Mask, damping: float) -> Float:
        """Return the step of the arrow as all steps shown have corrected it, 0 for what is not free."""
        arrow, right = curvature.masked(free), np.where(free, score, 0.0)
        steps = [(np.where(free, s, 0.0), np.where(free, y, 0.0)) for s, y in curvature.shown]
        steps = [(s, y) for s, y in steps if s @ y > 0.0]
        weights = []
        for s, y in reversed(steps):
            weight = float(s @ right / (s @ y))
            weights.append(weight)
            right = right - weight * y
        step = arrow.solve(right, damping)
        for (s, y), weight in zip(steps, reversed(weights), strict=True):
            step = step + (weight - float(y @ step / (s @ y))) * s
        return np.where(free, step, 0.0)

    def counted(self, gain: float, score: Float, curvature: Arrow, free: Mask) -> float:
        """Return what moving the shared parameters promises, and a hundredth of all that is promised.

        Noise levels of single members creep for long while what is shared stays where it is.
        """
        arrow, right = curvature.masked(free), np.where(free, score, 0.0)
        complement, carried = arrow.eliminated()
        n, (members, _, width) = complement.shape[0], arrow.coupling.shape
        efficient = right[:n] - np.sum(np.einsum("mij,mj->mi", carried, right[n:].reshape(members, width)), axis=0)
        return max(float(0.5 * efficient @ inverse(complement) @ efficient), _OF_ALL * gain)

    def updated(self, curvature: Arrow, step: Float, fall: Float, free: Mask) -> Arrow:
        """Return the arrow with one more step shown; without it where it shows no curvature."""
        s, y = np.where(free, step, 0.0), np.where(free, fall, 0.0)
        if s @ y <= 1e-10 * np.linalg.norm(s) * np.linalg.norm(y) or s @ curvature.times(s) <= 0.0:
            return curvature
        return replace(curvature, shown=(*curvature.shown, (s, y)))


def inverse(matrix: Float) -> Float:
    """Invert symmetric matrices, shape (..., n, n), scaled to a unit diagonal; undetermined directions give nothing."""
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    # what has no information at all is left out by a scale of nothing
    scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
    both = scale[..., :, None] * scale[..., None, :]
    inverse: Float = np.linalg.pinv(matrix * both, rcond=_NOTHING, hermitian=True) * both
    return inverse
