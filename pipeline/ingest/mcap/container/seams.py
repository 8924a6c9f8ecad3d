"""Where one MCAP file ends and another begins, in a log of several behind each other.

References
----------
MCAP specification, https://mcap.dev/spec, "File Structure", "Footer (op=0x02)".
"""

from __future__ import annotations

import struct

import numpy as np

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.records import ATTACHMENT, FOOTER, FOOTER_SIZE, HEADER
from kempf.pipeline.ingest.mcap.container.summary import read_summary
from kempf.pipeline.ingest.mcap.container.unchunked import WINDOW, attachment_is_whole
from kempf.pipeline.ingest.mcap.container.walk import HEAD, walk
from kempf.pipeline.ingest.sniff import MCAP_MAGIC
from kempf.pipeline.ingest.spans import as_bytes

_FOOTER_HEAD = struct.pack("<BQ", FOOTER, FOOTER_SIZE)
#: Bytes of the footer and the magic behind it, with which a file is closed.
_CLOSING = HEAD + FOOTER_SIZE + len(MCAP_MAGIC)

#: Longest header of a file, which names its profile and the library that wrote it, bytes.
_LONGEST_HEADER = 1 << 16

#: Files that are read of one log; a recorder that splits every minute writes as many in a day.
_MOST_FILES = 1_440


def places_of_files(log: LogFile) -> list[tuple[int, int]]:
    """Return where the files of a log begin and end; one, as a rule.

    The log is looked through only where the summary at its end is not that of one file from the first byte on.

    Parameters
    ----------
    log : LogFile

    Returns
    -------
    list of (int, int)
        Behind each other from the first byte to the last. What stands behind the end of the last file is taken for
        part of it.
    """
    if read_summary(log).stands_right:
        return [(0, log.size)]
    begins = [0]
    at, overlap = 1, len(MCAP_MAGIC) - 1
    while at < log.size:
        data = log.read(at, WINDOW + overlap)
        hit = data.find(MCAP_MAGIC)
        while hit >= 0:
            if len(begins) == _MOST_FILES:
                return list(zip(begins, [*begins[1:], log.size], strict=True))
            if _begins_file(log, begins[-1], at + hit):
                begins.append(at + hit)
            hit = data.find(MCAP_MAGIC, hit + 1)
        at += WINDOW
    return list(zip(begins, [*begins[1:], log.size], strict=True))


def _begins_file(log: LogFile, before: int, at: int) -> bool:
    """Return whether a file begins with the magic bytes at a place: behind one that was closed, or that was cut.

    Parameters
    ----------
    before : int
        Where the file before it begins.
    """
    head = log.read(at + len(MCAP_MAGIC), HEAD + 4)
    if len(head) < HEAD + 4 or head[0] != HEADER:
        return False
    length, profile = struct.unpack_from("<QI", head, 1)
    if not profile + 8 <= length <= _LONGEST_HEADER:
        return False
    closing = log.read(max(at - _CLOSING, 0), _CLOSING)
    if closing.startswith(_FOOTER_HEAD) and closing.endswith(MCAP_MAGIC):
        return True
    return not _is_attached(log, before + len(MCAP_MAGIC), at)


def _is_attached(log: LogFile, start: int, at: int) -> bool:
    """Return whether a place lies in the content of an attachment, which may be any file.

    Parameters
    ----------
    start : int
        A record of the file before it.
    """
    while start < at:
        data = log.read(start, WINDOW)
        opcode, first, end, reached = walk(as_bytes(data), 0, len(data))
        if reached == 0:
            if len(data) < HEAD:
                return False
            reached = HEAD + int.from_bytes(data[1:HEAD], "little")
            opcode, first, end = np.array([data[0]], dtype=np.uint8), np.array([HEAD]), np.array([reached])
        own = np.flatnonzero((start + first <= at) & (at < start + end))
        if own.size:
            record = int(own[0])
            place = start + int(first[record]), start + int(end[record])
            return int(opcode[record]) == ATTACHMENT and attachment_is_whole(log, *place, without_crc=True)
        start += reached
    return False


def end_of_file(log: LogFile, at: int) -> int | None:
    """Return the place behind the end of the file whose data section ends, None where its end is not whole.

    Parameters
    ----------
    at : int
        Behind the last record of the data section.
    """
    while at < log.size:
        data = log.read(at, WINDOW)
        opcode, first, end, reached = walk(as_bytes(data), 0, len(data))
        footer = np.flatnonzero((opcode == FOOTER) & (end - first == FOOTER_SIZE))
        if footer.size:
            behind = at + int(end[footer[0]])
            return behind + len(MCAP_MAGIC) if log.read(behind, len(MCAP_MAGIC)) == MCAP_MAGIC else None
        if reached == 0:
            if len(data) < HEAD:
                return None
            reached = HEAD + int.from_bytes(data[1:HEAD], "little")
        at += reached
    return None
