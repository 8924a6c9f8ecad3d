"""From the bytes of an NMEA log to its sentences: stamp, address, checksum, by columns over the whole buffer.

What a sentence says is read in `nmea_fields`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.ingest import iso_time
from pipeline.ingest.decoded import CODE, NO_TIME, Code, Nanoseconds
from pipeline.ingest.readings import Reason
from pipeline.ingest.spans import Bytes, Index, Spans, is_blank, lines_of, trimmed

_FEED, _DOLLAR, _BANG, _STAR, _COMMA, _BACKSLASH = 10, 36, 33, 42, 44, 92

#: Bytes that are worked on at a time.
_BLOCK = 1 << 20

#: Characters of an address as they are kept: capitals and digits, and ``?`` for any other.
_PRINTED = np.full(256, ord("?"), dtype=np.int64)
_PRINTED[48:58], _PRINTED[65:91] = np.arange(48, 58), np.arange(65, 91)

#: Characters of an address that are kept; longer ones are proprietary.
_ADDRESS = 7

#: Share of lines with a readable stamp from which a log counts as stamped.
_STAMPED = 0.5


@dataclass(frozen=True, eq=False)
class Frames:
    """The lines of a log, each with the sentence in it.

    Attributes
    ----------
    lines : Spans
        Every line that is not blank, shape (n,).
    body : Spans
        What stands between ``$`` or ``!`` and ``*``; empty where there is no sentence, shape (n,).
    commas : ndarray, shape (n,)
        Number of fields behind the address.
    address : ndarray of int64, shape (n,)
        Index into ``names``; -1 where there is none.
    names : tuple of str
        Addresses that occur, such as GPRMC.
    reason : ndarray of int8, shape (n,)
        Code of the refusal, 0 for a whole sentence.
    stamp_ns : ndarray of int64, shape (n,)
        Time of arrival; `NO_TIME` where the log has none.
    stamped : bool
        Whether the log's lines bear stamps.
    zoned : bool
        Whether every stamp names its zone.
    """

    lines: Spans
    body: Spans
    commas: NDArray[np.int64]
    address: NDArray[np.int64]
    names: tuple[str, ...]
    reason: Code
    stamp_ns: Nanoseconds
    stamped: bool
    zoned: bool


def frames_of(buffer: Bytes) -> Frames:
    """Find the sentences of a log.

    Parameters
    ----------
    buffer : ndarray of uint8
        The whole file.

    Returns
    -------
    Frames
    """
    blocks = [_block(buffer[at:to], at) for at, to in _cuts(buffer)]
    start, stop, body_start, body_stop, fields, key, stamp = (
        np.concatenate(c) for c in zip(*(b[0] for b in blocks), strict=True)
    )
    has, summed, good, zoned = (np.concatenate(c) for c in zip(*(b[1] for b in blocks), strict=True))
    address, names = _named(key)
    stamped = bool(has.any()) and float(np.mean(good[has])) >= _STAMPED
    reason = np.zeros(start.size, dtype=np.int8)
    if stamped:
        reason[~good] = CODE[Reason.MALFORMED]
    reason[address < 0] = CODE[Reason.MALFORMED]
    reason[~summed] = CODE[Reason.CHECKSUM]
    reason[~has] = CODE[Reason.MALFORMED]
    stamp = np.where(good, stamp, NO_TIME) if stamped else np.full(start.size, NO_TIME)
    return Frames(
        lines=Spans(buffer, start, stop),
        body=Spans(buffer, body_start, body_stop),
        commas=fields,
        address=address,
        names=names,
        reason=reason,
        stamp_ns=stamp,
        stamped=stamped,
        zoned=bool(np.all(zoned[good])) if stamped else True,
    )


def _cuts(buffer: Bytes) -> list[tuple[int, int]]:
    """Cut the buffer behind line feeds into blocks that stay in the processor's cache while they are worked on."""
    cuts = [0]
    look = _BLOCK
    while cuts[-1] + look < buffer.size:
        feeds = np.flatnonzero(buffer[cuts[-1] + look - _BLOCK : cuts[-1] + look] == _FEED)
        if feeds.size:
            cuts.append(cuts[-1] + look - _BLOCK + int(feeds[-1]) + 1)
            look = _BLOCK
        else:
            look += _BLOCK
    return list(pairwise([*cuts, buffer.size]))


def _block(buffer: Bytes, at: int) -> tuple[tuple[Index, ...], tuple[NDArray[np.bool_], ...]]:
    """Find the sentences of one block that begins at place ``at`` of the file.

    Returns
    -------
    numbers : tuple of ndarray of int64, shape (m,)
        Start and stop of the line, start and stop of the body, number of fields, packed address, stamp.
    marks : tuple of ndarray of bool, shape (m,)
        Whether there is a sentence, whether its checksum is right, whether the stamp is readable and names a zone.
    """
    lines = trimmed(lines_of(buffer))
    lines = lines.take(lines.stop > lines.start)
    openings = np.flatnonzero((buffer == _DOLLAR) | (buffer == _BANG))
    strokes = np.flatnonzero(buffer == _BACKSLASH)
    first = _first(openings, _after_tag(openings, strokes, lines), lines.stop)
    has = first >= 0
    first = np.where(has, first, lines.start)
    star = _last(buffer, first, lines.stop, _STAR)
    summed = has & (star > 0) & checksum_right(buffer, first, star, lines.stop)
    start = np.where(has, first + 1, lines.start)
    stop = np.where(has, np.where(summed, star, lines.stop), start)
    commas = np.flatnonzero(buffer == _COMMA)
    low, high = np.searchsorted(commas, start), np.searchsorted(commas, stop)
    address_stop = np.where(low < high, np.append(commas, 0)[np.minimum(low, commas.size)], stop)
    key = _packed(Spans(buffer, start, address_stop))
    stamp, good, zoned = _stamps(lines, first, strokes)
    numbers = (lines.start + at, lines.stop + at, start + at, stop + at, high - low, key, stamp)
    return numbers, (has, summed, good, zoned)


def checksum_right(buffer: Bytes, first: Index, star: Index, stop: Index) -> NDArray[np.bool_]:
    """Tell which sentences end in their own checksum.

    The exclusive or of a stretch is that of the prefixes at its two ends, so one pass over the buffer serves
    every line.

    Parameters
    ----------
    buffer : ndarray of uint8
    first, star : ndarray of int64, shape (n,)
        Places of ``$`` or ``!`` and of ``*``.
    stop : ndarray of int64, shape (n,)
        Ends of the lines.

    Returns
    -------
    ndarray of bool, shape (n,)

    References
    ----------
    IEC 61162-1:2016, 7.2.3.7.
    """
    if buffer.size == 0:
        return np.zeros(first.shape, dtype=np.bool_)
    prefix = np.bitwise_xor.accumulate(buffer)
    last = buffer.size - 1
    own = prefix[np.maximum(star - 1, 0)] ^ prefix[first]
    high, low = _hex(buffer[np.minimum(star + 1, last)]), _hex(buffer[np.minimum(star + 2, last)])
    right: NDArray[np.bool_] = (star > first) & (star + 3 == stop) & (high >= 0) & (low >= 0)
    right &= own == high * 16 + low
    return right


def _hex(byte: Bytes) -> NDArray[np.int64]:
    table = np.full(256, -1, dtype=np.int64)
    table[48:58] = np.arange(10)
    table[65:71] = np.arange(10, 16)
    table[97:103] = np.arange(10, 16)
    return table[byte]


def _first(places: Index, start: Index, stop: Index) -> Index:
    """Return the first of the places in each stretch, -1 for none."""
    if places.size == 0:
        return np.full(start.shape, -1, dtype=np.int64)
    at = np.searchsorted(places, start)
    found = places[np.minimum(at, places.size - 1)]
    return np.where((at < places.size) & (found < stop), found, -1)


def _last(buffer: Bytes, start: Index, stop: Index, byte: int) -> Index:
    """Return the last place of the byte in each stretch, -1 for none."""
    places = np.flatnonzero(buffer == byte)
    if places.size == 0:
        return np.full(start.shape, -1, dtype=np.int64)
    before = np.searchsorted(places, stop) - 1
    found = places[np.maximum(before, 0)]
    return np.where((before >= 0) & (found >= start), found, -1)


def _after_tag(openings: Index, strokes: Index, lines: Spans) -> Index:
    r"""Return where the sentence may begin: behind the TAG block ``\...\`` of those lines that have one."""
    if strokes.size == 0:
        return lines.start
    opening = _first(strokes, lines.start, lines.stop)
    sentence = _first(openings, lines.start, lines.stop)
    tagged = (opening >= 0) & ((sentence < 0) | (opening < sentence))
    start = lines.start.copy()
    closing = _first(strokes, np.where(tagged, opening + 1, lines.stop), lines.stop)
    tagged &= closing >= 0
    start[tagged] = closing[tagged] + 1
    return start


def _packed(address: Spans) -> NDArray[np.int64]:
    """Pack the first seven characters of each address into an integer."""
    key = np.zeros(len(address), dtype=np.int64)
    last = max(address.buffer.size - 1, 0)
    for k in range(_ADDRESS if len(address) else 0):
        place = address.start + k
        byte = _PRINTED[address.buffer[np.minimum(place, last)]]
        key = np.where(place < address.stop, (key << 8) | byte, key)
    return key


def _named(key: NDArray[np.int64]) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Give numbers to the distinct addresses; -1 to the empty one."""
    distinct, code = np.unique(key, return_inverse=True)
    names = [int(k).to_bytes(_ADDRESS, "big").lstrip(b"\0").decode("ascii") for k in distinct]
    if names and names[0] == "":
        return code.astype(np.int64) - 1, tuple(names[1:])
    return code.astype(np.int64), tuple(names)


def _stamps(lines: Spans, first: Index, strokes: Index) -> tuple[Nanoseconds, NDArray[np.bool_], NDArray[np.bool_]]:
    """Read the ISO 8601 stamp in front of the sentence, up to a blank, a comma or a semicolon."""
    stop = np.maximum(first, lines.start)
    tag = _first(strokes, lines.start, stop)
    stop = np.where(tag >= 0, tag, stop)
    stamp = trimmed(Spans(lines.buffer, lines.start, stop))
    if lines.buffer.size:
        end = lines.buffer[np.maximum(stamp.stop - 1, 0)]
        cut = (stamp.stop > stamp.start) & ((end == _COMMA) | (end == 59) | is_blank(end))
        stamp = trimmed(Spans(stamp.buffer, stamp.start, stamp.stop - cut))
    return iso_time.parse(stamp)
