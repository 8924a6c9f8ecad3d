"""The compiled walk over MCAP records: one opcode, one length, the content, again and again.

Kept apart because importing numba takes half a second that only MCAP logs should pay.

References
----------
MCAP specification, https://mcap.dev/spec, "Records".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.compiled import njit
from kempf.pipeline.ingest.spans import Bytes, Index

#: Bytes of opcode and length in front of the content.
HEAD = 9


@njit(cache=True)
def _count_compiled(buffer, start, stop):
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


@njit(cache=True)
def _fill_compiled(buffer, at, opcode, first, end):
    for i in range(opcode.size):
        length = np.uint64(0)
        for k in range(8):
            length |= np.uint64(buffer[at + 1 + k]) << np.uint64(8 * k)
        opcode[i] = buffer[at]
        first[i] = at + 9
        at += 9 + np.int64(length)
        end[i] = at


@njit(cache=True)
def _heads_compiled(buffer, first, end, channel, log_time, publish_time):
    latest = np.uint64(0x7FFFFFFFFFFFFFFF)
    for i in range(first.size):
        at = first[i]
        if end[i] - at < 22:
            channel[i] = -1
            continue
        channel[i] = np.int64(buffer[at]) | np.int64(buffer[at + 1]) << 8
        log, publish = np.uint64(0), np.uint64(0)
        for k in range(8):
            log |= np.uint64(buffer[at + 6 + k]) << np.uint64(8 * k)
            publish |= np.uint64(buffer[at + 14 + k]) << np.uint64(8 * k)
        log_time[i], publish_time[i] = np.int64(min(log, latest)), np.int64(min(publish, latest))
        first[i] = at + 22


@njit(cache=True)
def _chunk_after_compiled(buffer, start, stop, file_left):
    for at in range(start, stop - 57):
        if buffer[at] != 6:
            continue
        length = _whole_number(buffer, at + 1, 8)
        if length > np.uint64(file_left - (at - start) - 9):
            continue
        name = _whole_number(buffer, at + 37, 4)
        packed = np.uint64(0)
        if name == 4:
            if not (
                buffer[at + 41] == 122 and buffer[at + 42] == 115 and buffer[at + 43] == 116 and buffer[at + 44] == 100
            ):
                continue
            packed = _whole_number(buffer, at + 45, 8)
        elif name == 3:
            if not (buffer[at + 41] == 108 and buffer[at + 42] == 122 and buffer[at + 43] == 52):
                continue
            packed = _whole_number(buffer, at + 44, 8)
        elif name == 0:
            packed = _whole_number(buffer, at + 41, 8)
            if packed != _whole_number(buffer, at + 25, 8):
                continue
        else:
            continue
        if packed <= length and np.uint64(40) + name + packed == length:
            return at
    return -1


@njit(cache=True)
def _whole_number(buffer, at, width):
    value = np.uint64(0)
    for k in range(width):
        value |= np.uint64(buffer[at + k]) << np.uint64(8 * k)
    return value


def walk(buffer: Bytes, start: int, stop: int) -> tuple[NDArray[np.uint8], Index, Index, int]:
    """Find the records between two places.

    Parameters
    ----------
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


def chunk_after(buffer: Bytes, left: int) -> int:
    """Find the first place at which a chunk may begin: opcode, compression and the three lengths fit each other.

    Parameters
    ----------
    left : int
        Bytes of the file from the beginning of the buffer on.

    Returns
    -------
    int
        -1 where there is none whose head is whole in the buffer.
    """
    return int(_chunk_after_compiled(buffer, np.int64(0), np.int64(buffer.size), np.int64(left)))


def heads(buffer: Bytes, first: Index, end: Index) -> tuple[Index, Index, Index, Index]:
    """Read the heads of messages.

    Parameters
    ----------
    first, end : ndarray of int64, shape (m,)
        Contents of the message records.

    Returns
    -------
    payload : ndarray of int64, shape (m,)
        Where the payloads begin.
    channel : ndarray of int64, shape (m,)
        -1 where a message is too short for a head.
    log_time, publish_time : ndarray of int64, shape (m,)
        Nanoseconds; what 63 bits do not hold is the last instant that they do.
    """
    payload, channel = first.copy(), np.empty(first.size, dtype=np.int64)
    log_time, publish_time = np.zeros(first.size, dtype=np.int64), np.zeros(first.size, dtype=np.int64)
    _heads_compiled(buffer, payload, end, channel, log_time, publish_time)
    return payload, channel, log_time, publish_time
