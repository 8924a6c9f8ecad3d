"""One MCAP chunk: checked against its own size and CRC, and unpacked within a bound.

References
----------
MCAP specification, https://mcap.dev/spec, "Chunk (op=0x06)".
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

#: Largest chunk that is unpacked, bytes. Writers close a chunk at 1 to 16 MB; one message may make it larger.
CHUNK_LIMIT = 256 << 20

#: Bytes in front of the name of the compression.
_HEAD = struct.Struct("<QQQII")


class DamagedChunkError(Exception):
    """A chunk that cannot be used; says why."""


@dataclass(frozen=True)
class ChunkHead:
    """What stands in front of a chunk's records.

    Attributes
    ----------
    since_ns, until_ns : int
        Earliest and latest log time; both 0 in a chunk without messages.
    size, crc : int
        Of the unpacked records; CRC 0 says that there is none.
    compression : str
    body, length : int
        Where the packed records begin in the record's content, and their bytes.
    """

    since_ns: int
    until_ns: int
    size: int
    crc: int
    compression: str
    body: int
    length: int


def head_of(content: bytes | memoryview) -> ChunkHead | None:
    """Return the head of a chunk, None where it is cut or cannot be one."""
    if len(content) < _HEAD.size + 8:
        return None
    since, until, size, crc, name_length = _HEAD.unpack_from(content, 0)
    body = _HEAD.size + name_length
    if body + 8 > len(content):
        return None
    name = bytes(content[_HEAD.size : body]).decode("ascii", errors="replace")
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
