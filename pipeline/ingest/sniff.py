"""Which format a log has, by its content and not by its name."""

from __future__ import annotations

import json
import re
from typing import Literal

Format = Literal["delimited", "mcap", "nmea"]

MCAP_MAGIC = b"\x89MCAP0\r\n"

#: NUL bytes in a row that a logger left behind that lost its power; fewer are binary data.
_LEFT_BEHIND = re.compile(rb"\0{16,}")

#: Bytes of the file that are looked at.
SAMPLE = 1 << 16

#: Share of the lines that look like sentences from which a text is an NMEA log.
_SHARE = 0.5

_SENTENCE = re.compile(rb"^[^$!\\]{0,48}(?:\\[^\\]*\\)?[$!][A-Z0-9]{3,}[,*]|^#[A-Z]{5},.*\*[0-9A-F]{2}\s*$")

_BOUNDARIES = (",", ";", "\t")


def sniff(data: bytes) -> Format | None:
    """Return the format of a log, None where it is neither MCAP, nor NMEA, nor text.

    Parameters
    ----------
    data : bytes
        Unpacked content, or its first `SAMPLE` bytes; text not in UTF-16.
    """
    if data.startswith(MCAP_MAGIC):
        return "mcap"
    lines = [line for line in re.split(rb"[\r\n]", data[:SAMPLE]) if line.strip()]
    if lines and sum(bool(_SENTENCE.match(line.lstrip(b"\0"))) for line in lines) >= _SHARE * len(lines):
        return "nmea"
    sample = _LEFT_BEHIND.sub(b"", data[:SAMPLE].replace(b"\xef\xbb\xbf", b"", 1))
    odd = sum(byte < 9 or 13 < byte < 32 or byte == 127 for byte in sample)
    if sample.strip() and odd <= len(sample) // 1000:
        return "delimited"
    return None


def is_json(data: bytes) -> bool:
    """Return whether a text is one JSON object or list, or one a line: no columns of a log.

    Parameters
    ----------
    data : bytes
        Whole.
    """
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] not in (b"{", b"["):
        return False
    for text in (data.lstrip().partition(b"\n")[0], data):
        try:
            return isinstance(json.loads(text), dict | list)
        except (ValueError, RecursionError):
            continue
    return False


def separator_of(line: str) -> str | None:
    """Return the sign that separates the cells of a line: the most frequent of comma, semicolon and tab, None for none.

    What stands between quotation marks counts where nothing else does.

    Examples
    --------
    >>> separator_of('time;"depth, below, keel"')
    ';'
    """
    bare = re.sub(r'"[^"]*"', "", line)
    counted = bare if any(sign in bare for sign in _BOUNDARIES) else line
    counts = {sign: counted.count(sign) for sign in _BOUNDARIES}
    best = max(_BOUNDARIES, key=lambda sign: counts[sign])
    return best if counts[best] else None
