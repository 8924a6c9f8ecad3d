"""The compiled loop that runs a walk over many CDR messages: any layout, no two of them alike, no Python in between.

No read goes beyond the end of a message, whatever its lengths claim.

References
----------
OMG, DDS-XTypes 1.3 (formal/2020-02-04), 7.4.1 and 7.6.2.1.2 (encapsulation).
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import njit

#: Instructions, each with up to four numbers.
SKIP, READ, STRING, SEQUENCE, PICK, LOOP, END = range(7)

#: Deepest nesting of messages.
DEEPEST = 16
#: Bytes of the encapsulation in front of a message.
_ENCAPSULATION = 4
#: A message may be longer than its definition by what rounds it up to a multiple of eight.
_PADDING = 7
#: Nested loops at most: each level of messages can hold one.
_LEVELS = DEEPEST + 4


@njit(cache=True)
def _bits(buffer, at, size, little):
    value = np.uint64(0)
    if little:
        for k in range(size):
            value |= np.uint64(buffer[at + k]) << np.uint64(8 * k)
    else:
        for k in range(size):
            value = (value << np.uint64(8)) | np.uint64(buffer[at + k])
    return value


@njit(cache=True)
def _counted(buffer, begin, at, end, little, steps, step, i, out, present):
    """Step over text or a sequence of numbers, or read one element of it; return the place behind it, -1 for a cut."""
    place = at + ((begin - at) & 3)
    if place + 4 > end:
        return -1
    count, size = np.int64(_bits(buffer, place, 4, little)), np.int64(1)
    place += 4
    if steps[step, 0] != STRING and count > 0:
        size = steps[step, 2]
        place += (begin - place) & (steps[step, 1] - 1)
    if count * size > end - place:
        return -1
    if steps[step, 0] != PICK:
        return place + count * size
    if steps[step, 4] < count:
        out[i, steps[step, 3]] = _bits(buffer, place + steps[step, 4] * size, size, little)
        present[i, steps[step, 3]] = True
    return at


@njit(cache=True)
def _walk_message(buffer, begin, end, little, steps, left, back, i, out, present):
    """Run the walk over one message; return the place behind its last step, -1 where the message is cut."""
    at, step, level = begin, 0, -1
    while step < steps.shape[0]:
        kind = steps[step, 0]
        if kind == SKIP or kind == READ:
            at += (begin - at) & (steps[step, 1] - 1)
            size = steps[step, 2]
            if size > end - at:
                return -1
            if kind == READ:
                out[i, steps[step, 3]] = _bits(buffer, at, size, little)
                present[i, steps[step, 3]] = True
            at += size
        elif kind == LOOP:
            count = steps[step, 1]
            if count < 0:
                at += (begin - at) & 3
                if at + 4 > end:
                    return -1
                count = np.int64(_bits(buffer, at, 4, little))
                at += 4
            # every element takes a byte at least
            if count > end - at or level + 1 >= left.size:
                return -1
            if count == 0:
                step = steps[step, 2]
                continue
            level += 1
            left[level], back[level] = count, step + 1
        elif kind == END:
            left[level] -= 1
            if left[level] > 0:
                step = back[level]
                continue
            level -= 1
        else:
            at = _counted(buffer, begin, at, end, little, steps, step, i, out, present)
            if at < 0:
                return -1
        step += 1
    return at


@njit(cache=True)
def walk(buffer, start, stop, steps, closed, out, present, good):
    """Walk through all messages and fill the bits of what was read, by message and slot."""
    left = np.zeros(_LEVELS, dtype=np.int64)
    back = np.zeros(_LEVELS, dtype=np.int64)
    for i in range(start.size):
        begin, end = start[i] + _ENCAPSULATION, stop[i]
        if begin > end or buffer[start[i]] != 0 or buffer[start[i] + 1] > 1:
            continue
        little = buffer[start[i] + 1] == 1
        at = _walk_message(buffer, begin, end, little, steps, left, back, i, out, present)
        good[i] = at >= 0 and (not closed or end - at <= _PADDING)
