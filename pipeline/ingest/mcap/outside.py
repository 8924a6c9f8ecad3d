"""Where chunks may begin in a file that no summary describes, and whether messages outside of them can be believed.

A message outside a chunk has no checksum. In a damaged file of chunks such a message is most likely one of a chunk: the
record that hides the chunk's beginning, or the chunk's own, says a wrong length and ends between two messages.

References
----------
MCAP specification, https://mcap.dev/spec, "Data Section".
"""

from __future__ import annotations

import zlib

from pipeline.ingest.log_file import LogFile
from pipeline.ingest.mcap.summary import Summary
from pipeline.ingest.mcap.walk import chunk_after
from pipeline.ingest.sniff import MCAP_MAGIC
from pipeline.ingest.spans import as_bytes

#: Bytes that are read at once: few at first, where the next chunk may be near, then more.
_FIRST, _MOST = 1 << 14, 4 << 20

#: Bytes of a chunk's head that tell it for one.
_CHUNK_HEAD = 64


def chunk_behind(log: LogFile, at: int, stop: int) -> int:
    """Return the first place from ``at`` on at which a chunk may begin, -1 where there is none before ``stop``."""
    window = _FIRST
    while at < stop:
        data = log.read(at, min(window, stop - at))
        hit = chunk_after(as_bytes(data), stop - at)
        if hit >= 0:
            return at + hit
        if at + len(data) >= stop:
            break
        at += len(data) - _CHUNK_HEAD
        window = min(2 * window, _MOST)
    return -1


def believed(log: LogFile, summary: Summary) -> bool:
    """Tell whether messages outside chunks are what was written there.

    They are where the summary lists the chunks, so that none is stepped over unseen; where there are no chunks; and
    where the CRC of the whole data section is right.

    Parameters
    ----------
    log : LogFile
    summary : Summary
        Of that file.
    """
    if summary.chunks or summary.chunk_count == 0 or chunk_behind(log, len(MCAP_MAGIC), summary.stop) < 0:
        return True
    return bool(summary.data_crc) and _crc(log, summary.data_end) == summary.data_crc


def _crc(log: LogFile, stop: int) -> int:
    crc = 0
    for at in range(0, stop, _MOST):
        crc = zlib.crc32(log.read(at, min(_MOST, stop - at)), crc)
    return crc
