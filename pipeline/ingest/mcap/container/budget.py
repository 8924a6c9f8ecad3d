"""How much an MCAP log may unpack to: a bound against a small file that holds a huge one.

Chunks are unpacked one at a time and each is bounded, so that no more than one is in memory; what a bound on the whole
log protects is time. Messages that nobody asks for cost their unpacking only. A camera that sees nothing, or a map that
is empty, packs by a factor of thousands and is no attack, so that they have a wide bound; messages that are decoded
have that of any other log.
"""

from __future__ import annotations

from kempf.pipeline.ingest.unpack import allowance, too_large, too_many
from kempf.schemas.errors import DataRejected

#: Bytes to which all chunks together may unpack, and so many more for each byte that was delivered: some seconds of
#: unpacking, or some for every few megabytes of the file.
_BASE, _RATIO = 4 << 30, 2_000


class Budget:
    """What is left of the bytes and records that one log may hold.

    Parameters
    ----------
    name : str
        Name of the log, for messages.
    delivered : int
        Its bytes as they were delivered.
    """

    def __init__(self, name: str, delivered: int) -> None:
        self._name = name
        self._most_decoded, self._most_records = allowance(delivered)
        self._most = max(_BASE + _RATIO * delivered, self._most_decoded)
        self._unpacked = self._decoded = self._records = 0

    def unpack(self, size: int, records: int) -> None:
        """Take note of content, in bytes, and of the messages in it.

        Raises
        ------
        DataRejected
            ``log_too_large``, ``too_many_records``.
        """
        self._unpacked += size
        self._records += records
        if self._unpacked > self._most:
            raise _stuffed(self._name, self._most)
        if self._records > self._most_records:
            raise too_many(self._name, self._most_records)

    def decode(self, size: int) -> None:
        """Take note of payloads, in bytes, that are decoded.

        Raises
        ------
        DataRejected
            ``log_too_large``.
        """
        self._decoded += size
        if self._decoded > self._most_decoded:
            raise too_large(self._name, self._most_decoded)


def _stuffed(name: str, limit: int) -> DataRejected:
    return DataRejected(
        "log_too_large",
        f"{name} unpacks to more than {limit} bytes, far more than a log of its size holds.",
        "See with `mcap info` which of its topics are so many, such as images, and take them out with `mcap filter`; "
        "or split the log into shorter ones.",
        {"name": name, "limit_bytes": limit},
    )
