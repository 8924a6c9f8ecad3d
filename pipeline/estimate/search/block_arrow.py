"""The information of a pool: an arrow of a matrix, one corner that all share and one block a member beside it.

Members touch each other through the hull alone, so the arrow is solved through its Schur complement, at a cost linear
in members. What steps show of the curvature besides is kept as the steps themselves. References: Golub & Van Loan
(2013), Matrix Computations, sect. 3.2; Nocedal & Wright (2006), Numerical Optimization, sect. 7.2 (limited memory).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float, Mask

#: eigenvalues of a block with a unit diagonal below this count for nothing, their directions get no step
_NOTHING = 1e-13
#: weight of the gain that is promised beside that of the shared parameters
_OF_ALL = 0.01
#: share of the curvature along a step that a block keeps at least
_CONVEX = 0.2
#: so many times a step is solved anew that leaves its room
_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Arrow:
    """A symmetric matrix over (shared, first member's own, second member's own, ...)."""

    #: Shape (n_members, n_shared, n_shared). What each member adds to the corner.
    shared: Float
    #: Shape (n_members, n_shared, n_own). Shared rows of each member's columns.
    coupling: Float
    #: Shape (n_members, n_own, n_own).
    own: Float
    #: Shape (n_members, n_shared + n_own). Each member's own score where this is its information.
    scores: Float

    def masked(self, free: Mask) -> Arrow:
        """Return it with the rows and columns of what is not free taken out, a one on their diagonal."""
        members, n, width = self.coupling.shape
        a, b = free[:n].astype(float), free[n:].reshape(members, width).astype(float)
        return replace(
            self,
            shared=self.shared * np.outer(a, a) + np.diag(1.0 - a) / members,
            coupling=self.coupling * a[None, :, None] * b[:, None, :],
            own=self.own * b[:, :, None] * b[:, None, :] + (1.0 - b)[:, :, None] * np.eye(width),
        )

    def blocks(self) -> Float:
        """Return every member's matrix over (shared, its own), shape (n_members, n_shared + n_own, the same)."""
        rows = np.concatenate([self.shared, self.coupling], axis=2)
        below = np.concatenate([np.swapaxes(self.coupling, 1, 2), self.own], axis=2)
        return np.concatenate([rows, below], axis=1)

    def scaled(self, factors: Float) -> Arrow:
        """Return it with its rows and columns, and the scores, multiplied."""
        members, n, _ = self.coupling.shape
        by = _by_member(factors, members, n)
        blocks = self.blocks() * by[:, :, None] * by[:, None, :]
        return Arrow(blocks[:, :n, :n], blocks[:, :n, n:], blocks[:, n:, n:], self.scores * by)

    def times(self, vector: Float) -> Float:
        """Return the product with a vector."""
        members, n, width = self.coupling.shape
        x, z = vector[:n], vector[n:].reshape(members, width)
        top = np.sum(self.shared, axis=0) @ x + np.sum(np.einsum("mij,mj->mi", self.coupling, z), axis=0)
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
        complement: Float = np.sum(self.shared - carried @ np.swapaxes(self.coupling, 1, 2), axis=0)
        return complement, carried

    def solve(self, right: Float, damping: float = 0.0) -> Float:
        """Return the solution of (arrow + damping diag arrow) x = right.

        Parameters
        ----------
        right : ndarray, shape (n_shared + n_members n_own,)
        """
        members, n, width = self.coupling.shape
        stiff = replace(
            self,
            shared=self.shared * (1.0 + damping * np.eye(n)),
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
        """Return the step of the arrow, 0 for what is not free."""
        return np.where(free, curvature.masked(free).solve(np.where(free, score, 0.0), damping), 0.0)

    def within(self, score: Float, curvature: Arrow, free: Mask, damping: float, room: tuple[Float, Float]) -> Float:
        """Return the step with what would leave put to the edge, and the rest solved anew.

        Cut off after it is solved, it would move the hull as if a level went where it cannot go.
        """
        put, loose = np.zeros(score.size), free
        step = self.damped(score, curvature, loose, damping)
        for _ in range(_ROUNDS):
            over = loose & ((step < room[0]) | (step > room[1]))
            if not over.any():
                break
            put, loose = np.where(over, np.clip(step, *room), put), loose & ~over
            step = put + self.damped(score - curvature.times(put), curvature, loose, damping)
        return step

    def counted(self, gain: float, score: Float, curvature: Arrow, free: Mask) -> float:
        """Return what moving the shared parameters promises, and a hundredth of all that is promised.

        Noise levels of single members creep for long while what is shared stays where it is.
        """
        arrow, right = curvature.masked(free), np.where(free, score, 0.0)
        complement, carried = arrow.eliminated()
        members, n, width = arrow.coupling.shape
        efficient = right[:n] - np.sum(np.einsum("mij,mj->mi", carried, right[n:].reshape(members, width)), axis=0)
        return max(float(0.5 * efficient @ inverse(complement) @ efficient), _OF_ALL * gain)

    def corrected(self, curvature: Arrow, before: Arrow, here: Arrow, step: Float, fall: Float, free: Mask) -> Arrow:
        """Return the information here with every member's block corrected by what the step showed of that member.

        A log-likelihood that is a sum, each term of few parameters, shows with one step as much curvature as it has
        terms (Griewank & Toint 1982). Where a term is not concave, as that of a level near nothing, the block is
        kept positive definite (Powell 1978).
        """
        members, n, _ = here.coupling.shape
        s = _by_member(np.where(free, step, 0.0), members, n)
        y = (before.scores - here.scores) * _by_member(np.where(free, 1.0, 0.0), members, n)
        B = here.blocks()
        Bs = np.einsum("mij,mj->mi", B, s)
        sBs, sy = np.sum(s * Bs, axis=1), np.sum(s * y, axis=1)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            share = np.where(sy < _CONVEX * sBs, (1.0 - _CONVEX) * sBs / (sBs - sy), 1.0)[:, None]
            y = share * y + (1.0 - share) * Bs
            taken = Bs[:, :, None] * (Bs / sBs[:, None])[:, None, :]
            B_new = B - taken + y[:, :, None] * (y / np.sum(s * y, axis=1)[:, None])[:, None, :]
        sound = (sBs > 0.0) & np.all(np.isfinite(B_new), axis=(1, 2))
        B = np.where(sound[:, None, None], B_new, B)
        return Arrow(B[:, :n, :n], B[:, :n, n:], B[:, n:, n:], here.scores)


def _by_member(vector: Float, members: int, n_shared: int) -> Float:
    """Return what of a vector every member has, shape (n_members, n_shared + n_own)."""
    shared = np.broadcast_to(vector[:n_shared], (members, n_shared))
    return np.concatenate([shared, vector[n_shared:].reshape(members, -1)], axis=1)


def inverse(matrix: Float) -> Float:
    """Invert symmetric matrices, shape (..., n, n), scaled to a unit diagonal; undetermined directions give nothing."""
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    # what has no information at all is left out by a scale of nothing
    scale = np.where(diagonal > 0.0, 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0)), 0.0)
    both = scale[..., :, None] * scale[..., None, :]
    inverse: Float = np.linalg.pinv(matrix * both, rcond=_NOTHING, hermitian=True) * both
    return inverse
