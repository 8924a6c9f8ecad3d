"""Where chunks may begin in a file that no summary describes, and whether messages outside of them can be believed.

A message outside a chunk has no checksum. In a damaged file of chunks such a message is most likely one of a chunk: the
record that hides the chunk's beginning, or the chunk's own, says a wrong length and ends between two messages.

References
----------
MCAP specification, https://mcap.dev/spec, "Data Section", "Attachment (op=0x09)".
"""

from __future__ import annotations

import struct
import zlib

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.records import ATTACHMENT, CHUNK, MESSAGE
from kempf.pipeline.ingest.mcap.container.summary import Summary
from kempf.pipeline.ingest.mcap.container.walk import HEAD, chunk_after
from kempf.pipeline.ingest.sniff import MCAP_MAGIC
from kempf.pipeline.ingest.spans import as_bytes

#: Bytes that are read at once, and of messages that are handed on together, unpacked; few are read at first behind
#: damage, where there may be more of it, or the next chunk near.
WINDOW, FIRST_WINDOW = 4 << 20, 1 << 14

#: Bytes of a chunk's head by which it is recognised.
_CHUNK_HEAD = 64

#: Most records in front of the first message or chunk, which describe what comes.
_MOST_RECORDS = 10_000


def chunk_behind(log: LogFile, at: int, stop: int, end: int) -> int:
    """Return the first place at which a chunk may begin, -1 where there is none.

    Parameters
    ----------
    at, stop : int
        Places that are looked at, the last one not.
    end : int
        Where the chunk has to end at the latest.
    """
    window = FIRST_WINDOW
    while at < stop:
        data = log.read(at, min(window, stop - at) + _CHUNK_HEAD)
        hit = chunk_after(as_bytes(data), end - at)
        if hit >= 0:
            return at + hit if at + hit < stop else -1
        at += min(window, stop - at)
        window = min(2 * window, WINDOW)
    return -1


def believed(log: LogFile, summary: Summary) -> bool:
    """Return whether messages outside chunks are what was written there.

    They are where the summary lists all chunks, so that none is stepped over unseen; where the file begins with
    messages, not with chunks, and none is hidden in what stands before; and where the CRC of the whole data section is
    right.

    Parameters
    ----------
    summary : Summary
        Of that file.
    """
    if summary.chunk_count == len(summary.chunks) or _begins_with_messages(log, summary.stop):
        return True
    return bool(summary.data_crc) and _crc(log, 0, summary.data_end) == summary.data_crc


def _begins_with_messages(log: LogFile, stop: int) -> bool:
    """Return whether messages come before any chunk, be it one in a record that says a wrong length."""
    at = len(MCAP_MAGIC)
    for _ in range(_MOST_RECORDS):
        head = log.read(at, HEAD)
        if len(head) < HEAD or head[0] in (MESSAGE, CHUNK):
            return len(head) == HEAD and head[0] == MESSAGE
        end = at + HEAD + int.from_bytes(head[1:], "little")
        if end > stop:
            return False
        # a file may be attached that has chunks of its own
        whole = head[0] == ATTACHMENT and attachment_is_whole(log, at + HEAD, end)
        if not whole and chunk_behind(log, at + HEAD, end, stop) >= 0:
            return False
        at = end
    return False


def attachment_is_whole(log: LogFile, first: int, end: int, *, without_crc: bool = False) -> bool:
    """Return whether the content of an attachment has a CRC that is right, or none where that is enough."""
    stored_crc = log.read(end - 4, 4) if end - first >= 4 else b""
    if stored_crc == bytes(4):
        return without_crc
    return stored_crc != b"" and _crc(log, first, end - 4) == struct.unpack("<I", stored_crc)[0]


def _crc(log: LogFile, first: int, end: int) -> int:
    crc = 0
    for piece in log.pieces(first, end):
        crc = zlib.crc32(piece, crc)
    return crc
