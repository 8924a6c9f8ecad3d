"""The compiled walk over MCAP records: one opcode, one length, the content, again and again.

Kept apart because importing numba takes half a second that only MCAP logs should pay.

References
----------
MCAP specification, https://mcap.dev/spec, "Records".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.compiled import njit
from pipeline.ingest.spans import Bytes, Index

#: Bytes of opcode and length in front of the content.
HEAD = 9


def _count(buffer, start, stop):  # type: ignore[no-untyped-def]
    at, n = start, 0
    while at + 9 <= stop:
        length = np.uint64(0)
        for k in range(8):
            length |= np.uint64(buffer[at + 1 + k]) << np.uint64(8 * k)
        if length > np.uint64(stop - at - 9):
            break
        at += 9 + np.int64(length)
        n += 1
    return n, at


def _fill(buffer, at, opcode, first, end):  # type: ignore[no-untyped-def]
    for i in range(opcode.size):
        length = np.uint64(0)
        for k in range(8):
            length |= np.uint64(buffer[at + 1 + k]) << np.uint64(8 * k)
        opcode[i] = buffer[at]
        first[i] = at + 9
        at += 9 + np.int64(length)
        end[i] = at


_count_compiled = njit(cache=True)(_count)
_fill_compiled = njit(cache=True)(_fill)


def walk(buffer: Bytes, start: int, stop: int) -> tuple[NDArray[np.uint8], Index, Index, int]:
    """Find the records between two places.

    Parameters
    ----------
    buffer : ndarray of uint8
    start, stop : int
        The first record's opcode, and the end of the stretch.

    Returns
    -------
    opcode : ndarray of uint8, shape (n,)
    first, end : ndarray of int64, shape (n,)
        Content of each record.
    reached : int
        Where the walk ended; before ``stop`` where the last record is cut or its length is damaged.
    """
    n, reached = _count_compiled(buffer, np.int64(start), np.int64(stop))
    opcode = np.empty(n, dtype=np.uint8)
    first, end = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    _fill_compiled(buffer, np.int64(start), opcode, first, end)
    return opcode, first, end, int(reached)
