"""The records of an MCAP file that describe others, taken apart one by one; a damaged one is None.

References
----------
MCAP specification, https://mcap.dev/spec, "Records".
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(0x01, 0x09)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(0x09, 0x10)

#: From here on opcodes belong to applications; those between `DATA_END` and it are reserved, 0 is none.
FIRST_PRIVATE = 0x80

#: Counts of messages, schemas, channels, attachments, metadata and chunks.
_STATISTICS = struct.Struct("<QHIIII")

#: Content of a footer, and of a data end as it is written today, bytes.
FOOTER_SIZE, DATA_END_SIZE = 20, 4


@dataclass(frozen=True)
class Schema:
    """How the messages of a channel are built; ``encoding`` says in which language ``data`` tells it."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class Channel:
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
        return _id(content), Schema(name, encoding, content[at + 4 : at + 4 + length])
    except struct.error:
        return None


def parse_channel(content: bytes) -> tuple[int, Channel] | None:
    """Return the id of a channel and what it says; its metadata are not looked at."""
    try:
        number, schema = struct.unpack_from("<HH", content, 0)
        topic, at = _text(content, 4)
        encoding, _ = _text(content, at)
    except struct.error:
        return None
    return number, Channel(topic, encoding, schema)


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


def parse_chunk_place(content: bytes) -> tuple[int, int] | None:
    """Return where the chunk of a chunk index stands, and the bytes of its record."""
    return struct.unpack_from("<QQ", content, 16) if len(content) >= 32 else None


def _id(content: bytes) -> int:
    return int(struct.unpack_from("<H", content, 0)[0])


def _text(content: bytes, at: int) -> tuple[str, int]:
    """Return a string with its length in front, and the place behind it."""
    (length,) = struct.unpack_from("<I", content, at)
    end = at + 4 + length
    if end > len(content):
        raise struct.error("a string reaches beyond its record")
    return content[at + 4 : end].decode("utf-8", errors="replace"), end
