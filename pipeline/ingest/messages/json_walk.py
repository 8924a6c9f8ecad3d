"""The compiled walk through JSON messages: their grammar is checked whole, the wanted numbers are read on the way.

What is rare is not decided here: a message with text outside ASCII in it, an escape in a wanted place, a key that comes
twice, or an error of any kind is called odd and left to Python's own reader; a number of more than 18 digits or of an
extreme power of ten is left to the caller. All others are rounded correctly.

References
----------
RFC 8259. W. D. Clinger (1990), How to read floating point numbers accurately, PLDI: a decimal of at most 53 bits times
a power of ten up to 22 is correctly rounded by one multiplication or division.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import njit

#: What was found of a field: nothing, something that is no number, a number, text that may be one.
ABSENT, OTHER, NUMBER, TEXT = range(4)

#: Columns of the tree of wanted keys.
FIRST, BEHIND, KEY, KEY_END, SLOT, SEEN = range(6)

#: Deepest nesting that is walked.
_DEEPEST = 64
_EXACT = np.array([10.0**k for k in range(23)])
#: Powers of ten that a whole number holds, and by how many bits each may be shifted without passing 62.
_DIVISOR = np.array([10**k for k in range(19)], dtype=np.uint64)
_SHIFT = np.array([62 - (10**k).bit_length() for k in range(19)])


@njit(cache=True)
def _blank_until(buffer, at, end):
    while at < end and (buffer[at] == 32 or buffer[at] == 10 or buffer[at] == 13 or buffer[at] == 9):
        at += 1
    return at


@njit(cache=True)
def _quotient(mantissa, exponent):
    """Return mantissa (up to 60 bits) times ten to the exponent (-18 to -1) as the nearest double.

    The quotient of the two whole numbers is made bit by bit until 55 of them and a last one that stands for all behind
    it tell how to round.
    """
    divisor, step = _DIVISOR[-exponent], _SHIFT[-exponent]
    quotient, rest = mantissa // divisor, mantissa % divisor
    shifted = 0
    while quotient < np.uint64(1 << 54):
        while quotient >> np.uint64(63 - step) > np.uint64(0):
            step -= 1
        rest <<= np.uint64(step)
        quotient = (quotient << np.uint64(step)) | (rest // divisor)
        rest %= divisor
        shifted += step
    if rest > 0:
        quotient |= np.uint64(1)
    value = np.float64(quotient)
    while shifted > 0:
        take = min(shifted, 60)
        value /= np.float64(np.uint64(1) << np.uint64(take))
        shifted -= take
    return value


@njit(cache=True)
def _string_end(buffer, at, end):
    """Return the place of the closing quote and whether there was an escape; -1 where the string is odd."""
    escaped = False
    while at < end:
        byte = buffer[at]
        if byte == 34:
            return at, escaped
        if byte < 32 or byte > 126:
            return -1, escaped
        if byte == 92:
            escaped = True
            at += 1
            if at >= end:
                return -1, escaped
            byte = buffer[at]
            if byte == 117:
                if at + 4 >= end:
                    return -1, escaped
                for k in range(1, 5):
                    digit = buffer[at + k] | 32
                    if not (48 <= buffer[at + k] <= 57 or 97 <= digit <= 102):
                        return -1, escaped
                at += 4
            elif not (
                byte == 34
                or byte == 92
                or byte == 47
                or byte == 98
                or byte == 102
                or byte == 110
                or byte == 114
                or byte == 116
            ):
                return -1, escaped
        at += 1
    return -1, escaped


@njit(cache=True)
def _number(buffer, at, end, wanted):
    """Return where a number ends (-1: it is none), its value where it is wanted, and whether that is exact."""
    negative = buffer[at] == 45
    if negative:
        at += 1
    digits, exponent, mantissa = 0, 0, np.uint64(0)
    first = at
    while at < end and 48 <= buffer[at] <= 57:
        if digits < 19:
            mantissa = mantissa * np.uint64(10) + np.uint64(buffer[at] - 48)
        if mantissa > 0:
            digits += 1
        at += 1
    if at == first or (buffer[first] == 48 and at > first + 1):
        return -1, 0.0, False
    if at < end and buffer[at] == 46:
        at += 1
        first = at
        while at < end and 48 <= buffer[at] <= 57:
            if digits < 19:
                mantissa = mantissa * np.uint64(10) + np.uint64(buffer[at] - 48)
            if mantissa > 0:
                digits += 1
            exponent -= 1
            at += 1
        if at == first:
            return -1, 0.0, False
    if at < end and (buffer[at] | 32) == 101:
        at += 1
        down = at < end and buffer[at] == 45
        if at < end and (buffer[at] == 45 or buffer[at] == 43):
            at += 1
        first, power = at, np.int64(0)
        while at < end and 48 <= buffer[at] <= 57:
            power = min(power * 10 + np.int64(buffer[at]) - 48, 100_000)
            at += 1
        if at == first:
            return -1, 0.0, False
        exponent += -power if down else power
    exact = wanted and digits <= 18 and -22 <= exponent <= 22
    value = 0.0
    if exact and mantissa <= np.uint64(1 << 53):
        value = np.float64(mantissa)
        value = value * _EXACT[exponent] if exponent >= 0 else value / _EXACT[-exponent]
    elif exact and -18 <= exponent < 0:
        value = _quotient(mantissa, exponent)
    else:
        exact = False
    return at, -value if negative else value, exact


@njit(cache=True)
def _literal(buffer, at, end):
    """Return the length of true, false or null, 0 for anything else."""
    if end - at >= 4:
        a, b, c, d = buffer[at], buffer[at + 1], buffer[at + 2], buffer[at + 3]
        if a == 116 and b == 114 and c == 117 and d == 101:
            return 4
        if a == 110 and b == 117 and c == 108 and d == 108:
            return 4
        if a == 102 and b == 97 and c == 108 and d == 115 and end - at >= 5 and buffer[at + 4] == 101:
            return 5
    return 0


@njit(cache=True, inline="always")
def _child(buffer, at, end, node, nodes, keys):
    """Return the node below ``node`` whose key stands in the buffer, -1 for none."""
    if node < 0:
        return -1
    for child in range(nodes[node, FIRST], nodes[node, BEHIND]):
        if nodes[child, KEY_END] - nodes[child, KEY] == end - at:
            same = True
            for k in range(end - at):
                if keys[nodes[child, KEY] + k] != buffer[at + k]:
                    same = False
                    break
            if same:
                return child
    return -1


@njit(cache=True, inline="always")
def _scalar(buffer, at, end, row, slot, tokens, value):
    """Read text, a number or a literal; return the place behind it, -1 where it is odd."""
    byte = buffer[at]
    if byte == 34:
        close, escaped = _string_end(buffer, at + 1, end)
        if close < 0 or (escaped and slot >= 0):
            return -1
        if slot >= 0:
            tokens[row, slot, 0], tokens[row, slot, 1], tokens[row, slot, 2] = TEXT, at + 1, close
        return close + 1
    if byte == 45 or 48 <= byte <= 57:
        close, number, exact = _number(buffer, at, end, slot >= 0)
        if close >= 0 and slot >= 0:
            value[row, slot] = number
            tokens[row, slot, 0], tokens[row, slot, 1], tokens[row, slot, 2] = NUMBER if exact else TEXT, at, close
        return close
    length = _literal(buffer, at, end)
    if slot >= 0 and byte != 110:
        tokens[row, slot, 0] = OTHER
    return at + length if length > 0 else -1


@njit(cache=True, inline="always")
def _key(buffer, at, end, parent, nodes, keys):
    """Read a key and its colon; return the place of the value (-1: odd) and the node that it names (-1: none)."""
    if buffer[at] != 34:
        return -1, -1
    close, escaped = _string_end(buffer, at + 1, end)
    if close < 0 or escaped:
        return -1, -1
    node = _child(buffer, at + 1, close, parent, nodes, keys)
    at = _blank_until(buffer, close + 1, end)
    if at >= end or buffer[at] != 58:
        return -1, -1
    at = _blank_until(buffer, at + 1, end)
    return at if at < end else -1, node


@njit(cache=True)
def _walk_message(buffer, at, end, nodes, keys, inside, row, tokens, value):
    """Walk through one message; return whether it is a whole object without anything odd.

    What is open around a value stands in ``inside``: the node of an object, -1 of one nobody wants, -2 of a list.
    """
    depth, node = 0, 0
    at = _blank_until(buffer, at, end)
    if at >= end or buffer[at] != 123:
        return False
    while True:
        # a value is expected here, of the node or of nobody (-1)
        slot = nodes[node, SLOT] if node >= 0 else -1
        byte, opened = buffer[at], False
        if byte == 123 or byte == 91:
            if depth >= _DEEPEST:
                return False
            inside[depth] = node if byte == 123 else -2
            depth += 1
            if slot >= 0:
                tokens[row, slot, 0] = OTHER
            at = _blank_until(buffer, at + 1, end)
            opened = at < end and buffer[at] != (125 if byte == 123 else 93)
        else:
            at = _scalar(buffer, at, end, row, slot, tokens, value)
            if at < 0:
                return False
        if not opened:
            # behind a value: close what ends here, then a comma
            at = _blank_until(buffer, at, end)
            while depth > 0 and at < end and buffer[at] == (93 if inside[depth - 1] == -2 else 125):
                depth -= 1
                at = _blank_until(buffer, at + 1, end)
            if depth == 0:
                return at == end
            if at >= end or buffer[at] != 44:
                return False
            at = _blank_until(buffer, at + 1, end)
        if at >= end:
            return False
        node = -1
        if inside[depth - 1] != -2:
            at, node = _key(buffer, at, end, inside[depth - 1], nodes, keys)
            if at < 0:
                return False
            if node >= 0:
                if nodes[node, SEEN] == row:
                    return False
                nodes[node, SEEN] = row


@njit(cache=True)
def walk(buffer, start, stop, nodes, keys, tokens, value, good):
    """Walk through all messages and fill what was found, by message and slot.

    Parameters
    ----------
    nodes : ndarray of int64, shape (n, 6)
        The tree of wanted keys, its columns numbered `FIRST` to `SEEN`: children, place of the key's bytes, slot or -1,
        and the last message that had the key, -1 at first. Node 0 is the message itself.
    tokens : ndarray of int64, shape (m, k, 3)
        `ABSENT` at first; what was found, and its first byte and the one behind its last, of numbers and text.
    value : ndarray of float64, shape (m, k)
    good : ndarray of bool, shape (m,)
    """
    inside = np.empty(_DEEPEST, dtype=np.int64)
    for i in range(start.size):
        good[i] = _walk_message(buffer, start[i], stop[i], nodes, keys, inside, i, tokens, value)
