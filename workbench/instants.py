"""Instants as a person writes them: ISO 8601, in UTC where no zone is said."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

from kempf.schemas.errors import UsageError
from kempf.schemas.units import DAY_NS, SECOND_NS

#: a fraction of a second, which datetime cuts to microseconds
_FRACTION = re.compile(r"(?<=:\d\d)[.,](\d{1,9})")
_DATE = re.compile(r"\d{4}-?\d{2}-?\d{2}")


def instant_of(text: str, option: str) -> datetime:
    """Return an instant.

    Parameters
    ----------
    text : str
        What was given.
    option : str
        Where it was given, such as an option, for the message.

    Raises
    ------
    UsageError
        ``not_a_time``.
    """
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo is not None else instant.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(
            "not_a_time",
            f"{option} {text!r} is no time; expected ISO 8601.",
            "Write it as 2025-05-03T12:00:00Z.",
        ) from error


def end_of(text: str, option: str) -> datetime:
    """Return an instant; where only a date is given, the last one of that day. See `instant_of`.

    Examples
    --------
    >>> end_of("2025-05-03", "--as-of").isoformat()
    '2025-05-03T23:59:59.999999+00:00'
    """
    instant = instant_of(text, option)
    # without passing through the day behind: the last day there is has none
    day = timedelta(hours=23, minutes=59, seconds=59, microseconds=999_999)
    return instant + day if _DATE.fullmatch(text.strip()) else instant


def utc_ns_of(text: str, option: str) -> int:
    """Return an instant in UTC nanoseconds, to the nanosecond as `kempf segments --json` prints it; see `instant_of`.

    Examples
    --------
    >>> utc_ns_of("2025-05-03T07:47:01.147000012Z", "--start")
    1746258421147000012
    """
    fraction = _FRACTION.search(text)
    whole = instant_of(text if fraction is None else text[: fraction.start()] + text[fraction.end() :], option)
    behind = 0 if fraction is None else int(fraction.group(1).ljust(9, "0"))
    # in whole numbers: a second of today in nanoseconds is more than a float holds
    since = whole - datetime(1970, 1, 1, tzinfo=UTC)
    return since.days * DAY_NS + since.seconds * SECOND_NS + since.microseconds * 1000 + behind
