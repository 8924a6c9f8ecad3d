"""The checksum of NMEA 0183, of sentences and of TAG blocks alike."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import Flag
from kempf.pipeline.ingest.spans import Bytes, Index

_HEX = np.full(256, -1, dtype=np.int16)
_HEX[48:58], _HEX[65:71], _HEX[97:103] = np.arange(10), np.arange(10, 16), np.arange(10, 16)


def checksum_right(buffer: Bytes, prefix: Bytes, first: Index, star: Index) -> Flag:
    """Tell which stretches are followed by their own checksum.

    The exclusive or of a stretch is that of the prefixes at its two ends, so one pass over the buffer serves
    every line.

    Parameters
    ----------
    buffer : ndarray of uint8
    prefix : ndarray of uint8
        Exclusive or of the bytes up to each place.
    first, star : ndarray of int64, shape (n,)
        Places of the byte before the stretch and of the ``*`` behind it.

    Returns
    -------
    ndarray of bool, shape (n,)

    References
    ----------
    IEC 61162-1:2016, 7.2.3.7.
    """
    if buffer.size == 0:
        return np.zeros(first.shape, dtype=np.bool_)
    last = buffer.size - 1
    own = prefix[np.maximum(star - 1, 0)] ^ prefix[first]
    high, low = _HEX[buffer[np.minimum(star + 1, last)]], _HEX[buffer[np.minimum(star + 2, last)]]
    right: Flag = (star > first) & (high >= 0) & (low >= 0) & (own == high * 16 + low)
    return right
