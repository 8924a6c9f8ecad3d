"""Times in text, exact to the nanosecond: ISO 8601 instants, decimal numbers, hhmmss.ss and ddmmyy of NMEA."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation

import numpy as np
import polars as pl
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import NO_TIME, Flag, Nanoseconds
from kempf.pipeline.ingest.spans import Index, Spans
from kempf.pipeline.ingest.text.cells import (
    POWERS_OF_TEN,
    Cells,
    Word,
    all_digits,
    eight_digits,
    first_digits,
    leading_digits,
    words,
)
from kempf.schemas.units import DAY_NS, MILLISECOND_NS, SECOND_NS

#: Nanoseconds of every unit that a profile may give a time in.
NS_PER: Mapping[str, int] = {"s": SECOND_NS, "ms": MILLISECOND_NS, "us": 1_000, "ns": 1, "d": DAY_NS}

_MONTH_DAYS = np.array([0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])

#: Two-digit years from here on are of the last century.
CENTURY_FROM = 70

#: Decimal places of one nanosecond in each unit.
_PLACES = {"s": 9, "ms": 6, "us": 3, "ns": 0}

#: Decimal places of a day that are read, below a nanosecond.
_DAY_PLACES = 14

#: Largest count of nanoseconds that is taken for a time, about 290 years.
_LARGEST = 9_200_000_000_000_000_000


def days_since_1970(
    year: NDArray[np.int64], month: NDArray[np.int64], day: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the days from 1970-01-01 in the Gregorian calendar, and which dates exist.

    Parameters
    ----------
    year, month, day : ndarray, shape (n,)

    Returns
    -------
    days : ndarray of int64, shape (n,)
    exists : ndarray of bool, shape (n,)
    """
    in_year = (month >= 1) & (month <= 12)
    leap = (month == 2) & (year % 4 == 0) & ((year % 100 != 0) | (year % 400 == 0))
    length = _MONTH_DAYS[np.where(in_year, month, 0)] + leap
    exists = in_year & (day >= 1) & (day <= length)
    # the year is begun in March so that the leap day is its last
    y = year - (month <= 2)
    of_year = (153 * (month + np.where(month > 2, -3, 9)) + 2) // 5 + day - 1
    return 365 * y + y // 4 - y // 100 + y // 400 + of_year - 719_468, exists


def iso_instants(text: Spans) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
    """Read instants such as ``2025-05-03T07:47:01.147Z``; a zone of any offset is taken off.

    Parameters
    ----------
    text : Spans
        Without blanks at either end.

    Returns
    -------
    time_utc_ns : ndarray of int64, shape (n,)
        Zero where the text is no instant.
    good : ndarray of bool, shape (n,)
        Which texts are instants.
    zoned : ndarray of bool, shape (n,)
        Which of them name their zone; the others are taken as UTC.

    References
    ----------
    ISO 8601-1:2019, the extended form, with ``T`` or a blank between date and time.
    """
    n = len(text)
    if n == 0 or text.buffer.size == 0:
        none = np.zeros(n, dtype=np.bool_)
        return np.zeros(n, dtype=np.int64), none, none.copy()
    good = text.stop - text.start >= 19
    # a shorter text is none already: whatever stands behind it may be read
    first, second, third = (words(text.buffer, np.minimum(text.start + k, text.buffer.size)) for k in (0, 8, 16))
    # neighbours mostly share their minute: each is read once
    same = (first[1:] == first[:-1]) & (second[1:] == second[:-1])
    heads = np.flatnonzero(np.append([True], ~same))
    minutes, sound = _minutes(first[heads], second[heads])
    often = np.diff(heads, append=n)
    seconds, colon = _between_signs(third & _SECONDS, ":00")
    # 60 is a leap second; it becomes the first of the next minute
    good &= np.repeat(sound, often) & colon & (seconds <= 60)
    fraction, behind, whole = _fraction(text)
    shift, zoned, fits = _zone(text, behind)
    good &= whole & fits
    seconds += np.repeat(minutes * 60, often) - shift
    return np.where(good, np.where(good, seconds, 0) * SECOND_NS + fraction, 0), good, good & zoned


#: The byte between date and time, third of the second word, and what it may be.
_BETWEEN = np.uint64(0xFF << 16)
_MAY_STAND_BETWEEN = np.array([ord(sign) << 16 for sign in "Tt "], dtype=np.uint64)
#: The sign and two digits at the beginning of the third word.
_SECONDS = np.uint64(0xFFFFFF)


def _minutes(first: Word, second: Word) -> tuple[Index, Flag]:
    """Read YYYY-MM-DDThh:mm, cut in two words, as minutes since 1970."""
    date, dashes = _between_signs(first, "0000-00-")
    clock, signs = _between_signs(second & ~_BETWEEN, "00 00:00")
    year, month = date // 10_000, date // 10 % 1_000
    day, hour, minute = clock // 1_000_000, clock // 1_000 % 1_000, clock % 1_000
    days, good = days_since_1970(year, month, day)
    good &= dashes & signs & np.isin(second & _BETWEEN, _MAY_STAND_BETWEEN) & (hour < 24) & (minute < 60)
    # int64 nanoseconds hold the years 1678 to 2261
    good &= (year > 1678) & (year < 2261)
    return days * 1_440 + hour * 60 + minute, good


def _between_signs(word: Word, form: str) -> tuple[Index, Flag]:
    """Read the digits of words of one form, ``0`` where a digit stands; a sign counts as the digit zero.

    A blank in the form is a byte that has been cleared. A form of fewer than eight characters is of the last digits.
    """
    zeros = sum(ord("0") << 8 * k for k in range(8) if k >= len(form) or form[k] != "0")
    mask = np.uint64(sum(0xFF << 8 * k for k in range(8) if k >= len(form) or form[k] != "0"))
    signs = np.uint64(sum(ord(sign) << 8 * k for k, sign in enumerate(form) if sign not in "0 "))
    digits = (word & ~mask) | np.uint64(zeros)
    value = eight_digits(digits) // int(POWERS_OF_TEN[8 - len(form)])
    return value, ((word & mask) == signs) & all_digits(digits)


def _fraction(text: Spans) -> tuple[Index, Index, Flag]:
    """Read up to nine digits of a second; further digits, up to sixteen in all, are cut off."""
    end = text.buffer.size
    place = text.start + 19
    sign = text.buffer[np.minimum(place, end - 1)]
    point = ((sign == ord(".")) | (sign == ord(","))) & (place < text.stop)
    place = place + point
    early = words(text.buffer, np.minimum(place, end))
    count = np.where(point, np.clip(np.minimum(leading_digits(early), text.stop - place), 0, None), 0)
    value = eight_digits(first_digits(early, count)) * POWERS_OF_TEN[9 - count]
    long = np.flatnonzero(count == 8)
    if long.size:
        late = words(text.buffer, np.minimum(place[long] + 8, end))
        more = np.clip(np.minimum(leading_digits(late), text.stop[long] - place[long] - 8), 0, None)
        ninth = (late & np.uint64(0xFF)).astype(np.int64) - ord("0")
        value[long] += np.where(more > 0, ninth, 0)
        count[long] += more
    return value, place + count, ~point | (count > 0)


def _zone(text: Spans, place: Index) -> tuple[Index, Flag, Flag]:
    """Read nothing, Z, +hh, +hhmm or +hh:mm; return the seconds to take off, whether it is there, whether it fits."""
    rest = text.stop - place
    sign = text.buffer[np.minimum(place, text.buffer.size - 1)]
    zoned = (rest == 1) & ((sign == ord("Z")) | (sign == ord("z")))
    seconds = np.zeros(place.shape, dtype=np.int64)
    fits = (rest == 0) | zoned
    numeric = np.flatnonzero(~fits & np.isin(rest, (3, 5, 6)) & ((sign == ord("+")) | (sign == ord("-"))))
    if numeric.size:
        colon = rest[numeric] == 6
        word = words(text.buffer, place[numeric] + 1)
        good = ~colon | ((word >> np.uint64(16)) & np.uint64(0xFF) == ord(":"))
        minutes = word >> np.where(colon, 24, 16).astype(np.uint64)
        both = first_digits(word, np.full(numeric.size, 2)), first_digits(minutes, np.where(rest[numeric] == 3, 0, 2))
        good &= all_digits(both[0]) & all_digits(both[1])
        hour, minute = eight_digits(both[0]), eight_digits(both[1])
        good &= (hour <= 15) & (minute < 60)
        seconds[numeric] = np.where(good, (hour * 3_600 + minute * 60) * np.where(sign[numeric] == ord("-"), -1, 1), 0)
        zoned[numeric] = fits[numeric] = good
    return seconds, zoned, fits


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
    decimals = np.clip(length - 7, 0, None)
    count = leading_digits(early)
    first = np.minimum(np.where(point, decimals, 0), 8)
    fraction = eight_digits(first_digits(early, np.minimum(first, count))) * POWERS_OF_TEN[9 - first]
    long = np.flatnonzero(decimals > 8)
    if long.size:
        late = words(cells.buffer, np.minimum(cells.start[long] + 15, size + 1))
        count[long] += np.where(count[long] == 8, leading_digits(late), 0)
        fraction[long] += (late & np.uint64(0xFF)).astype(np.int64) - ord("0")
    good &= (decimals <= count) | ~point
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
    days, exists = days_since_1970(year + np.where(year >= CENTURY_FROM, 1900, 2000), month, day)
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


def _digits(cells: Cells, count: int) -> tuple[Index, Flag]:
    """Read the first digits of each text."""
    word = first_digits(words(cells.buffer, cells.start), np.full(cells.start.shape, count))
    good = all_digits(word) & (cells.stop - cells.start >= count)
    return np.where(good, eight_digits(word), 0), good


def decimal_times(text: pl.Series, unit: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Convert decimal text in ``unit`` to nanoseconds.

    Parameters
    ----------
    text : polars.Series of String, shape (n,)
        Such as ``.050000000`` or ``1.714e9``; without blanks around it.
    unit : {"s", "ms", "us", "ns", "d"}
        Of days, decimals beyond the fourteenth are cut off.

    Returns
    -------
    ns : ndarray of int64, shape (n,)
        Rounded to the nearest nanosecond, half to even; zero where the text is no number.
    good : ndarray of bool, shape (n,)
    """
    if unit == "d":
        return _days(text)
    places = _PLACES[unit]
    frame = text.fill_null("").alias("text").to_frame()
    plain = (
        frame.lazy()
        .with_columns(
            plain=pl.col("text").str.contains(r"^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)$"),
            negative=pl.col("text").str.starts_with("-"),
            whole=pl.col("text").str.extract(r"^[+-]?([0-9]*)", 1).fill_null(""),
            part=pl.col("text").str.extract(r"\.([0-9]*)$", 1).fill_null(""),
        )
        .with_columns(
            # more digits than a nanosecond, or than an integer holds, go the slow and exact way
            plain=pl.col("plain")
            & (pl.col("part").str.slice(places).str.strip_chars("0") == "")
            & (pl.col("whole").str.len_bytes() <= 18 - places),
        )
        .with_columns(digits=pl.col("whole") + pl.col("part").str.slice(0, places).str.pad_end(places, "0"))
        .with_columns(ns=pl.col("digits").cast(pl.Int64, strict=False).fill_null(0))
        .with_columns(ns=pl.when("negative").then(-pl.col("ns")).otherwise("ns"))
        .select("text", "plain", "ns")
        .collect(engine="in-memory")
    )
    ns = plain["ns"].to_numpy().astype(np.int64)
    good = plain["plain"].to_numpy().copy()
    for i in np.flatnonzero(~good):
        exact = _exact(plain["text"][int(i)], places)
        good[i] = exact is not None
        ns[i] = exact or 0
    return np.where(good, ns, 0), good


def _days(text: pl.Series) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Convert days with decimals, as spreadsheets count them, to nanoseconds."""
    found = text.str.extract_groups(r"^(?<whole>[0-9]{1,5})(?:[.](?<part>[0-9]*))?$").struct.unnest()
    day, part = (
        found.select(digits.cast(pl.Int64, strict=False).fill_null(0)).to_series().to_numpy()
        for digits in (
            pl.col("whole"),
            pl.col("part").fill_null("").str.slice(0, _DAY_PLACES).str.pad_end(_DAY_PLACES, "0"),
        )
    )
    # a day has 864 * 10^11 ns, so that its decimals stay integers
    ns, good = day * DAY_NS + (part * 864 + 500) // 1_000, found["whole"].is_not_null().to_numpy().copy()
    for i in np.flatnonzero(~good & text.is_not_null().to_numpy()).tolist():
        # a sign, an exponent, a bare point
        exact = _exact(str(text[i]), 0, DAY_NS)
        good[i], ns[i] = exact is not None, exact or 0
    return ns, good


def _exact(text: str, places: int, times: int = 1) -> int | None:
    try:
        number = Decimal(text)
        if not text.isascii() or not number.is_finite() or "_" in text or number.adjusted() > 20:
            return None
        ns = int((number.scaleb(places) * times).to_integral_value(rounding=ROUND_HALF_EVEN))
    except (InvalidOperation, ValueError):
        return None
    return ns if abs(ns) < _LARGEST else None
