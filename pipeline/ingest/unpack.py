"""Compressed logs, told by their first bytes and unpacked within a bound."""

from __future__ import annotations

import zlib

from schemas.errors import DataRejected

GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"

#: Largest log that is unpacked, bytes: a bound against a small file that holds a huge one.
LIMIT = 512 << 20


def unpack(name: str, data: bytes, limit: int = LIMIT) -> tuple[bytes, list[str]]:
    """Return the content of a gzip or zstd file, and any other file as it is.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    data : bytes
    limit : int
        Most bytes that are unpacked.

    Returns
    -------
    data : bytes
    notes : list of str
        Says where a file ends before its compression does; what was whole is kept.

    Raises
    ------
    DataRejected
        The compression is damaged, or holds more than ``limit`` bytes.
    """
    if data.startswith(GZIP):
        return _gzip(name, data, limit)
    if data.startswith(ZSTD) or _skippable(data):
        return _zstd(name, data, limit)
    return data, []


def _gzip(name: str, data: bytes, limit: int) -> tuple[bytes, list[str]]:
    parts: list[bytes] = []
    size, notes = 0, []
    while data.startswith(GZIP):
        member = zlib.decompressobj(wbits=31)
        try:
            parts.append(member.decompress(data, limit - size + 1))
        except zlib.error as error:
            raise _damaged(name, "gzip", str(error)) from error
        size += len(parts[-1])
        if size > limit:
            raise _too_large(name, limit)
        if not member.eof:
            notes.append("The gzip file is cut short: what could be unpacked was read.")
            break
        # a tape or a copier may pad a member with zeros
        data = member.unused_data.lstrip(b"\0") if member.unused_data.startswith(b"\0") else member.unused_data
    else:
        if data.strip(b"\0"):
            notes.append(f"{len(data)} bytes behind the end of the gzip data were left out.")
    return b"".join(parts), notes


def _zstd(name: str, data: bytes, limit: int) -> tuple[bytes, list[str]]:
    import zstandard

    parts: list[bytes] = []
    size, notes = 0, []
    step = 1 << 24
    # the reader stops without a word at a cut: the frame is told whole by the object below
    while data.startswith(ZSTD) or _skippable(data):
        if length := _skippable(data):
            data = data[length:]
            continue
        frame = zstandard.ZstdDecompressor().decompressobj()
        try:
            for first in range(0, len(data), step // 64):
                parts.append(frame.decompress(data[first : first + step // 64]))
                size += len(parts[-1])
                if size > limit:
                    raise _too_large(name, limit)
                if frame.eof:
                    data = frame.unused_data + data[first + step // 64 :]
                    break
        except zstandard.ZstdError as error:
            raise _damaged(name, "zstd", str(error)) from error
        if not frame.eof:
            notes.append("The zstd file is cut short: what could be unpacked was read.")
            break
    else:
        if data.strip(b"\0"):
            notes.append(f"{len(data)} bytes behind the end of the zstd data were left out.")
    return b"".join(parts), notes


def _skippable(data: bytes) -> int:
    """Return the length of a skippable frame (RFC 8878, 3.1.2) at the beginning of the data, 0 where there is none."""
    if len(data) < 8 or data[1:4] != b"\x2a\x4d\x18" or data[0] >> 4 != 5:
        return 0
    return 8 + int.from_bytes(data[4:8], "little")


def _damaged(name: str, kind: str, why: str) -> DataRejected:
    return DataRejected(
        f"damaged_{kind}",
        f"{name} is a {kind} file whose content cannot be unpacked: {why}.",
        "Copy it again from the logger, or unpack what can be saved by hand and ingest that.",
        {"name": name},
    )


def _too_large(name: str, limit: int) -> DataRejected:
    return DataRejected(
        "log_too_large",
        f"{name} unpacks to more than {limit} bytes.",
        "Split the log into shorter ones, a day each for example.",
        {"name": name, "limit_bytes": limit},
    )
