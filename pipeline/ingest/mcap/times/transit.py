"""How long messages take from where they are stamped to the recorder: the least of it, followed through drift."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import Nanoseconds
from kempf.schemas.units import SECOND_NS

#: The least is taken over so long, ns, and over so many messages at the fewest.
_OVER_NS, _FEWEST = 20 * SECOND_NS, 10
#: Stamps of such a stretch that may be too far ahead.
_WRONG = 2
#: The earliest that a message may come, ns: clocks of two computers that are set agree so well.
EARLY_NS = -SECOND_NS // 50
#: Clocks that part by less than this, ns, from one stretch to another go alike.
_ALIKE_NS = SECOND_NS // 20


def least_transit(log_ns: Nanoseconds, stamp_ns: Nanoseconds) -> Nanoseconds:
    """Return by how much log time is ahead of the stamps of the messages that waited least.

    What comes late has waited; what comes early cannot. So the least of the differences, over some seconds, is the
    difference of the two clocks and the shortest way.

    Parameters
    ----------
    log_ns, stamp_ns : ndarray of int64, shape (n,)
        Of messages that have both, in the order of the file, n > 0.

    Returns
    -------
    ndarray of int64, shape (n,)
        One number for all where the clocks go alike, else followed.

    References
    ----------
    F. Cristian (1989), Probabilistic clock synchronization, Distributed Computing 3.
    """
    lead = log_ns - stamp_ns
    lasting = max(int(np.ptp(log_ns)), 1)
    blocks = max(1, min(lasting // _OVER_NS, lead.size // _FEWEST))
    edges = np.linspace(0, lead.size, blocks + 1).astype(np.int64)
    first = edges[:-1]
    # not the very least: a single stamp may be wrong
    own = (lead[begin:end] for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    least = np.array([np.partition(one, min(_WRONG, one.size - 1))[min(_WRONG, one.size - 1)] for one in own])
    if blocks == 1 or np.ptp(least) < _ALIKE_NS:
        return np.full(lead.size, np.sort(least)[least.size // 2])
    middle = first + np.diff(np.append(first, lead.size)) / 2
    followed: Nanoseconds = least[0] + np.rint(np.interp(np.arange(lead.size), middle, least - least[0])).astype(
        np.int64
    )
    return followed
