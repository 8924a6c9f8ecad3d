"""From the bytes of an NMEA log to its sentences: stamp, address, checksum, by columns over the whole buffer.

What a sentence says is read in `fields`, a time in front of it in `stamps`, what a TAG block says in `tags`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import CODE, NO_TIME, Code, Flag, Nanoseconds, Reason
from kempf.pipeline.ingest.nmea.stamps import stamps_of
from kempf.pipeline.ingest.nmea.tags import BACKSLASH, checksum_right, tags_of
from kempf.pipeline.ingest.spans import Bytes, Index, Spans, first_within, trimmed
from kempf.pipeline.ingest.text.cells import words

_FEED, _RETURN, _BLANK, _QUOTE, _BANG, _DOLLAR, _STAR, _COMMA = 10, 13, 32, 34, 33, 36, 42, 44

#: Bytes that are worked on at a time.
_BLOCK = 1 << 20

#: Characters of an address as they are kept: capitals and digits, and ``?`` for any other.
_PRINTED = bytes(c if chr(c).isascii() and (chr(c).isdigit() or chr(c).isupper()) else ord("?") for c in range(256))

#: Characters of an address that are kept; longer ones are proprietary.
_ADDRESS = 7

#: Share of lines with a readable stamp from which a log counts as stamped.
_STAMPED = 0.5

#: Characters of a text in front of the sentences that a note shows.
_SHOWN = 60


@dataclass(frozen=True, eq=False)
class Frames:
    """The lines of a log, each with the sentence in it."""

    #: Every line that is not blank, shape (n,).
    lines: Spans
    #: What stands between ``$`` or ``!`` and ``*``; empty where there is no sentence, shape (n,).
    body: Spans
    #: Shape (m,). Places of all commas.
    comma: Index
    #: first_comma, commas: Shape (n,). Index into ``comma`` of the one behind the address, and the number of fields
    #: behind the address.
    first_comma: Index
    commas: Index
    #: Shape (n,). Index into ``names``; -1 where there is none.
    address: Index
    #: Addresses that occur, such as GPRMC.
    names: tuple[str, ...]
    #: Shape (n,). Code of the refusal, 0 for a whole sentence.
    reason: Code
    #: Shape (n,). Whether the sentence ends with its own checksum.
    summed: Flag
    #: Shape (n,). Time of arrival, from the text in front of the sentence or from its TAG block; `NO_TIME` where the
    #: log has none.
    stamp_ns: Nanoseconds
    #: Whether the log's lines bear stamps.
    stamped: bool
    #: Whether every stamp names its zone.
    zoned: bool
    #: Text in front of a sentence that is not read as a time, where most lines have such; else None.
    unread_front: str | None
    #: Lines whose TAG block is not that of its checksum or has no end, so that what it says was left out.
    broken_tags: int
    #: Whether there are fields with blanks at their ends.
    padded: bool


@dataclass(frozen=True, eq=False)
class _Block:
    """Part of a log; places count from the beginning of the file."""

    start: Index
    stop: Index
    body_start: Index
    body_stop: Index
    comma: Index
    first_comma: Index
    commas: Index
    key: Index
    stamp: Nanoseconds
    has: Flag  # a sentence
    summed: Flag  # ... with its own checksum
    good: Flag  # a readable stamp
    zoned: Flag  # ... that names its zone
    unread: Flag  # text in front of the sentence that is no stamp
    bad_tag: Flag  # a TAG block without its own checksum
    padded: bool  # blanks beside a comma or an asterisk


def frames_of(buffer: Bytes) -> Frames:
    """Find the sentences of a log.

    Parameters
    ----------
    buffer : ndarray of uint8
        The whole file; lines end with line feed, carriage return, or both.
    """
    blocks = []
    before = 0
    for at, to in _cuts(buffer):
        blocks.append(_block(buffer[at:to], at, before))
        before += blocks[-1].comma.size

    def whole(name: str) -> NDArray[np.int64]:
        return np.concatenate([getattr(block, name) for block in blocks])

    has, good, bad_tag, summed = whole("has"), whole("good"), whole("bad_tag"), whole("summed")
    lines = Spans(buffer, whole("start"), whole("stop"))
    address, names = _named(whole("key"))
    stamped = bool(has.any()) and float(np.mean(good[has])) >= _STAMPED
    reason = np.zeros(len(lines), dtype=np.int8)
    if stamped:
        reason[~good] = CODE[Reason.MALFORMED]
        reason[~good & bad_tag] = CODE[Reason.CHECKSUM]
    reason[address < 0] = CODE[Reason.MALFORMED]
    reason[~summed] = CODE[Reason.CHECKSUM]
    reason[~has] = CODE[Reason.MALFORMED]
    return Frames(
        lines=lines,
        body=Spans(buffer, whole("body_start"), whole("body_stop")),
        comma=whole("comma"),
        first_comma=whole("first_comma"),
        commas=whole("commas"),
        address=address,
        names=names,
        reason=reason,
        summed=summed.astype(np.bool_),
        stamp_ns=np.where(good, whole("stamp"), NO_TIME) if stamped else np.full(len(lines), NO_TIME),
        stamped=stamped,
        zoned=bool(np.all(whole("zoned")[good])) if stamped else True,
        unread_front=_front(lines, whole("body_start"), has, whole("unread")),
        broken_tags=int(np.sum(bad_tag)),
        padded=any(block.padded for block in blocks),
    )


def _front(lines: Spans, body_start: Index, has: Index, unread: Index) -> str | None:
    """Return the first text in front of a sentence that is no stamp, where most sentences have such a text."""
    if not has.any() or float(np.mean(unread[has])) <= _STAMPED:
        return None
    i = int(np.argmax(unread))
    text = lines.buffer[lines.start[i] : min(body_start[i] - 1, lines.start[i] + _SHOWN)].tobytes()
    return text.partition(b"\\")[0].decode("utf-8", errors="replace")


def _cuts(buffer: Bytes) -> list[tuple[int, int]]:
    """Cut the buffer behind line ends into blocks that stay in the processor's cache while they are worked on."""
    cuts = [0]
    look = _BLOCK
    while cuts[-1] + look < buffer.size:
        part = buffer[cuts[-1] + look - _BLOCK : cuts[-1] + look].tobytes()
        end = max(part.rfind(b"\n"), part.rfind(b"\r"))
        if end >= 0:
            cuts.append(cuts[-1] + look - _BLOCK + end + 1)
            look = _BLOCK
        else:
            look += _BLOCK
    return list(pairwise([*cuts, buffer.size]))


def _lines(buffer: Bytes) -> Spans:
    """Cut a buffer at line feeds and carriage returns; lines that are blank are left out."""
    ends = np.flatnonzero((buffer == _FEED) | (buffer == _RETURN))
    start = np.concatenate((np.zeros(1, dtype=np.int64), ends + 1))
    stop = np.append(ends, buffer.size)
    filled = stop > start
    lines = trimmed(Spans(buffer, start[filled], stop[filled]))
    return lines.take(lines.stop > lines.start)


def _block(buffer: Bytes, at: int, before: int) -> _Block:
    """Find the sentences of one block that begins at place ``at`` of the file, behind so many commas."""
    lines = _lines(buffer)
    openings = np.flatnonzero((buffer == _DOLLAR) | (buffer == _BANG))
    strokes = np.flatnonzero(buffer == BACKSLASH)
    prefix = np.bitwise_xor.accumulate(buffer)
    tags = tags_of(buffer, prefix, openings, strokes, lines)
    one_each = strokes.size == 0 and openings.size == len(lines)
    if one_each and bool(np.all((openings >= lines.start) & (openings < lines.stop))):
        # as it should be: one sentence a line
        first = openings
    else:
        first = first_within(openings, tags.behind, lines.stop)
    has = first >= 0
    first = np.where(has, first, lines.start)
    # another asterisk behind this one would be no digit of a checksum; a cell of a table may end with its quote
    quoted = buffer[np.maximum(lines.stop - 1, 0)] == _QUOTE
    star = np.maximum(lines.stop - 3 - quoted, 0)
    summed = has & (buffer[star] == _STAR) & checksum_right(buffer, prefix, first, star)
    start = np.where(has, first + 1, lines.start)
    stop = np.where(has, np.where(summed, star, lines.stop), start)
    comma = np.flatnonzero(buffer == _COMMA)
    blank = np.flatnonzero(buffer == _BLANK)
    beside = buffer[np.minimum(blank + 1, buffer.size - 1)]
    low, high = np.searchsorted(comma, start), np.searchsorted(comma, stop)
    address_stop = np.where(low < high, np.append(comma, 0)[np.minimum(low, comma.size)], stop)
    stamps = stamps_of(lines, first, tags)
    return _Block(
        start=lines.start + at,
        stop=lines.stop + at,
        body_start=start + at,
        body_stop=stop + at,
        comma=comma + at,
        first_comma=low + before,
        commas=high - low,
        key=_packed(buffer, start, address_stop),
        stamp=stamps.time_utc_ns,
        has=has,
        summed=summed,
        good=stamps.good,
        zoned=stamps.zoned,
        unread=stamps.unread & has,
        bad_tag=tags.broken,
        padded=bool(np.any((buffer[blank - 1] == _COMMA) | (beside == _COMMA) | (beside == _STAR))),
    )


def _packed(buffer: Bytes, start: Index, stop: Index) -> Index:
    """Pack the first seven characters of each address into an integer, the last one into its lowest byte."""
    length = np.minimum(stop - start, _ADDRESS)
    # a shift by 64 bits is undefined
    shift = (8 * (8 - np.maximum(length, 1))).astype(np.uint64)
    key = (words(buffer, start).byteswap() >> shift).astype(np.int64)
    return np.where(length > 0, key, 0)


def _named(key: Index) -> tuple[Index, tuple[str, ...]]:
    """Give numbers to the distinct addresses; -1 to the empty one."""
    raw, code = np.unique(key, return_inverse=True)
    shown = [int(k).to_bytes(_ADDRESS, "big").lstrip(b"\0").translate(_PRINTED).decode("ascii") for k in raw]
    names = sorted(set(shown) - {""}, key=lambda name: (len(name), name))
    place = {name: k for k, name in enumerate(names)} | {"": -1}
    return np.array([place[name] for name in shown], dtype=np.int64)[code], tuple(names)
