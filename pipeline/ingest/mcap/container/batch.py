"""What comes out of an MCAP file a few megabytes at a time: messages not yet decoded, and what is lost.

Their payloads are read again from the file when they are asked for: few are, and then few at a time.

References
----------
MCAP specification, https://mcap.dev/spec, "Message (op=0x05)" and "Message Index (op=0x07)".
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.records import CHUNK_LIMIT, MESSAGE_INDEX, head_of, unpacked
from kempf.pipeline.ingest.mcap.container.walk import HEAD, heads
from kempf.pipeline.ingest.spans import RAW_LIMIT, Bytes, Index, Spans, as_bytes

#: Bytes of a payload that is no text which are shown, in hexadecimal digits.
_SHOWN = 64

_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
_LATEST = np.uint64(np.iinfo(np.int64).max)


@dataclass(frozen=True)
class Piece:
    """Where the bytes of messages come from, so that they can be read again."""

    #: place, length: A record of the file with its head, or a stretch of records.
    place: int
    length: int
    #: Whether it is a chunk, to be unpacked.
    packed: bool
    #: Bytes of the content.
    size: int

    def read(self, log: LogFile) -> Bytes:
        """Return the content once more."""
        data = log.read(self.place, self.length)
        return as_bytes(unpacked(memoryview(data)[HEAD:], CHUNK_LIMIT) if self.packed else data)


@dataclass(frozen=True, eq=False)
class Batch:
    """Some messages that follow each other in the file."""

    #: The pieces behind each other.
    content: Bytes
    #: first, end: Shape (m,). Payloads in it; empty stretches for messages that are lost.
    first: Index
    end: Index
    #: Shape (m,). Channel ids, -1 where it is unknown.
    channel: NDArray[np.int64]
    #: log_time, publish_time: Shape (m,). Nanoseconds.
    log_time: NDArray[np.int64]
    publish_time: NDArray[np.int64]
    pieces: tuple[Piece, ...] = ()
    #: Whether the messages are known from their index only.
    lost: bool = False


def messages_of(content: Bytes, first: Index, end: Index, piece: Piece) -> Batch:
    """Read the heads of messages; one too short for a head belongs to no channel.

    Parameters
    ----------
    first, end : ndarray of int64, shape (m,)
        Contents of the message records.
    piece : Piece
        Where ``content`` comes from.
    """
    payload, channel, log_time, publish_time = heads(content, first, end)
    return Batch(content, payload, end, channel, log_time, publish_time, (piece,))


def joined(batches: list[Batch]) -> Batch:
    """Return batches of messages that follow each other, all of them lost or none, as one."""
    if len(batches) == 1:
        return batches[0]
    if not batches:
        nothing = np.empty(0, dtype=np.int64)
        return Batch(np.empty(0, dtype=np.uint8), nothing, nothing, nothing, nothing, nothing)
    base = np.concatenate(([0], np.cumsum([b.content.size for b in batches])))[:-1]
    return Batch(
        np.concatenate([b.content for b in batches]),
        np.concatenate([b.first + at for b, at in zip(batches, base, strict=True)]),
        np.concatenate([b.end + at for b, at in zip(batches, base, strict=True)]),
        np.concatenate([b.channel for b in batches]),
        np.concatenate([b.log_time for b in batches]),
        np.concatenate([b.publish_time for b in batches]),
        tuple(piece for b in batches for piece in b.pieces),
        lost=batches[0].lost,
    )


def stretch(since_ns: int | None, until_ns: int | None, messages: int | None, why: str) -> LostStretch:
    """Return a lost stretch; what damage made of its times, and no clock ever showed, is left out of it."""
    since = since_ns if since_ns is not None and 0 < since_ns <= int(_LATEST) else None
    until = until_ns if until_ns is not None and (since or 1) <= until_ns <= int(_LATEST) else None
    return LostStretch(since, until, messages, why)


def lost_chunk(log: LogFile, place: int, length: int, why: str) -> tuple[Batch, LostStretch]:
    """Return a batch for a chunk that cannot be read: its messages by the index behind it, or one where there is none.

    Parameters
    ----------
    place, length : int
        The chunk's record, with its head.
    """
    channel, time = _indexed(log, place + length)
    head = head_of(log.read(place + HEAD, min(length - HEAD, 64)))
    since = until = None
    if time.size:
        since, until = int(time.min()), int(time.max())
    elif head is not None:
        since, until = head.since_ns, head.until_ns
    lost = stretch(since, until, int(time.size) or None, why)
    if time.size == 0:
        channel, time = np.full(1, -1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    nothing = np.zeros(time.size, dtype=np.int64)
    return Batch(np.empty(0, np.uint8), nothing, nothing.copy(), channel, time, time, lost=True), lost


def _indexed(log: LogFile, at: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return channel and log time of the messages that the indexes from a place on list, sorted by time."""
    channels, times = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    while len(head := log.read(at, HEAD + 6)) == HEAD + 6 and head[0] == MESSAGE_INDEX:
        length, channel, size = struct.unpack_from("<QHI", head, 1)
        entries = min(size, (length - 6) // _INDEX_ENTRY.itemsize) if length >= 6 else 0
        if at + HEAD + length > log.size:
            break
        body = log.read(at + HEAD + 6, entries * _INDEX_ENTRY.itemsize)
        table = np.frombuffer(body, dtype=_INDEX_ENTRY)
        times.append(np.minimum(table["log_time"], _LATEST).astype(np.int64))
        channels.append(np.full(entries, channel, dtype=np.int64))
        at += HEAD + length
    channel_of, time = np.concatenate(channels), np.concatenate(times)
    order = np.argsort(time, kind="stable")
    return channel_of[order], time[order]


@dataclass(frozen=True, eq=False)
class _ChunkBlock:
    """Payloads of one batch: where its bytes come from, and where in them the payloads lie."""

    pieces: tuple[Piece, ...]
    first: NDArray[np.uint32]
    end: NDArray[np.uint32]


class PayloadsBuilder:
    """Takes note of where the payloads of batches stand."""

    def __init__(self) -> None:
        self._blocks: list[_ChunkBlock] = []

    def add(self, batch: Batch) -> None:
        """Take note of one batch."""
        self._blocks.append(_ChunkBlock(batch.pieces, batch.first.astype(np.uint32), batch.end.astype(np.uint32)))

    def build(self, log: LogFile, is_text: NDArray[np.bool_]) -> Payloads:
        """Return all payloads; ``is_text`` says of each whether it is shown as it stands."""
        return Payloads(log, self._blocks, is_text)


class Payloads:
    """Payloads of a whole file, or of some of its messages.

    Parameters
    ----------
    log : LogFile
        Must stay open.
    blocks : list of _Block
    is_text : ndarray of bool, shape (n,)
    chosen : ndarray of int64, shape (m,), optional
        Some of the messages, ascending; else all.
    """

    def __init__(
        self, log: LogFile, blocks: list[_ChunkBlock], is_text: NDArray[np.bool_], chosen: Index | None = None
    ) -> None:
        self._log, self._blocks, self._is_text = log, blocks, is_text
        self._begins = np.cumsum([0] + [block.first.size for block in blocks])
        self._chosen = np.arange(self._begins[-1], dtype=np.int64) if chosen is None else chosen

    def __len__(self) -> int:
        return int(self._chosen.size)

    def take(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Payloads:
        """Return some of the payloads, by mask or by ascending index."""
        return Payloads(self._log, self._blocks, self._is_text, self._chosen[chosen])

    def binary(self) -> pl.Series:
        """Return the payloads as a column of bytes."""
        parts = [spans.binary() for spans, _ in self._blocks_chosen()]
        return pl.concat(parts) if parts else pl.Series("content", [], dtype=pl.Binary)

    def text(self, limit: int = RAW_LIMIT) -> pl.Series:
        """Return the payloads as text of at most ``limit`` characters, what is no text as its first bytes."""
        parts = [_shown(spans, self._is_text[record], limit) for spans, record in self._blocks_chosen()]
        return pl.concat(parts) if parts else pl.Series("raw", [], dtype=pl.String)

    def _blocks_chosen(self) -> Iterator[tuple[Spans, Index]]:
        """Read the blocks that are asked for again, one at a time: their payloads and the numbers of the messages."""
        bounds = np.searchsorted(self._chosen, self._begins)
        for block, begin, low, high in zip(self._blocks, self._begins[:-1], bounds[:-1], bounds[1:], strict=True):
            if low == high:
                continue
            record = self._chosen[low:high]
            own = record - begin
            content: Bytes = np.concatenate([np.empty(0, np.uint8), *(piece.read(self._log) for piece in block.pieces)])
            yield Spans(content, block.first[own].astype(np.int64), block.end[own].astype(np.int64)), record


def _shown(spans: Spans, is_text: NDArray[np.bool_], limit: int) -> pl.Series:
    """Return payloads as they are shown."""
    if is_text.all():
        return spans.text(limit)
    shown = np.empty(len(spans), dtype=object)
    shown[is_text] = spans.take(is_text).text(limit).to_list()
    for i in np.flatnonzero(~is_text):
        own = spans.buffer[spans.start[i] : spans.stop[i]]
        more = f"... {own.size} bytes" if own.size > _SHOWN else ""
        shown[i] = own[:_SHOWN].tobytes().hex() + more
    return pl.Series("raw", shown.tolist(), dtype=pl.String)
