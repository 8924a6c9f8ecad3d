"""ISO 8601 instants in columns, exact to the nanosecond."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline.ingest.spans import Spans

_Int = NDArray[np.int64]
_Flag = NDArray[np.bool_]
_At = Callable[[_Int], _Int]

DAY_NS = 86_400_000_000_000
SECOND_NS = 1_000_000_000

#: Digits of YYYY-MM-DDThh:mm:ss by place, and the signs between them.
_DIGITS = {"year": (0, 4), "month": (5, 7), "day": (8, 10), "hour": (11, 13), "minute": (14, 16), "second": (17, 19)}
_SIGNS = {4: b"-", 7: b"-", 10: b"Tt ", 13: b":", 16: b":"}
_MONTH_DAYS = np.array([0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])


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


def parse(text: Spans) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
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
    last = text.buffer.size - 1

    def at(place: NDArray[np.int64]) -> NDArray[np.int64]:
        byte = text.buffer[np.minimum(place, last)].astype(np.int64)
        return np.where(place < text.stop, byte, 0)

    good = text.stop - text.start >= 19
    # a shorter text is none already: whatever stands behind it may be read
    base = np.minimum(text.start, max(last - 18, 0))
    for place, signs in _SIGNS.items():
        good &= np.isin(text.buffer[np.minimum(base + place, last)], np.frombuffer(signs, dtype=np.uint8))
    part: dict[str, NDArray[np.int64]] = {}
    for name, (first, end) in _DIGITS.items():
        number = np.zeros(n, dtype=np.int64)
        for place in range(first, end):
            digit = text.buffer[np.minimum(base + place, last)] - np.uint8(48)
            good &= digit <= 9
            number = number * 10 + digit
        part[name] = number
    days, exists = days_since_1970(part["year"], part["month"], part["day"])
    # 60 is a leap second; it becomes the first of the next minute
    good &= exists & (part["hour"] < 24) & (part["minute"] < 60) & (part["second"] <= 60)
    # int64 nanoseconds hold the years 1678 to 2261
    good &= (part["year"] > 1678) & (part["year"] < 2261)
    fraction, behind, whole = _fraction(at, text.start + 19)
    shift, zoned, fits = _zone(at, behind, text.stop)
    good &= whole & fits
    seconds = days * 86_400 + part["hour"] * 3_600 + part["minute"] * 60 + part["second"] - shift
    return np.where(good, np.where(good, seconds, 0) * SECOND_NS + fraction, 0), good, good & zoned


def _fraction(at: _At, place: _Int) -> tuple[_Int, _Int, _Flag]:
    """Read up to nine digits of a second; further digits are cut off."""
    point = np.isin(at(place), np.frombuffer(b".,", dtype=np.uint8))
    place = place + point
    value = np.zeros(place.shape, dtype=np.int64)
    running = point.copy()
    read = np.zeros(place.shape, dtype=np.int64)
    for _ in range(18):
        digit = at(place) - 48
        running &= (digit >= 0) & (digit <= 9)
        if not running.any():
            break
        value = np.where(running & (read < 9), value * 10 + digit, value)
        read += running
        place = place + running
    value *= 10 ** np.maximum(9 - read, 0)
    return value, place, ~point | (read > 0)


def _zone(at: _At, place: _Int, stop: _Int) -> tuple[_Int, _Flag, _Flag]:
    """Read nothing, Z, +hh, +hhmm or +hh:mm; return the seconds to take off, whether it is there, whether it fits."""
    rest = stop - place
    sign = at(place)
    is_z = (rest == 1) & np.isin(sign, np.frombuffer(b"Zz", dtype=np.uint8))
    is_offset = np.isin(rest, (3, 5, 6)) & np.isin(sign, np.frombuffer(b"+-", dtype=np.uint8))
    colon = rest == 6
    is_offset &= ~colon | (at(place + 3) == 58)
    digits = [at(place + k) - 48 for k in (1, 2)]
    digits += [np.where(rest > 3, at(place + k + colon) - 48, 0) for k in (3, 4)]
    for digit in digits:
        is_offset &= (digit >= 0) & (digit <= 9)
    hours, minutes = digits[0] * 10 + digits[1], digits[2] * 10 + digits[3]
    is_offset &= (hours <= 15) & (minutes < 60)
    seconds = (hours * 3_600 + minutes * 60) * np.where(sign == 45, -1, 1)
    return np.where(is_offset, seconds, 0), is_z | is_offset, (rest == 0) | is_z | is_offset
