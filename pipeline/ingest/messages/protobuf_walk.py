"""The compiled walk through protobuf messages: fields in any order, left out where they are zero, unknown ones skipped.

No read goes beyond the end of a message, whatever its lengths claim.

References
----------
Protocol Buffers, https://protobuf.dev/programming-guides/encoding.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import njit

#: Wire types of the encoding; 3 and 4, groups, are not written any more.
VARINT, WIDE, LENGTH, NARROW = 0, 1, 2, 5

#: Deepest nesting that a wanted field may have.
DEEPEST = 16


@njit(cache=True)
def _varint(buffer, at, end):
    value = np.uint64(0)
    for k in range(10):
        if at + k >= end:
            break
        byte = np.uint64(buffer[at + k])
        value |= (byte & np.uint64(0x7F)) << np.uint64(7 * k)
        if byte < 0x80:
            return value, at + k + 1
    return value, -1


@njit(cache=True)
def _walk_message(buffer, at, end, rows, row_of, ends, nodes, i, out, present, entered):
    """Walk through one message; return whether it is whole."""
    ends[0], nodes[0], level = end, 0, 0
    entered[i, 0] = True
    while True:
        while at == ends[level]:
            if level == 0:
                return True
            level -= 1
        tag, at = _varint(buffer, at, ends[level])
        if at < 0 or tag < 8:
            return False
        number, wire = np.int64(tag >> np.uint64(3)), np.int64(tag & np.uint64(7))
        value, size = np.uint64(0), np.int64(0)
        if wire == VARINT:
            value, at = _varint(buffer, at, ends[level])
            if at < 0:
                return False
        elif wire == LENGTH:
            value, at = _varint(buffer, at, ends[level])
            if at < 0 or value > np.uint64(ends[level] - at):
                return False
            size = np.int64(value)
        elif wire == WIDE or wire == NARROW:
            size = np.int64(8 if wire == WIDE else 4)
            if size > ends[level] - at:
                return False
            for k in range(size):
                value |= np.uint64(buffer[at + k]) << np.uint64(8 * k)
        else:
            return False
        node, entered_child = nodes[level], False
        for row in range(row_of[node], row_of[node + 1]):
            if rows[row, 0] == number and rows[row, 1] == wire:
                if rows[row, 2] >= 0:
                    out[i, rows[row, 2]] = value
                    present[i, rows[row, 2]] = True
                else:
                    level += 1
                    ends[level], nodes[level] = at + size, rows[row, 3]
                    entered[i, rows[row, 3]] = True
                    entered_child = True
                break
        if not entered_child:
            at += size


@njit(cache=True)
def walk(buffer, start, stop, rows, row_of, out, present, entered, good):
    """Walk through all messages and fill what was read, by message and slot, and which messages were entered."""
    ends = np.empty(DEEPEST + 1, dtype=np.int64)
    nodes = np.empty(DEEPEST + 1, dtype=np.int64)
    for i in range(start.size):
        good[i] = _walk_message(buffer, start[i], stop[i], rows, row_of, ends, nodes, i, out, present, entered)
