"""Instruments whose sentences have no checksum, or a wrong one, while the rest of the log is sound."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import Flag
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.spans import first_within
from kempf.schemas.enumeration import first_of

#: Share of an instrument's sentences from which it is the instrument, not the line, that damages them.
_MOST = 0.5

#: Addresses that a note names.
NAMED = 12


def unsummed_notes(frames: Frames, read: Flag) -> list[str]:
    """Return what a person should know of instruments of which most sentences lack their checksum.

    Parameters
    ----------
    read : ndarray of bool, shape (n,)
        Which sentences are of a type that is read.
    """
    refused = np.flatnonzero(read & ~frames.summed)
    if refused.size == 0:
        return []
    count = np.bincount(frames.address[read], minlength=len(frames.names))
    without = np.bincount(frames.address[refused], minlength=len(frames.names))
    refused = refused[(without > _MOST * count)[frames.address[refused]]]
    body = frames.body.take(refused)
    asterisk = first_within(np.flatnonzero(body.buffer == ord("*")), body.start, body.stop) >= 0
    notes = []
    for flag, lack in ((~asterisk, "no checksum"), (asterisk, "a wrong checksum")):
        at = refused[flag]
        if at.size:
            names = sorted(frames.names[code] for code in np.unique(frames.address[at]))
            notes.append(
                f"{at.size} sentences {first_of(names, NAMED)} have {lack} and were refused: a sentence counts only "
                "with its right checksum. Let the instrument or the logger write it."
            )
    return notes
