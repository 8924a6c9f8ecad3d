"""The encoding of text: UTF-16 recognised by its bytes, any other as the profile names it; read on as UTF-8."""

from __future__ import annotations

import codecs

from kempf.schemas.errors import UsageError

#: Share of every other byte that is NUL in UTF-16, and at most in between: text of a log is ASCII but for a few names.
_MOST, _FEW = 0.9, 0.01

#: Bytes by which that is judged, at least.
_FEWEST = 32


def utf16_of(sample: bytes) -> str | None:
    """Return which UTF-16 the bytes are, as Python names it; None for any other encoding.

    Parameters
    ----------
    sample : bytes
        The beginning of a file.

    Examples
    --------
    >>> utf16_of("time,heading".encode("utf-16"))
    'utf-16'
    """
    if sample.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        # the mark of UTF-32 begins with that of UTF-16
        return None if sample.startswith(codecs.BOM_UTF32_LE) else "utf-16"
    half = len(sample) // 2
    if 2 * half < _FEWEST:
        return None
    even, odd = (sample[k : 2 * half : 2].count(0) for k in (0, 1))
    if odd >= _MOST * half and even <= _FEW * half:
        return "utf-16-le"
    if even >= _MOST * half and odd <= _FEW * half:
        return "utf-16-be"
    return None


def as_utf8(data: bytes, encoding: str) -> bytes:
    """Return text in UTF-8 without a byte-order mark; what the encoding does not have becomes U+FFFD.

    Raises
    ------
    UsageError
        ``unknown_encoding``: Python does not know it.
    """
    try:
        codec = codecs.lookup(encoding).name
        if codec != "utf-8":
            data = data.decode(encoding, errors="replace").encode("utf-8")
    except (LookupError, TypeError, ValueError) as error:
        raise UsageError(
            "unknown_encoding",
            f"The profile's encoding {encoding!r} cannot be used: {error}.",
            "Write one that Python knows, such as utf-8, cp1252 or utf-16.",
            {"encoding": encoding},
        ) from error
    return data.removeprefix(codecs.BOM_UTF8)


def advice_on(names: list[str], encoding: str) -> str:
    """Return what to do where names of columns are not in the encoding by which they were read; else nothing.

    Examples
    --------
    >>> advice_on(["Kurs [\ufffd]"], "ascii")[:27]
    'The names are not in ascii:'
    """
    if not any("\ufffd" in name for name in names):
        return ""
    step = "correct `encoding` in the profile's source, or leave it out where the log is in UTF-8. "
    if codecs.lookup(encoding).name == "utf-8":
        encoding = "UTF-8"
        step = "write `encoding: latin-1`, or what the logger uses, into the profile's source. "
    return f"The names are not in {encoding}: {step}"
