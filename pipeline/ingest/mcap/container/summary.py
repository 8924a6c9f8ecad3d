"""The summary at the end of an MCAP file: channels, schemas, where the chunks stand. Taken only where its CRC holds.

References
----------
MCAP specification, https://mcap.dev/spec, "Summary Section" and "Footer (op=0x02)".
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.records import (
    CHANNEL,
    CHUNK_INDEX,
    DATA_END,
    DATA_END_SIZE,
    FOOTER,
    FOOTER_SIZE,
    SCHEMA,
    STATISTICS,
    McapChannel,
    Schema,
    parse_channel,
    parse_chunk_place,
    parse_footer,
    parse_schema,
    parse_since,
    parse_statistics,
)
from kempf.pipeline.ingest.mcap.container.walk import HEAD, walk
from kempf.pipeline.ingest.sniff import MCAP_MAGIC
from kempf.pipeline.ingest.spans import as_bytes

#: Largest summary that is read, bytes.
SUMMARY_LIMIT = 256 << 20


@dataclass
class Summary:
    """What the end of the file says."""

    #: Whether the file ends with footer and magic, as a file that was closed does.
    ended: bool
    #: Where the data section ends at the latest, its last record included.
    stop: int
    channels: dict[int, McapChannel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    #: Where chunks stand and their bytes, ascending.
    chunks: list[tuple[int, int]] = field(default_factory=list)
    #: messages, chunk_count: How many the file should hold.
    messages: int | None = None
    chunk_count: int | None = None
    #: Earliest log time, ns.
    since_ns: int | None = None
    #: CRC of the data section, 0 for none; `data_end` is where its record stands.
    data_crc: int = 0
    data_end: int = -1
    #: Whether it stands where the footer says, right behind the data section, and ends with the file.
    stands_right: bool = False
    notes: list[str] = field(default_factory=list)


def read_summary(log: LogFile) -> Summary:
    """Read the end of an MCAP file.

    Returns
    -------
    Summary
        Empty where the file is cut or its summary is damaged.
    """
    place = log.size - len(MCAP_MAGIC) - FOOTER_SIZE - HEAD
    tail = log.read(place, HEAD + FOOTER_SIZE + len(MCAP_MAGIC)) if place >= len(MCAP_MAGIC) else b""
    footer = parse_footer(tail[HEAD:]) if tail.endswith(MCAP_MAGIC) and tail[0] == FOOTER else None
    if footer is None or struct.unpack_from("<Q", tail, 1)[0] != FOOTER_SIZE:
        return Summary(ended=False, stop=log.size)
    summary = Summary(ended=True, stop=place)
    if footer.summary_start == 0:
        _note_data_end(log, summary, place)
        return summary
    length = place - footer.summary_start
    if not (0 <= length <= SUMMARY_LIMIT and footer.summary_start >= len(MCAP_MAGIC)):
        summary.notes.append("The footer of the file points nowhere: its summary was not used.")
        return summary
    content = log.read(footer.summary_start, length)
    _note_data_end(log, summary, footer.summary_start)
    # the CRC covers the summary and the footer up to the CRC itself
    if footer.summary_crc and zlib.crc32(tail[: HEAD + 16], zlib.crc32(content)) != footer.summary_crc:
        summary.notes.append("The CRC of the file's summary does not match: its summary was not used.")
        return summary
    summary.stop = footer.summary_start
    _take(summary, content)
    summary.stands_right = summary.data_end >= 0 and not summary.notes
    return summary


def _note_data_end(log: LogFile, summary: Summary, behind: int) -> None:
    """Look at the record in front of the summary, which ends the data section."""
    place = behind - HEAD - DATA_END_SIZE
    record = log.read(place, HEAD + DATA_END_SIZE) if place >= len(MCAP_MAGIC) else b""
    if len(record) == HEAD + DATA_END_SIZE and record[0] == DATA_END:
        size, crc = struct.unpack_from("<QI", record, 1)
        if size == DATA_END_SIZE:
            summary.data_end, summary.data_crc = place, crc


def _take(summary: Summary, content: bytes) -> None:
    opcode, first, end, reached = walk(as_bytes(content), 0, len(content))
    if reached < len(content):
        summary.notes.append("The summary of the file is damaged: what is whole of it was used.")
    for kind, at, to in zip(opcode.tolist(), first.tolist(), end.tolist(), strict=True):
        record = content[at:to]
        if kind == CHANNEL and (channel := parse_channel(record)):
            summary.channels.setdefault(*channel)
        elif kind == SCHEMA and (schema := parse_schema(record)):
            summary.schemas.setdefault(*schema)
        elif kind == CHUNK_INDEX and (chunk := parse_chunk_place(record)):
            summary.chunks.append(chunk)
        elif kind == STATISTICS:
            summary.messages, summary.chunk_count = parse_statistics(record)
            summary.since_ns = parse_since(record)
    summary.chunks = sorted(
        {(at, size) for at, size in summary.chunks if len(MCAP_MAGIC) <= at and at + size <= summary.stop}
    )
