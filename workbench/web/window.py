"""The stretch of time that a page shows, as it stands in its address."""

from __future__ import annotations

from contextlib import suppress

from kempf.schemas.errors import UsageError
from kempf.workbench.instants import utc_ns_of


def instant(text: str) -> int:
    """Return an instant of an address as UTC nanoseconds; without a zone it is UTC.

    Raises
    ------
    UsageError
        ``instant_unreadable``.

    Examples
    --------
    >>> instant("2025-05-03T07:47:01.5Z")
    1746258421500000000
    >>> instant("2025-05-03T09:47:01.5+02:00")
    1746258421500000000
    """
    utc_ns = None
    with suppress(UsageError):
        utc_ns = utc_ns_of(text, "the address")
    # beyond what 64 bits hold lies no log
    if utc_ns is None or abs(utc_ns) >= 2**63:
        raise UsageError(
            "instant_unreadable",
            f"{text[:60]!r} is no instant; expected UTC as 2025-05-03T07:47:01.5Z.",
            "Take the times out of the address to see everything.",
        )
    return utc_ns


def window(asked_from: str | None, asked_to: str | None, start_utc_ns: int, end_utc_ns: int) -> tuple[int, int]:
    """Return the window that is asked for, within that of all there is.

    Raises
    ------
    UsageError
        ``instant_unreadable``; ``window_empty``.
    """
    begin = start_utc_ns if asked_from is None else instant(asked_from)
    end = end_utc_ns if asked_to is None else instant(asked_to)
    if end <= begin:
        raise UsageError(
            "window_empty",
            f"The window ends at {asked_to} and begins at {asked_from or 'the beginning'}: it holds nothing.",
            "Give a later end, or take the times out of the address to see everything.",
        )
    return begin, end
