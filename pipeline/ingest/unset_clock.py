"""Logs of 1970: the clock was never set, or counts from the moment at which the logger was switched on.

Such a log is whole but for the date, and is taken as it is; one that says a date later on is not of this kind, and what
came before the date is refused by the screen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Decoded, Flag, Nanoseconds
from kempf.pipeline.ingest.screen import CLOCK_FIRST_NS
from kempf.schemas.profile import TimeColumn, start_ns
from kempf.schemas.units import DAY_NS

#: What is taken for a count from 1970-01-01: a year, and a day before for times that run up to zero.
_FROM_NS, _TO_NS = -DAY_NS, 366 * DAY_NS

#: Rows of text closer than this in the mean, ns: the time is not in the unit that the profile names.
_CLOSEST_NS = 200_000
#: ... of so many at least.
_FEWEST = 20

#: One of so many times may be damaged.
_DAMAGED = 100

_NOTE = (
    "The times are of 1970: the logger's clock was not set, or counts from when it was switched on. They stay, and the "
    "log is listed in 1970; what another such log holds at the same time is another manoeuvre. To give the date, write "
    "the instant of the clock's zero into the profile's source, such as time: {start: 2025-05-03T06:00:00Z}, beside "
    "the column and its unit where there are any."
)


@dataclass(frozen=True, eq=False)
class Dated:
    """A log with the times that are taken for its own."""

    #: In the order of the log.
    parts: Iterator[Decoded]
    #: Earliest time that is taken for one, UTC nanoseconds.
    first_ns: int
    #: What a person should know.
    notes: tuple[str, ...] = ()


def dated_parts(decoding: Callable[[], Iterator[Decoded]], time: TimeColumn | None) -> Dated:
    """Return the parts of a log, and from when on its times count.

    Parameters
    ----------
    decoding : callable
        Begins to decode the log; is called again where its first part does not tell.
    time : TimeColumn or None
        Of the profile. Times of 1970 are counted from its start.
    """
    stated = start_ns(time.start) if time is not None and time.start is not None else None
    # a start that the profile states is no clock that was not set
    earliest = CLOCK_FIRST_NS if stated is None else min(CLOCK_FIRST_NS, stated - DAY_NS)
    parts = decoding()
    first = next(parts)
    begun = chain([first], parts)
    # the log is decoded a second time only where its first part does not decide
    if not _of_1970(chain([first], islice(decoding(), 1, None))) or (first.ends and _too_close(first)):
        return Dated(begun, earliest)
    if stated is not None and stated >= _TO_NS:
        return Dated(
            (_counted_from(part, stated) for part in begun),
            earliest,
            ("The logger's clock counts from 1970: its times are counted from the start that the profile states.",),
        )
    return Dated((_counted_from(part, 0) for part in begun), _FROM_NS, (_NOTE,))


def _of_1970(parts: Iterator[Decoded]) -> bool:
    """Return whether all times of a log are of 1970, but for damaged ones; the first part with another decides."""
    inside = outside = 0
    for part in parts:
        time = part.time_utc_ns[part.time_utc_ns != NO_TIME]
        within = int(np.sum(_within(time)))
        inside, outside = inside + within, outside + time.size - within
        if outside > max(inside, len(part)) // _DAMAGED:
            return False
    return inside > 0 and outside <= inside // _DAMAGED


def _within(time: Nanoseconds) -> Flag:
    return (time >= _FROM_NS) & (time < _TO_NS)


def _too_close(part: Decoded) -> bool:
    """Return whether the rows of a log that comes in one part are closer than those of any logger."""
    time = part.time_utc_ns[_within(part.time_utc_ns)]
    return time.size >= _FEWEST and float(np.ptp(time)) < _CLOSEST_NS * (time.size - 1)


def _counted_from(part: Decoded, start: int) -> Decoded:
    """Return a part with its times counted from a start; damaged ones are none."""
    within = _within(part.time_utc_ns)
    return replace(part, time_utc_ns=np.where(within, part.time_utc_ns + np.where(within, start, 0), NO_TIME))
