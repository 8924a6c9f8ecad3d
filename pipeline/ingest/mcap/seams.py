"""Where one MCAP file ends and another begins, in a log of several behind each other.

References
----------
MCAP specification, https://mcap.dev/spec, "File Structure", "Footer (op=0x02)".
"""

from __future__ import annotations

import struct

import numpy as np

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.records import FOOTER, FOOTER_SIZE
from kempf.pipeline.ingest.mcap.summary import read_summary
from kempf.pipeline.ingest.mcap.unchunked import WINDOW
from kempf.pipeline.ingest.mcap.walk import HEAD, walk
from kempf.pipeline.ingest.sniff import MCAP_MAGIC
from kempf.pipeline.ingest.spans import as_bytes

#: The end of one file and the beginning of the next one, behind its last record.
_SEAM = MCAP_MAGIC * 2
_FOOTER_HEAD = struct.pack("<BQ", FOOTER, FOOTER_SIZE)

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
    at, overlap = 0, len(_SEAM) - 1
    while at < log.size and len(begins) < _MOST_FILES:
        data = log.read(at, WINDOW + overlap)
        hit = data.find(_SEAM)
        while hit >= 0 and len(begins) < _MOST_FILES:
            # a file that ends with its footer, and not the like in the payload of a message
            footer = log.read(max(at + hit - FOOTER_SIZE - HEAD, 0), HEAD)
            if footer == _FOOTER_HEAD:
                begins.append(at + hit + len(MCAP_MAGIC))
            hit = data.find(_SEAM, hit + 1)
        at += WINDOW
    return list(zip(begins, [*begins[1:], log.size], strict=True))


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
