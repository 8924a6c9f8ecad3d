"""A log as it is read: by place, a piece at a time, whether it lies in memory or on a disk.

Opening files is not done here; who opened one hands it in.
"""

from __future__ import annotations

from io import BytesIO
from typing import BinaryIO


class LogFile:
    """The bytes of one log.

    Parameters
    ----------
    log : bytes or binary file
        A file must be able to seek; it stays open, and whoever opened it closes it.
    """

    def __init__(self, log: bytes | BinaryIO) -> None:
        self._stream = BytesIO(log) if isinstance(log, bytes) else log
        self.size = self._stream.seek(0, 2)

    def read(self, at: int, length: int) -> bytes:
        """Return ``length`` bytes from place ``at`` on, fewer where the log ends before."""
        if at >= self.size or length <= 0:
            return b""
        self._stream.seek(at)
        return self._stream.read(min(length, self.size - at))

    def whole(self) -> bytes:
        """Return all bytes."""
        return self.read(0, self.size)
