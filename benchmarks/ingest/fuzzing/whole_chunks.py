"""The messages of an MCAP file that a checksum vouches for, found without following the file's structure.

A damaged file has no structure to rely on: a chunk is looked for at every byte that could open one.

References
----------
MCAP specification, https://mcap.dev/spec, "Chunk", "Message".
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import lz4.frame
import zstandard

_MESSAGE, _CHUNK = 5, 6
#: Largest chunk that is looked into, bytes unpacked.
_LARGEST = 1 << 24


def vouched_times(data: bytes) -> set[int]:
    """Return the log times, ns, of the messages in chunks whose checksum is right, and of those outside any chunk.

    A chunk that says that it has no checksum (zero) has nothing to fail, and what lies in it may lie anywhere.
    """
    times: set[int] = set()
    inside = bytearray(len(data))
    for at, stop, summed, content in _chunks(data):
        if summed:
            inside[at:stop] = b"\1" * (stop - at)
        if content is not None:
            times.update(_messages(content))
    at = data.find(_MESSAGE)
    while at >= 0:
        if not inside[at]:
            times.update(_message_at(data, at))
        at = data.find(_MESSAGE, at + 1)
    return times


def _chunks(data: bytes) -> Iterator[tuple[int, int, bool, bytes | None]]:
    """Yield where chunks begin and end, whether they have a checksum, and their content, None where it fails that.

    The length in front of a chunk is not looked at: a chunk may be whole although it is wrong.
    """
    at = data.find(_CHUNK)
    while at >= 0:
        head = data[at + 9 : at + 41]
        if len(head) == 32:
            size, crc, name_length = struct.unpack_from("<QII", head, 16)
            first = at + 41 + name_length + 8
            length = int.from_bytes(data[first - 8 : first], "little")
            if name_length <= 8 and first + length <= len(data) and size <= _LARGEST:
                name = data[at + 41 : at + 41 + name_length]
                yield at, first + length, crc != 0, _unpacked(name, data[first : first + length], size, crc)
        at = data.find(_CHUNK, at + 1)


def _unpacked(name: bytes, packed: bytes, size: int, crc: int) -> bytes | None:
    try:
        if name == b"zstd":
            content = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
        elif name == b"lz4":
            # a frame that lost its end may hold all of the records: the chunk's own checksum is what counts
            unpacker = lz4.frame.LZ4FrameDecompressor()
            content = unpacker.decompress(packed, max_length=size)
            if not unpacker.eof and not crc:
                return None
        else:
            content = packed
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError):
        return None
    return content if crc in (0, zlib.crc32(content)) else None


def _messages(content: bytes) -> Iterator[int]:
    at = 0
    while at + 9 <= len(content):
        if content[at] == _MESSAGE:
            yield from _message_at(content, at)
        at += 9 + int.from_bytes(content[at + 1 : at + 9], "little")


def _message_at(data: bytes, at: int) -> Iterator[int]:
    if at + 31 <= len(data) and 22 <= int.from_bytes(data[at + 1 : at + 9], "little") <= len(data) - at - 9:
        yield int.from_bytes(data[at + 15 : at + 23], "little")
