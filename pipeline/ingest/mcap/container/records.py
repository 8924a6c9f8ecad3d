"""The records of an MCAP file, taken apart one by one: those that describe others, and chunks, unpacked within a bound.

A damaged record is None.

References
----------
MCAP specification, https://mcap.dev/spec, "Records".
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(0x01, 0x09)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(0x09, 0x10)

#: From here on opcodes belong to applications; those between `DATA_END` and it are reserved, 0 is none.
FIRST_PRIVATE = 0x80

#: Counts of messages, schemas, channels, attachments, metadata and chunks.
_STATISTICS = struct.Struct("<QHIIII")
#: Earliest log time, behind them.
_SINCE = struct.Struct("<Q")

#: Content of a footer, and of a data end as it is written today, bytes.
FOOTER_SIZE, DATA_END_SIZE = 20, 4

#: Largest chunk that is unpacked, bytes. Writers close a chunk at 1 to 16 MB; one message may make it larger.
CHUNK_LIMIT = 256 << 20

#: Bytes in front of the name of the compression.
_CHUNK_HEAD = struct.Struct("<QQQII")


@dataclass(frozen=True)
class Schema:
    """How the messages of a channel are built; ``encoding`` says in which language ``data`` says it."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class McapChannel:
    """One stream of messages; ``schema`` 0 is none."""

    topic: str
    encoding: str
    schema: int


@dataclass(frozen=True)
class Footer:
    """Where the summary begins, 0 for none, and the CRC of its bytes, 0 for none."""

    summary_start: int
    summary_crc: int


def parse_schema(content: bytes) -> tuple[int, Schema] | None:
    """Return the id of a schema and what it says."""
    try:
        name, at = _text(content, 2)
        encoding, at = _text(content, at)
        (length,) = struct.unpack_from("<I", content, at)
        if at + 4 + length > len(content):
            return None
        number = int(struct.unpack_from("<H", content, 0)[0])
        return number, Schema(name, encoding, content[at + 4 : at + 4 + length])
    except struct.error:
        return None


def parse_channel(content: bytes) -> tuple[int, McapChannel] | None:
    """Return the id of a channel and what it says; its metadata are not looked at."""
    try:
        number, schema = struct.unpack_from("<HH", content, 0)
        topic, at = _text(content, 4)
        encoding, _ = _text(content, at)
    except struct.error:
        return None
    return number, McapChannel(topic, encoding, schema)


def parse_footer(content: bytes) -> Footer | None:
    """Return what a footer says."""
    if len(content) < FOOTER_SIZE:
        return None
    start, _, crc = struct.unpack_from("<QQI", content, 0)
    return Footer(start, crc)


def parse_statistics(content: bytes) -> tuple[int, int] | tuple[None, None]:
    """Return how many messages and how many chunks a statistics record counts."""
    if len(content) < _STATISTICS.size:
        return None, None
    messages, _, _, _, _, chunks = _STATISTICS.unpack_from(content, 0)
    return messages, chunks


def parse_since(content: bytes) -> int | None:
    """Return the earliest log time that a statistics record states, ns; None where it counts no message."""
    if len(content) < _STATISTICS.size + _SINCE.size or not _STATISTICS.unpack_from(content, 0)[0]:
        return None
    return int(_SINCE.unpack_from(content, _STATISTICS.size)[0])


def parse_chunk_place(content: bytes) -> tuple[int, int] | None:
    """Return where the chunk of a chunk index stands, and the bytes of its record."""
    return struct.unpack_from("<QQ", content, 16) if len(content) >= 32 else None


def _text(content: bytes, at: int) -> tuple[str, int]:
    """Return a string with its length in front, and the place behind it."""
    (length,) = struct.unpack_from("<I", content, at)
    end = at + 4 + length
    if end > len(content):
        raise struct.error("a string reaches beyond its record")
    return content[at + 4 : end].decode("utf-8", errors="replace"), end


class DamagedChunkError(Exception):
    """A chunk that cannot be used; says why."""


@dataclass(frozen=True)
class ChunkHead:
    """What stands in front of a chunk's records."""

    #: since_ns, until_ns: Earliest and latest log time; both 0 in a chunk without messages.
    since_ns: int
    until_ns: int
    #: size, crc: Of the unpacked records; CRC 0 says that there is none.
    size: int
    crc: int
    compression: str
    #: body, length: Where the packed records begin in the record's content, and their bytes.
    body: int
    length: int


def head_of(content: bytes | memoryview) -> ChunkHead | None:
    """Return the head of a chunk, None where it is cut or cannot be one."""
    if len(content) < _CHUNK_HEAD.size + 8:
        return None
    since, until, size, crc, name_length = _CHUNK_HEAD.unpack_from(content, 0)
    body = _CHUNK_HEAD.size + name_length
    if body + 8 > len(content):
        return None
    name = bytes(content[_CHUNK_HEAD.size : body]).decode("ascii", errors="replace")
    (length,) = struct.unpack_from("<Q", content, body)
    return ChunkHead(since, until, size, crc, name, body + 8, length)


def unpacked(content: bytes | memoryview, room: int) -> bytes:
    """Return the records of a chunk.

    Parameters
    ----------
    content : bytes-like
        Content of the chunk's record.
    room : int
        Most bytes that it may unpack to.

    Raises
    ------
    DamagedChunkError
        It is cut, larger than it may be, not what it claims to be, or its CRC does not match.
    """
    head = head_of(content)
    if head is None:
        raise DamagedChunkError("its head is damaged")
    if head.body + head.length > len(content):
        raise DamagedChunkError("its length is not that of its content")
    if head.size > min(room, CHUNK_LIMIT):
        raise DamagedChunkError(f"it claims to unpack to {head.size} bytes; at most {min(room, CHUNK_LIMIT)} are taken")
    records = _decompressed(head, memoryview(content)[head.body : head.body + head.length])
    if len(records) != head.size:
        raise DamagedChunkError("it does not unpack to its stated size")
    if head.crc and zlib.crc32(records) != head.crc:
        raise DamagedChunkError("its CRC does not match")
    return records


def _decompressed(head: ChunkHead, packed: memoryview) -> bytes:
    """Unpack; no more than one byte beyond the stated size is ever made."""
    if head.compression == "":
        return bytes(packed)
    if head.compression == "zstd":
        import zstandard

        try:
            # twice as fast, but it makes room for what the frame claims: only where that is what the chunk claims
            if zstandard.frame_content_size(packed) == head.size:
                return bytes(zstandard.ZstdDecompressor().decompress(packed))
            with zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True) as reader:
                return bytes(reader.read(head.size + 1))
        except zstandard.ZstdError as error:
            raise DamagedChunkError(f"zstd: {error}") from error
        except MemoryError as error:
            raise DamagedChunkError("zstd: its window is too large") from error
    if head.compression == "lz4":
        import lz4.frame

        try:
            unpacker = lz4.frame.LZ4FrameDecompressor()
            records = bytes(unpacker.decompress(packed, max_length=head.size + 1))
        except (RuntimeError, EOFError) as error:
            raise DamagedChunkError(f"lz4: {error}") from error
        # where a CRC vouches for the records, nothing hangs on the frame's own end
        if not unpacker.eof and not head.crc:
            raise DamagedChunkError("lz4: its frame does not end")
        return records
    raise DamagedChunkError(f"its compression {head.compression!r} is not known")
