"""Instants as text: ISO 8601 in UTC for programs, minutes and seconds for a reader."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Literal

from kempf.schemas.units import MILLISECOND_NS, SECOND_NS


def iso_utc(time_utc_ns: int) -> str:
    """Return UTC nanoseconds as ISO 8601 text, to the microsecond, or the nanosecond where there is one.

    Examples
    --------
    >>> iso_utc(1_746_258_421_147_000_000)
    '2025-05-03T07:47:01.147000Z'
    """
    seconds, nanoseconds = divmod(time_utc_ns, SECOND_NS)
    digits = f"{nanoseconds:09d}"
    return f"{_to_the_second(seconds)}.{digits.removesuffix('000')}Z"


def iso_cut(time_utc_ns: int, unit: Literal["s", "ms"] = "ms") -> str:
    """Return UTC nanoseconds as ISO 8601 text, cut to a second or a millisecond.

    Examples
    --------
    >>> iso_cut(1_746_252_300_640_000_000), iso_cut(1_746_252_300_640_000_000, "s")
    ('2025-05-03T06:05:00.640Z', '2025-05-03T06:05:00Z')
    """
    seconds, nanoseconds = divmod(int(time_utc_ns), SECOND_NS)
    return f"{_to_the_second(seconds)}{f'.{nanoseconds // MILLISECOND_NS:03d}' if unit == 'ms' else ''}Z"


def written(time_utc_ns: int) -> str:
    """Return an instant to the second, for a sentence.

    Examples
    --------
    >>> written(1_746_252_300_640_000_000)
    '2025-05-03 06:05:00 UTC'
    """
    return f"{second(iso_cut(time_utc_ns, 's'))} UTC"


def minute(iso: str) -> str:
    """Return ISO 8601 text to the minute, as a page shows it.

    Examples
    --------
    >>> minute("2025-05-03T07:47:01.147000Z")
    '2025-05-03 07:47'
    """
    return iso[:16].replace("T", " ")


def second(iso: str) -> str:
    """Return ISO 8601 text to the second, as a page shows it.

    Examples
    --------
    >>> second("2025-05-03T07:47:01.147000Z")
    '2025-05-03 07:47:01'
    """
    return iso[:19].replace("T", " ")


def month_of(time_utc_ns: int) -> str:
    """Return the UTC month of an instant.

    Examples
    --------
    >>> month_of(1_746_258_421_147_000_000)
    '2025-05'
    """
    return datetime.fromtimestamp(time_utc_ns // SECOND_NS, UTC).strftime("%Y-%m")


def _to_the_second(seconds: int) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
