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

    A chunk that says that it has no checksum (zero) is taken at its word.
    """
    times: set[int] = set()
    inside = bytearray(len(data))
    for at, stop, content in _chunks(data):
        inside[at:stop] = b"\1" * (stop - at)
        if content is not None:
            times.update(_messages(content))
    at = data.find(_MESSAGE)
    while at >= 0:
        if not inside[at]:
            times.update(_message_at(data, at))
        at = data.find(_MESSAGE, at + 1)
    return times


def _chunks(data: bytes) -> Iterator[tuple[int, int, bytes | None]]:
    """Yield where chunks begin and end, and their content; None where it fails its checksum."""
    at = data.find(_CHUNK)
    while at >= 0:
        head = data[at + 1 : at + 9]
        length = int.from_bytes(head, "little")
        if len(head) == 8 and 40 <= length <= len(data) - at - 9:
            yield at, at + 9 + length, _unpacked(data[at + 9 : at + 9 + length])
        at = data.find(_CHUNK, at + 1)


def _unpacked(chunk: bytes) -> bytes | None:
    size, crc, name_length = struct.unpack_from("<QII", chunk, 16)
    if size > _LARGEST or 32 + name_length + 8 > len(chunk):
        return None
    name, packed = chunk[32 : 32 + name_length], chunk[32 + name_length + 8 :]
    packed = packed[: int.from_bytes(chunk[32 + name_length : 40 + name_length], "little")]
    try:
        if name == b"zstd":
            content = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
        elif name == b"lz4":
            content = lz4.frame.decompress(packed)
        else:
            content = packed
    except (zstandard.ZstdError, RuntimeError, MemoryError):
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
