"""Compressed logs, known by their first bytes and unpacked within a bound."""

from __future__ import annotations

import zlib

from kempf.schemas.errors import DataRejected

GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"

#: Largest log that is unpacked, bytes: a bound against a small file that holds a huge one.
LIMIT = 512 << 20

#: A log may unpack to so many bytes, and to so many more for each byte that was delivered.
_BASE, _RATIO = 24 << 20, 100

#: It may hold so many records, or so many for each byte that was delivered.
_RECORDS, _RECORDS_A_BYTE = 1_000_000, 4

#: Compressed bytes that are unpacked at once: few at first, for a file of many small members, and with zstd never many,
#: for 4 bytes of it may stand for 128 kB.
_FIRST_STEP, _GZIP_STEP, _ZSTD_STEP = 256, 1 << 18, 1 << 12


def unpack(name: str, data: bytes, limit: int = LIMIT) -> tuple[bytes, list[str]]:
    """Return the content of a gzip or zstd file, and any other file as it is.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    limit : int
        Most bytes that are unpacked, whatever the size of the file; `allowance` may be less.

    Returns
    -------
    data : bytes
    notes : list of str
        Says where a file ends before its compression does; what was whole is kept.

    Raises
    ------
    DataRejected
        The compression is damaged (``damaged_gzip``, ``damaged_zstd``), or holds far more than a log of its size does
        (``log_too_large``, ``too_many_records``).
    """
    most, records = allowance(len(data))
    if data.startswith(GZIP):
        content, notes = _gzip(name, data, min(limit, most))
    elif data.startswith(ZSTD) or _skippable(data):
        content, notes = _zstd(name, data, min(limit, most))
    else:
        return data, []
    if content.count(b"\n") > records:
        raise too_many(name, records)
    return content, notes


def allowance(delivered: int) -> tuple[int, int]:
    """Return to how many bytes, and to how many records, a log may unpack that was delivered in so many bytes.

    Logs of ships that move unpack to 5 to 30 times their size and hold a record for every 4 bytes or more. Where
    nothing changes, at berth, it is a record a byte or more; a day at 10 Hz of that has to fit.
    """
    return _BASE + _RATIO * delivered, max(_RECORDS, _RECORDS_A_BYTE * delivered)


def _gzip(name: str, data: bytes, limit: int) -> tuple[bytes, list[str]]:
    parts: list[bytes] = []
    at, left = 0, limit
    while data.startswith(GZIP, at):
        member, step = zlib.decompressobj(wbits=31), _FIRST_STEP
        while not member.eof and at < len(data):
            piece = data[at : at + step]
            try:
                parts.append(member.decompress(piece, left + 1))
            except zlib.error as error:
                raise _damaged(name, "gzip", str(error)) from error
            left -= len(parts[-1])
            if left < 0:
                raise too_large(name, limit)
            at += len(piece) - len(member.unused_data)
            step = min(2 * step, _GZIP_STEP)
        if not member.eof:
            return b"".join(parts), ["The gzip file is cut short: what could be unpacked was read."]
        at = _behind_zeros(data, at)  # a tape or a copier may pad a member with zeros
    return b"".join(parts), _rest("gzip", data, at)


def _zstd(name: str, data: bytes, limit: int) -> tuple[bytes, list[str]]:
    import zstandard

    parts: list[bytes] = []
    at, left = 0, limit
    while data.startswith(ZSTD, at) or _skippable(data[at : at + 8]):
        if length := _skippable(data[at : at + 8]):
            at += length
            continue
        # the reader stops without a word at a cut: whether the frame is whole is known by the object below
        frame, step = zstandard.ZstdDecompressor().decompressobj(), _FIRST_STEP
        while not frame.eof and at < len(data):
            piece = data[at : at + step]
            try:
                parts.append(frame.decompress(piece))
            except zstandard.ZstdError as error:
                raise _damaged(name, "zstd", str(error)) from error
            left -= len(parts[-1])
            if left < 0:
                raise too_large(name, limit)
            at += len(piece) - len(frame.unused_data)
            step = min(2 * step, _ZSTD_STEP)
        if not frame.eof:
            return b"".join(parts), ["The zstd file is cut short: what could be unpacked was read."]
    return b"".join(parts), _rest("zstd", data, at)


def _behind_zeros(data: bytes, at: int) -> int:
    """Return the first place from ``at`` on that is no zero byte, the end where there is none."""
    while at < len(data) and data[at] == 0:
        piece = data[at : at + _GZIP_STEP]
        at += len(piece) - len(piece.lstrip(b"\0"))
    return at


def _rest(kind: str, data: bytes, at: int) -> list[str]:
    """Note bytes behind the compressed data."""
    if _behind_zeros(data, at) >= len(data):
        return []
    return [f"{len(data) - at} bytes behind the end of the {kind} data were left out."]


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


def too_large(name: str, limit: int) -> DataRejected:
    """Return the error of a log that unpacks to too many bytes."""
    return DataRejected(
        "log_too_large",
        f"{name} unpacks to more than {limit} bytes, far more than a log of its size holds.",
        "Unpack it by hand and look at what it is; split a log that is so large into shorter ones, a day each.",
        {"name": name, "limit_bytes": limit},
    )


def too_many(name: str, limit: int) -> DataRejected:
    """Return the error of a log that unpacks to too many records."""
    return DataRejected(
        "too_many_records",
        f"{name} unpacks to more than {limit} records, far more than a log of its size holds.",
        "Unpack it by hand and look at what it is; split a log that is so large into shorter ones, a day each.",
        {"name": name, "limit_records": limit},
    )
