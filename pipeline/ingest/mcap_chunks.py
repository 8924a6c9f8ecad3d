"""The container of an MCAP file: chunks unpacked and checked, messages found; damage costs only the chunk it lies in.

What the messages say is read in `mcap_log`.

References
----------
MCAP specification, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.ingest.mcap_walk import HEAD, walk
from pipeline.ingest.sniff import MCAP_MAGIC
from pipeline.ingest.spans import Bytes, Index, as_bytes
from pipeline.ingest.unpack import LIMIT

FOOTER, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 0x02, 0x04, 0x05, 0x06, 0x07, 0x08

#: Message indexes of one chunk: channel and log times.
Indexes = list[tuple[int, NDArray[np.int64]]]

_MESSAGE_HEAD = np.dtype([("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")])
_INDEX_ENTRY = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
_LATEST = np.uint64(np.iinfo(np.int64).max)


class _DamagedChunkError(Exception):
    """A chunk that cannot be used; says why."""


@dataclass(frozen=True, eq=False)
class Batch:
    """The messages of one chunk, or of the part of a file without chunks.

    Attributes
    ----------
    content : ndarray of uint8
        Bytes in which the payloads stand.
    first, end : ndarray of int64, shape (m,)
        The payloads; empty stretches for messages that are lost.
    channel : ndarray of int64, shape (m,)
        Channel ids, -1 where it cannot be told.
    log_time, publish_time : ndarray of int64, shape (m,)
        Nanoseconds.
    lost : bool
        Whether the messages are known from the index only.
    """

    content: Bytes
    first: Index
    end: Index
    channel: NDArray[np.int64]
    log_time: NDArray[np.int64]
    publish_time: NDArray[np.int64]
    lost: bool = False


@dataclass
class Container:
    """What an MCAP file holds.

    Attributes
    ----------
    batches : list of Batch
        In the order of the file.
    channels : dict of int to (str, str)
        Channel id -> topic and message encoding.
    notes : list of str
    partial : bool
        Whether the file is cut or damaged.
    """

    batches: list[Batch] = field(default_factory=list)
    channels: dict[int, tuple[str, str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    partial: bool = False


def open_container(data: bytes) -> Container:
    """Find every message of an MCAP file that is whole.

    Parameters
    ----------
    data : bytes
        The file, cut short or damaged though it may be.

    Returns
    -------
    Container
    """
    buffer = as_bytes(data)
    found = Container()
    ended = len(data) >= 2 * len(MCAP_MAGIC) and data.endswith(MCAP_MAGIC)
    stop = len(data) - (len(MCAP_MAGIC) if ended else 0)
    opcode, first, end, reached = walk(buffer, len(MCAP_MAGIC), stop)
    known = {int(at) - HEAD: int(to) for at, to in zip(first[opcode == CHUNK], end[opcode == CHUNK], strict=True)}
    indexes = _indexes_behind(data, opcode, first, end)
    footer = opcode.size > 0 and opcode[-1] == FOOTER
    if reached < stop or not ended or not footer:
        found.partial = True
        found.notes.append(f"The MCAP file is cut short or damaged at byte {reached}: all whole chunks were read.")
        for at, offsets in _summary_chunks(data, buffer, stop).items() if ended else ():
            if at not in known:
                known[at] = _end_of(data, at)
                indexes[at] = [_index(data, o + HEAD, _end_of(data, o)) for o in offsets if 0 <= o < len(data)]
    for at, to in zip(first[opcode == CHANNEL], end[opcode == CHANNEL], strict=True):
        _add_channel(found, data[at:to])
    room = LIMIT
    for at in sorted(known):
        batch = _chunk(found, data, slice(at + HEAD, known[at]), indexes.get(at, []), room)
        room -= batch.content.size
        found.batches.append(batch)
    loose = opcode == MESSAGE
    if loose.any():
        found.batches.append(_messages(buffer, first[loose], end[loose]))
    return found


def _indexes_behind(data: bytes, opcode: NDArray[np.uint8], first: Index, end: Index) -> dict[int, Indexes]:
    """Return the message indexes that stand behind each chunk."""
    indexes: dict[int, Indexes] = {}
    chunk = -1
    for i in np.flatnonzero((opcode == CHUNK) | (opcode == MESSAGE_INDEX)):
        if opcode[i] == CHUNK:
            chunk = int(first[i]) - HEAD
        else:
            indexes.setdefault(chunk, []).append(_index(data, int(first[i]), int(end[i])))
    return indexes


def _index(data: bytes, first: int, end: int) -> tuple[int, NDArray[np.int64]]:
    """Read one message index; an empty one where it is damaged."""
    if end - first < 6:
        return -1, np.empty(0, dtype=np.int64)
    channel, size = struct.unpack_from("<HI", data, first)
    entries = min(size, end - first - 6) // _INDEX_ENTRY.itemsize
    table = np.frombuffer(data, dtype=_INDEX_ENTRY, count=entries, offset=first + 6)
    return channel, np.minimum(table["log_time"], _LATEST).astype(np.int64)


def _end_of(data: bytes, at: int) -> int:
    if at < 0 or at + HEAD > len(data):
        return at
    return min(at + HEAD + int(struct.unpack_from("<Q", data, at + 1)[0]), len(data))


def _summary_chunks(data: bytes, buffer: Bytes, stop: int) -> dict[int, list[int]]:
    """Return the chunks that the summary at the end of the file knows, with the places of their message indexes."""
    footer = stop - HEAD - 20
    if footer < 0 or data[footer] != FOOTER:
        return {}
    start = struct.unpack_from("<Q", data, footer + HEAD)[0]
    if not 0 < start < footer:
        return {}
    chunks: dict[int, list[int]] = {}
    opcode, first, end, _ = walk(buffer, start, footer)
    for at, to in zip(first[opcode == CHUNK_INDEX], end[opcode == CHUNK_INDEX], strict=True):
        if to - at < 36:
            continue
        place, size = struct.unpack_from("<Q", data, at + 16)[0], struct.unpack_from("<I", data, at + 32)[0]
        pairs = min(size, to - at - 36) // 10
        if place < footer:
            chunks[place] = [struct.unpack_from("<HQ", data, at + 36 + 10 * k)[1] for k in range(pairs)]
    return chunks


def _chunk(found: Container, data: bytes, place: slice, indexes: Indexes, room: int) -> Batch:
    """Open the chunk whose record content stands at ``place``; its messages are lost where it is damaged."""
    first, end = place.start, place.stop
    try:
        content = _unpacked(data, first, end, room)
    except _DamagedChunkError as why:
        found.partial = True
        return _lost(found, data, place, indexes, str(why))
    opcode, at, to, _ = walk(content, 0, content.size)
    for i in np.flatnonzero(opcode == CHANNEL):
        _add_channel(found, content[at[i] : to[i]].tobytes())
    message = opcode == MESSAGE
    return _messages(content, at[message], to[message])


def _unpacked(data: bytes, first: int, end: int, room: int) -> Bytes:
    """Return the content of a chunk, checked against its size and CRC."""
    if end - first < 40:
        raise _DamagedChunkError("its head is cut")
    size, crc, name_length = struct.unpack_from("<QII", data, first + 16)
    body = first + 32 + name_length
    if body + 8 > end:
        raise _DamagedChunkError("its head is damaged")
    name = data[first + 32 : body].decode("ascii", errors="replace")
    length = struct.unpack_from("<Q", data, body)[0]
    packed = data[body + 8 : body + 8 + length]
    if body + 8 + length > end or size > room:
        raise _DamagedChunkError("its length is not that of its content")
    content = _decompressed(name, packed, size)
    if len(content) != size:
        raise _DamagedChunkError("it does not unpack to its stated size")
    if crc and zlib.crc32(content) != crc:
        raise _DamagedChunkError("its CRC does not match")
    return as_bytes(content)


def _decompressed(name: str, packed: bytes, size: int) -> bytes:
    """Unpack within the stated size."""
    if name == "":
        return packed
    if name == "zstd":
        import zstandard

        try:
            with zstandard.ZstdDecompressor().stream_reader(packed) as reader:
                return bytes(reader.read(size + 1))
        except zstandard.ZstdError as error:
            raise _DamagedChunkError(f"zstd: {error}") from error
    if name == "lz4":
        import lz4.frame

        try:
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1))
        except (RuntimeError, EOFError) as error:
            raise _DamagedChunkError(f"lz4: {error}") from error
    raise _DamagedChunkError(f"its compression {name!r} is not known")


def _lost(found: Container, data: bytes, place: slice, indexes: Indexes, why: str) -> Batch:
    """Stand in for a chunk that cannot be read: its messages by the index, or one where there is none."""
    first, end = place.start, place.stop
    channel = np.concatenate([np.full(t.size, c, dtype=np.int64) for c, t in indexes] or [np.empty(0, np.int64)])
    time = np.concatenate([t for _, t in indexes] or [np.empty(0, np.int64)])
    order = np.argsort(time, kind="stable")
    channel, time = channel[order], time[order]
    span = ""
    if end - first >= 16:
        since, until = struct.unpack_from("<QQ", data, first)
        span = f", log times {since} to {until} ns"
    count = f"{time.size} messages by its index" if time.size else "an unknown number of messages"
    found.notes.append(f"The chunk at byte {first - HEAD} is lost, {count}{span}: {why}.")
    if time.size == 0:
        channel, time = np.full(1, -1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    nothing = np.zeros(time.size, dtype=np.int64)
    return Batch(np.empty(0, np.uint8), nothing, nothing.copy(), channel, time, time, lost=True)


def _messages(content: Bytes, first: Index, end: Index) -> Batch:
    """Read the heads of the messages; one too short for a head belongs to no channel."""
    n, size = first.size, _MESSAGE_HEAD.itemsize
    whole = end - first >= size
    head = np.zeros(n, dtype=_MESSAGE_HEAD)
    if whole.any():
        head[whole] = np.ascontiguousarray(content[first[whole][:, None] + np.arange(size)]).view(_MESSAGE_HEAD)[:, 0]
    channel = np.where(whole, head["channel"].astype(np.int64), -1)
    log_time, publish_time = (np.minimum(head[k], _LATEST).astype(np.int64) for k in ("log_time", "publish_time"))
    return Batch(content, np.where(whole, first + size, first), end, channel, log_time, publish_time)


def _add_channel(found: Container, body: bytes) -> None:
    """Take note of a channel record; a damaged one is left out and its messages with it."""
    try:
        channel = struct.unpack_from("<H", body, 0)[0]
        at, words = 4, []
        for _ in range(2):
            length = struct.unpack_from("<I", body, at)[0]
            if at + 4 + length > len(body):
                return
            words.append(body[at + 4 : at + 4 + length].decode("utf-8", errors="replace"))
            at += 4 + length
    except struct.error:
        return
    found.channels.setdefault(channel, (words[0], words[1]))
