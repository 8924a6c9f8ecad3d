"""Times of day and dates as NMEA sentences write them, and the dates of receivers whose count of weeks overflowed."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import NO_TIME, Flag, Nanoseconds
from kempf.pipeline.ingest.spans import Index
from kempf.pipeline.ingest.text.cells import (
    Cells,
    all_digits,
    eight_digits,
    first_digits,
    leading_digits,
    words,
)
from kempf.pipeline.ingest.text.iso_time import DAY_NS, SECOND_NS, days_since_1970

#: Two-digit years from here on are of the last century.
_CENTURY = 70

#: GPS counts weeks modulo 1024: a receiver that missed the overflow is so many days late (IS-GPS-200, 20.3.3.3.1.1).
ROLLOVER_NS = 1024 * 7 * DAY_NS

_POWER = 10 ** np.arange(10, dtype=np.int64)


def time_of_day(cells: Cells) -> Nanoseconds:
    """Read hhmmss.ss as nanoseconds of the day; `NO_TIME` where it is none.

    Parameters
    ----------
    cells : Cells, shape (n,)

    Returns
    -------
    ndarray of int64, shape (n,)
        Decimals of a second beyond the ninth are cut off.
    """
    value, good = _digits(cells, 6)
    length = cells.stop - cells.start
    size = max(cells.buffer.size - 1, 0)
    point = length > 6
    if point.any():
        good &= ~point | (cells.buffer[np.minimum(cells.start + 6, size)] == ord("."))
    early = words(cells.buffer, np.minimum(cells.start + 7, size + 1))
    told = np.clip(length - 7, 0, None)
    count = leading_digits(early)
    first = np.minimum(np.where(point, told, 0), 8)
    fraction = eight_digits(first_digits(early, np.minimum(first, count))) * _POWER[9 - first]
    long = np.flatnonzero(told > 8)
    if long.size:
        late = words(cells.buffer, np.minimum(cells.start[long] + 15, size + 1))
        count[long] += np.where(count[long] == 8, leading_digits(late), 0)
        fraction[long] += (late & np.uint64(0xFF)).astype(np.int64) - ord("0")
    good &= (told <= count) | ~point
    hours, minutes, seconds = value // 10_000, value // 100 % 100, value % 100
    # 60 is a leap second; it becomes the first of the next minute
    good &= (hours < 24) & (minutes < 60) & (seconds <= 60)
    return np.where(good, (hours * 3_600 + minutes * 60 + seconds) * SECOND_NS + fraction, NO_TIME)


def date(cells: Cells) -> Nanoseconds:
    """Read ddmmyy as nanoseconds of its midnight since 1970; `NO_TIME` where it is none."""
    value, good = _digits(cells, 6)
    good &= cells.stop - cells.start == 6
    # neighbours mostly share their day: each is read once
    heads = np.flatnonzero(np.diff(value, prepend=-1))
    often = np.diff(heads, append=value.size)
    value = value[heads]
    day, month, year = value // 10_000, value // 100 % 100, value % 100
    days, exists = days_since_1970(year + np.where(year >= _CENTURY, 1900, 2000), month, day)
    return np.where(good & np.repeat(exists, often), np.repeat(days * DAY_NS, often), NO_TIME)


def year_month_day(year: Cells, month: Cells, day: Cells) -> Nanoseconds:
    """Read the three fields of ZDA as nanoseconds of the midnight since 1970; `NO_TIME` where they are no date."""
    parts = [cells.number() for cells in (year, month, day)]
    known = np.isfinite(parts[0]) & np.isfinite(parts[1]) & np.isfinite(parts[2])
    whole = [np.where(known & (np.abs(part) < 10_000), part, 0).astype(np.int64) for part in parts]
    for part, integer in zip(parts, whole, strict=True):
        known &= part == integer
    known &= (whole[0] > 1900) & (whole[0] < 2200)
    days, exists = days_since_1970(*(np.where(known, integer, 1) for integer in whole))
    return np.where(known & exists, days * DAY_NS, NO_TIME)


def mend_rollover(full: Nanoseconds, dated: Flag, stamp: Nanoseconds) -> tuple[Nanoseconds, int]:
    """Put dates that are 1024 or 2048 weeks late where the log shows it.

    It shows it where the lines bear stamps of another clock, or where another receiver, or the same one at another
    instant, tells a date that is later by just that.

    Parameters
    ----------
    full : ndarray of int64, shape (n,)
        Instants that sentences tell with their date.
    dated : ndarray of bool, shape (n,)
        Which sentences do.
    stamp : ndarray of int64, shape (n,)
        Time of arrival, `NO_TIME` where there is none.

    Returns
    -------
    full : ndarray of int64, shape (n,)
    mended : int
        Number of sentences whose date was put right.
    """
    at = np.flatnonzero(dated)
    if at.size == 0:
        return full, 0
    own = full[at]
    known = stamp[at] != NO_TIME
    latest = own.max()
    reference = np.where(known, stamp[at], latest)
    # the stamps are minutes off at most; another receiver may tell its date at the other end of the log
    slack = np.where(known, DAY_NS, _LONGEST_LOG_NS)
    weeks = (reference - own + ROLLOVER_NS // 2) // ROLLOVER_NS
    late = (weeks > 0) & (np.abs(reference - own - weeks * ROLLOVER_NS) <= slack)
    if not late.any():
        return full, 0
    full = full.copy()
    full[at[late]] += weeks[late] * ROLLOVER_NS
    return full, int(np.sum(late))


#: A plain log that is longer than this is not looked at for late weeks of one of its receivers.
_LONGEST_LOG_NS = 14 * DAY_NS


def _digits(cells: Cells, count: int) -> tuple[Index, Flag]:
    """Read the first digits of each text."""
    word = first_digits(words(cells.buffer, cells.start), np.full(cells.start.shape, count))
    good = all_digits(word) & (cells.stop - cells.start >= count)
    return np.where(good, eight_digits(word), 0), good
