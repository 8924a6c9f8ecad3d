"""TAG blocks in front of NMEA sentences: where they end, the time of arrival in them; the checksum of both.

The other parameters of a TAG block (source, destination, group, line count, text) carry no
reading and are stepped over.

References
----------
NMEA 0183 version 4.10, section 7; IEC 61162-450:2018, 7.2.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.decoded import Flag, Nanoseconds
from kempf.pipeline.ingest.spans import Bytes, Index, Spans, first_within
from kempf.pipeline.ingest.text.cells import Cells
from kempf.schemas.units import SECOND_NS

BACKSLASH = 92
_COLON, _C, _COMMA, _STAR = 58, 99, 44, 42

#: Seconds since 1970 that are later than this are milliseconds.
_SECONDS_END = 100_000_000_000


_HEX = np.full(256, -1, dtype=np.int16)
_HEX[48:58], _HEX[65:71], _HEX[97:103] = np.arange(10), np.arange(10, 16), np.arange(10, 16)


@dataclass(frozen=True, eq=False)
class Tags:
    """What stands between the backslashes in front of a sentence, line by line."""

    #: start, behind: Shape (n,). Place of the first backslash (of the line's end where there is no block), and where
    #: the sentence may begin.
    start: Index
    behind: Index
    #: Shape (n,). Time of arrival, zero where it gives none.
    time_utc_ns: Nanoseconds
    #: Shape (n,). Whether it gives one, under the right checksum.
    timed: Flag
    #: Shape (n,). Whether there is a block without its own checksum, or without its end.
    broken: Flag


def checksum_right(buffer: Bytes, prefix: Bytes, first: Index, star: Index) -> Flag:
    """Return which stretches are followed by their own checksum.

    The exclusive or of a stretch is that of the prefixes at its two ends, so one pass over the buffer serves
    every line.

    Parameters
    ----------
    prefix : ndarray of uint8
        Exclusive or of the bytes up to each place.
    first, star : ndarray of int64, shape (n,)
        Places of the byte before the stretch and of the ``*`` behind it.

    Returns
    -------
    ndarray of bool, shape (n,)

    References
    ----------
    IEC 61162-1:2016, 7.2.3.7.
    """
    if buffer.size == 0:
        return np.zeros(first.shape, dtype=np.bool_)
    last = buffer.size - 1
    own = prefix[np.maximum(star - 1, 0)] ^ prefix[first]
    high, low = _HEX[buffer[np.minimum(star + 1, last)]], _HEX[buffer[np.minimum(star + 2, last)]]
    right: Flag = (star > first) & (high >= 0) & (low >= 0) & (own == high * 16 + low)
    return right


def tags_of(buffer: Bytes, prefix: Bytes, openings: Index, strokes: Index, lines: Spans) -> Tags:
    """Find the TAG blocks of some lines.

    Parameters
    ----------
    buffer, prefix : ndarray of uint8
        See `checksum_right`.
    openings, strokes : ndarray of int64
        Places of ``$`` or ``!``, and of backslashes, ascending.
    """
    n = len(lines)
    if strokes.size == 0:
        none = np.zeros(n, dtype=np.bool_)
        return Tags(lines.stop, lines.start, np.zeros(n, dtype=np.int64), none, none.copy())
    opening = first_within(strokes, lines.start, lines.stop)
    sentence = first_within(openings, lines.start, lines.stop)
    tagged = (opening >= 0) & ((sentence < 0) | (opening < sentence))
    closing = first_within(strokes, np.where(tagged, opening + 1, lines.stop), lines.stop)
    open_ended = tagged & (closing < 0)  # one of its backslashes is lost: where it ended only the sentence shows
    at = np.flatnonzero(tagged & ~open_ended)
    start, behind, broken = np.where(open_ended, opening, lines.stop), lines.start.copy(), open_ended
    opening, closing = opening[at], closing[at]
    star = closing - 3
    right = (star > opening) & (buffer[star] == _STAR) & checksum_right(buffer, prefix, opening, star)
    start[at], behind[at] = opening, closing + 1
    broken[at] = ~right
    time, timed = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.bool_)
    time[at[right]], timed[at[right]] = _times(buffer, opening[right], star[right])
    return Tags(start, behind, time, timed, broken)


def _times(buffer: Bytes, opening: Index, star: Index) -> tuple[Nanoseconds, Flag]:
    """Read the parameter c: seconds since 1970, which many loggers write in milliseconds."""
    colon = np.flatnonzero(buffer == _COLON)
    colon = colon[colon >= 2]
    front = buffer[colon - 2]
    colon = colon[(buffer[colon - 1] == _C) & ((front == BACKSLASH) | (front == _COMMA))]
    ends = np.flatnonzero((buffer == _COMMA) | (buffer == _STAR))
    place = first_within(colon, opening, star)
    stop = first_within(ends, np.where(place >= 0, place, star), star + 1)
    timed = (place >= 0) & (stop >= 0)
    value, whole = Cells(buffer, np.where(timed, place + 1, 0), np.where(timed, stop, 0)).integer()
    timed &= whole & (value < 1000 * _SECONDS_END)
    milliseconds = np.where(value > _SECONDS_END, value, value * 1000)
    return np.where(timed, milliseconds * (SECOND_NS // 1000), 0), timed
