"""A log as it is read: by place, a piece at a time, whether it lies in memory or on a disk.

Opening files is not done here; who opened one hands it in.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cached_property
from io import BytesIO
from typing import BinaryIO

from kempf.schemas.errors import KempfError

_PIECE = 4 << 20


class LogFile:
    """The bytes of one log.

    Parameters
    ----------
    log : bytes or binary file
        A file must be able to seek; it stays open, and whoever opened it closes it. What is written behind its end
        from now on is not seen.
    """

    def __init__(self, log: bytes | BinaryIO) -> None:
        self._stream = BytesIO(log) if isinstance(log, bytes) else log
        self.size = self._stream.seek(0, 2)

    def read(self, at: int, length: int) -> bytes:
        """Return ``length`` bytes from place ``at`` on, fewer where the log ends before.

        Raises
        ------
        KempfError
            ``log_unreadable``: the disk, or the store behind it, does not give them.
        """
        if at >= self.size or length <= 0:
            return b""
        try:
            self._stream.seek(at)
            return self._stream.read(min(length, self.size - at))
        except OSError as error:
            raise KempfError(
                "log_unreadable",
                f"Reading the log failed at byte {at} of {self.size}: {error.strerror or error}.",
                "Copy the file from the logger again, to another disk.",
                {"at": at, "size_bytes": self.size},
            ) from error

    def whole(self) -> bytes:
        """Return all bytes."""
        return self.read(0, self.size)

    def pieces(self, start: int = 0, stop: int | None = None) -> Iterator[bytes]:
        """Yield the bytes between two places, all of them where none is given, a few megabytes at a time."""
        end = self.size if stop is None else stop
        for at in range(start, end, _PIECE):
            yield self.read(at, min(_PIECE, end - at))

    def part(self, start: int, stop: int) -> LogFile:
        """Return the bytes between two places as a log of its own, which reads from this one."""
        return self if (start, stop) == (0, self.size) else _LogPart(self, start, stop)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the bytes as they were when it was first asked for, 64 hex digits."""
        digest = hashlib.sha256()
        for piece in self.pieces():
            digest.update(piece)
        return digest.hexdigest()


class _LogPart(LogFile):
    """Some bytes of a log that follow each other."""

    def __init__(self, log: LogFile, start: int, stop: int) -> None:
        self._log, self._start = log, start
        self.size = min(stop, log.size) - start

    def read(self, at: int, length: int) -> bytes:
        return self._log.read(self._start + at, min(length, self.size - at)) if at < self.size else b""
