"""Records of one instrument that come together: which each is, of how many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.spans import Index


@dataclass(frozen=True, eq=False)
class Shares:
    """Records in the order of their source, those of one source in the order of what they come with."""

    #: Shape (n,). Their numbers in that order.
    order: Index
    #: heads, count: Shape (m,). Where those that come together begin in it, and how many they are.
    heads: Index
    count: Index

    @property
    def shared(self) -> Index:
        """How many come together with each, itself among them, in that order, shape (n,)."""
        return np.repeat(self.count, self.count)

    @property
    def place(self) -> Index:
        """How many of them come before each, in that order, shape (n,)."""
        place: Index = np.arange(self.order.size) - np.repeat(self.heads, self.count)
        return place


def shares_of(source: Index, group: Index) -> Shares:
    """Return which records come together.

    Parameters
    ----------
    source, group : ndarray of int64, shape (n,)
        Instrument of each record, and the number of the fix, the second or the burst that it comes with.

    Examples
    --------
    >>> shares = shares_of(np.array([7, 3, 7, 7]), np.array([0, 0, 0, 1]))
    >>> shares.order.tolist(), shares.shared.tolist(), shares.place.tolist()
    ([1, 0, 2, 3], [1, 2, 2, 1], [0, 0, 1, 0])
    """
    order = np.lexsort((group, source))
    opens = (np.diff(source[order]) != 0) | (np.diff(group[order]) != 0)
    heads = np.flatnonzero(np.concatenate((np.ones(min(1, source.size), dtype=np.bool_), opens)))
    return Shares(order, heads, np.diff(heads, append=source.size))
