"""What stands between quotation marks in delimited text.

As in RFC 4180, a mark opens a quotation only at the beginning of a cell, but for blanks, and two marks within one
are a mark that is text. Anywhere else a mark is text too, such as that of inches.
"""

from __future__ import annotations

import re

import numpy as np

from kempf.pipeline.ingest.decoded import Flag
from kempf.pipeline.ingest.spans import Bytes, Index, Spans, is_blank

_QUOTE, _FEED = 34, 10


def has_open_mark(line: str, separator: str) -> bool:
    """Return whether a line has a quotation that is never closed.

    Parameters
    ----------
    separator : str
        One character.

    Examples
    --------
    >>> has_open_mark('0,90,"open', ","), has_open_mark('0,90,5"', ",")
    (True, False)
    """
    return any(not closed for _, _, closed in _quotations(line.encode(), separator))


def inside_quotes(buffer: Bytes, rows: Spans, separator: str) -> tuple[Flag, Flag]:
    """Return which bytes stand between quotation marks, and which rows close all of their quotations.

    Parameters
    ----------
    buffer : ndarray of uint8, shape (b,)
    rows : Spans
        Shape (n,), in this buffer.
    separator : str
        One character.

    Returns
    -------
    inside : ndarray of bool, shape (b,)
        Of use within the rows alone.
    closed : ndarray of bool, shape (n,)
    """
    quote = buffer == _QUOTE
    inside, closed = _by_parity(quote, rows)
    # the parity is right unless a row has an odd number of marks, or a mark that would open a quotation within a cell
    marks = np.flatnonzero(quote)
    opening = marks[inside[marks]]
    sign = ord(separator)
    before = buffer[opening - 1]
    doubtful = opening[(before != sign) & (before != _QUOTE) & (before != _FEED) & (opening > 0)]
    looked_at = ~closed
    if doubtful.size:
        within = doubtful[~_begins_cell(buffer, rows, doubtful, sign)]
        row = np.searchsorted(rows.start, within, side="right") - 1
        looked_at[row[(row >= 0) & (within < rows.stop[row])]] = True
    if not looked_at.any():
        return inside, closed
    # of these rows, most have marks within their cells alone
    odd = np.flatnonzero(looked_at)
    begins = marks[_begins_cell(buffer, rows, marks, sign)]
    has_one = np.searchsorted(begins, rows.stop[odd]) > np.searchsorted(begins, rows.start[odd])
    closed[odd] = True
    inside &= ~_within(rows.take(odd), buffer.size)
    for k in odd[has_one].tolist():
        start, stop = int(rows.start[k]), int(rows.stop[k])
        for first, last, ends in _quotations(buffer[start:stop].tobytes(), separator):
            inside[start + first : start + last] = True
            closed[k] &= ends
    return inside, closed


def _by_parity(quote: Flag, rows: Spans) -> tuple[Flag, Flag]:
    """Return which bytes stand behind an odd number of marks of their row, and which rows have an even number."""
    # whether the marks up to each byte are odd in number; a count of them would take eight times the memory
    odd = np.logical_xor.accumulate(quote)
    before = odd[rows.start - 1] & (rows.start > 0)
    turn = np.zeros(quote.size, dtype=np.bool_)
    if before.size:
        turn[rows.start] = before ^ np.append([False], before[:-1])
    return odd ^ np.logical_xor.accumulate(turn), (odd[rows.stop - 1] & (rows.stop > 0)) == before


def _begins_cell(buffer: Bytes, rows: Spans, marks: Index, sign: int) -> Flag:
    """Return which marks are the first of their cell, but for blanks."""
    solid = np.flatnonzero(~is_blank(buffer) | (buffer == sign))
    at = np.searchsorted(solid, marks) - 1
    before = np.where(at >= 0, solid[at], -1)
    row = np.searchsorted(rows.start, marks, side="right") - 1
    begins: Flag = (before < rows.start[row]) | (buffer[before] == sign)
    return begins


def _within(rows: Spans, size: int) -> Flag:
    """Return which bytes of a buffer are of the rows."""
    step = np.zeros(size + 1, dtype=np.int8)
    step[rows.start] += 1
    step[rows.stop] -= 1
    within: Flag = np.cumsum(step[:size], dtype=np.int8) > 0
    return within


def _quotations(row: bytes, separator: str) -> list[tuple[int, int, bool]]:
    """Return where each quotation of a row begins and ends, and whether it is closed."""
    sign = re.escape(separator.encode())
    blanks = b"".join(b"\\x%02x" % byte for byte in b" \t\r\v\f" if byte != ord(separator))
    quotation = rb'("[^"]*+(?:""[^"]*+)*+)("?)'
    found = re.finditer(rb"(?:^|%s)[%s]*+%s" % (sign, blanks, quotation), row)
    return [(match.start(1), match.end(1), bool(match[2])) for match in found]
