"""Instants as a person reads them."""

from __future__ import annotations

from datetime import UTC, datetime

_SECOND_NS = 1_000_000_000


def iso_utc(time_utc_ns: int) -> str:
    """Return UTC nanoseconds as ISO 8601 text, to the microsecond, or the nanosecond where there is one.

    Examples
    --------
    >>> iso_utc(1_746_258_421_147_000_000)
    '2025-05-03T07:47:01.147000Z'
    """
    seconds, nanoseconds = divmod(time_utc_ns, _SECOND_NS)
    digits = f"{nanoseconds:09d}"
    whole = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
    return f"{whole}.{digits.removesuffix('000')}Z"


def month_of(time_utc_ns: int) -> str:
    """Return the UTC month of an instant.

    Examples
    --------
    >>> month_of(1_746_258_421_147_000_000)
    '2025-05'
    """
    return datetime.fromtimestamp(time_utc_ns // _SECOND_NS, UTC).strftime("%Y-%m")
