"""The times of the rows of delimited text: one column, a date beside a time of day, or rows counted at an interval."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from kempf.pipeline.ingest.decoded import Flag, Nanoseconds
from kempf.pipeline.ingest.spans import Index, Spans, spans_of
from kempf.pipeline.ingest.text.times import CENTURY_FROM, decimal_times, iso_instants
from kempf.schemas.errors import DataRejected
from kempf.schemas.profile import TimeColumn, start_ns
from kempf.schemas.units import SECOND_NS

#: Largest count of nanoseconds that is added to a start, so that the sum is an int64.
_FARTHEST = 1 << 62

#: Share of the stamps, at either end, that may be damaged without a word on the interval.
_DAMAGED = 0.005

#: A column is coarse where so many rows bear the stamp of the row before, and so many stamps are there to see it by.
_REPEATED, _FEWEST_ROWS, _FEWEST_STAMPS = 0.5, 20, 3

#: Stamps so many rows apart are reported, where the interval does not fit.
_PAUSE = 20

_NO_ZONE = "Times without a zone are taken as UTC."

_PARTS = {
    "yyyy": r"(?<y>\d{4})",
    "yy": r"(?<y>\d{2})",
    "mmm": r"(?<m>[A-Za-z]{3,9})",
    "mm": r"(?<m>\d{1,2})",
    "dd": r"(?<d>\d{1,2})",
}
_MONTHS = [
    "january",
    "february",
    "march",
    "april",
    "may",
    "june",
    "july",
    "august",
    "september",
    "october",
    "november",
    "december",
]
_MONTH_NUMBERS = {short: str(k) for k, name in enumerate(_MONTHS, 1) for short in (name, name[:3])} | {"sept": "9"}
_ISO_DATES = r"^(?<y>\d{4})-?(?<m>\d{2})-?(?<d>\d{2})$"
#: hh:mm, hh:mm:ss or hhmmss, decimals, the half of the day, and a zone behind them
_ZONE = r"(?: ?(?<z>[Zz]|UTC|[+-]\d.*))?$"
_HALF = r"(?:\s?(?<half>[AaPp])\.?[Mm]\.?)?"
_CLOCK = r"^(?<h>\d{1,2}):(?<m>\d{2})(?::(?<s>\d{2})(?<f>[.,]\d+)?)?" + _HALF + _ZONE
_PLAIN_CLOCK = r"^(?<h>\d{2})(?<m>\d{2})(?<s>\d{2})(?<f>[.,]\d+)?(?<half>)" + _ZONE

#: A date, what parts it from the time of day, and that, to the second as in ISO 8601 here.
_TO_THE_SECOND = r"^(?<date>\S+?)[T\s]+(?<clock>\d{1,2}:\d{2}:\d{2}.*|\d{6}.*)$"


@dataclass(frozen=True, eq=False)
class RowTimes:
    """Times of some rows."""

    #: Shape (m,). UTC nanoseconds; zero where there is none.
    time_utc_ns: Nanoseconds
    #: Shape (m,). Which rows have a time.
    good: Flag
    #: Shape (m,). Which rows say something of time, readable or not.
    stated: Flag
    #: What a person should know.
    notes: list[str]


def row_times(name: str, cells: Mapping[str, pl.Series], row: Index, rows: Spans, column: TimeColumn) -> RowTimes:
    """Give rows their times as a profile says.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    cells : mapping of str to polars.Series of String
        At least the columns that ``column`` names, each shape (m,).
    row : ndarray of int64, shape (m,)
        Numbers of the rows, ascending from 0; rows that were refused are counted.
    rows : Spans
        The same rows as they stand in the file, shape (m,).
    column : TimeColumn

    Raises
    ------
    DataRejected
        ``interval_contradicts_times``: the rows are not spaced as the profile says.
    """
    start = start_ns(column.start) if column.start is not None else 0
    if not column.columns:
        assert column.interval_s is not None
        every = np.ones(row.size, dtype=np.bool_)
        return RowTimes(_counted(row, column.interval_s) + start, every, every, [])
    stated = np.logical_and.reduce([cells[key].is_not_null().to_numpy() for key in column.columns])
    notes: list[str] = []
    if column.date is not None and column.time is not None:
        instant, good = _of_two(cells[column.date], cells[column.time], column, notes)
    elif column.column is not None and column.date_form is not None:
        written = f"^(?<date>{_date_pattern(column.date_form)})[T\\s]+(?<clock>.+)$"
        instant, good = _of_two(*_parted(cells[column.column], written), column, notes)
    elif column.unit is None:
        instant, good = text_instants(cells[column.columns[0]], column, notes)
    else:
        instant, good = decimal_times(cells[column.columns[0]], column.unit)
        good &= np.abs(instant) < _FARTHEST
        instant = np.where(good, instant, 0) + start
    if column.interval_s is None:
        return RowTimes(instant, good, stated, [*notes, *_coarse(instant, good, row, rows)])
    if not good.any():
        return RowTimes(instant, good, stated, notes)
    first = _first_row(name, instant[good], row[good], column.interval_s)
    every = np.ones(row.size, dtype=np.bool_)
    note = f"The rows are taken for evenly spaced by {column.interval_s:g} s, as the profile says"
    shown = f"; the column agrees within {_resolution_s(instant[good]):.4g} s." if np.ptp(instant[good]) else "."
    return RowTimes(_counted(row, column.interval_s) + first, every, every, [*notes, note + shown])


def text_instants(text: pl.Series, column: TimeColumn, notes: list[str]) -> tuple[Nanoseconds, Flag]:
    """Read times as ISO 8601 writes them, and near relatives of these.

    Parameters
    ----------
    text : polars.Series of String, shape (m,)
        Without blanks at either end; null is no time.
    column : TimeColumn
        Where it stands.
    notes : list of str
        A note is added where a time names no zone.

    Returns
    -------
    time_utc_ns : ndarray of int64, shape (m,)
        Zero where the text is no time.
    good : ndarray of bool, shape (m,)
    """
    instant, good, zoned = iso_instants(spans_of(text))
    if bool(np.any(good & ~zoned)) and _NO_ZONE not in notes:
        notes.append(_NO_ZONE)
    # an hour of one digit, a blank before the zone, the basic form
    odd = np.flatnonzero(text.is_not_null().to_numpy() & ~good)
    if odd.size:
        instant[odd], good[odd] = _of_two(*_parted(text.gather(odd), _TO_THE_SECOND), column, notes)
    return instant, good


def _counted(row: Index, interval_s: float) -> Nanoseconds:
    """Return how far behind the first row each one is."""
    return np.round(row * (interval_s * SECOND_NS)).astype(np.int64)


def _first_row(name: str, instant: Nanoseconds, row: Index, interval_s: float) -> int:
    """Return the time of the first row, once the stamps were held against the interval.

    A stamp that is cut or rounded to its resolution lies within that of the row's own time, and a logger may be late by
    a row.
    """
    if not np.ptp(instant):
        # of a single stamp nobody knows how coarse it is
        return int(instant[0] - _counted(row[:1], interval_s)[0])
    slack = (_resolution_s(instant) + interval_s) * SECOND_NS
    off = (instant - instant[0] - _counted(row, interval_s)).astype(np.float64)
    low, high = np.quantile(off, [_DAMAGED, 1.0 - _DAMAGED])
    if high - low > slack:
        raise _contradiction(name, instant, row, interval_s)
    sound = int(np.argmax(np.abs(off - np.median(off)) <= slack))
    return int(instant[sound] - _counted(row[sound : sound + 1], interval_s)[0])


def _resolution_s(instant: Nanoseconds) -> float:
    """Return the usual step of stamps that are not all the same, s."""
    step = np.abs(np.diff(instant))
    return float(np.median(step[step > 0])) / SECOND_NS


def _contradiction(name: str, instant: Nanoseconds, row: Index, interval_s: float) -> DataRejected:
    seconds, count = float(instant[-1] - instant[0]) / SECOND_NS, int(row[-1] - row[0])
    mean = seconds / max(count, 1)
    leap = int(np.argmax(np.abs(np.diff(instant).astype(np.float64) - np.diff(row) * (interval_s * SECOND_NS))))
    wide, at = float(instant[leap + 1] - instant[leap]) / SECOND_NS, int(row[leap + 1]) + 1
    paused = f" They leap by {wide:.6g} s at row {at}." if abs(wide) > _PAUSE * mean else ""
    return DataRejected(
        "interval_contradicts_times",
        f"The profile says that the rows of {name} are {interval_s:g} s apart; by its times they are {mean:.6g} s "
        f"apart in the mean of {count + 1} rows, and the last is {seconds - count * interval_s:+.3g} s off.{paused}",
        "Correct interval_s in the profile's source; where the logger paused, cut the log there.",
        {"name": name, "interval_s": interval_s, "mean_interval_s": mean, "row": at},
    )


def _coarse(instant: Nanoseconds, good: Flag, row: Index, rows: Spans) -> list[str]:
    """Say that the times are coarser than the rows, and what to write, where most rows bear the time of the one before.

    Lines that came twice bear it too: these are copies.
    """
    at = np.flatnonzero(good)
    if at.size < _FEWEST_ROWS:
        return []
    changes = np.flatnonzero(np.diff(instant[at])) + 1
    repeated = at.size - 1 - changes.size
    if repeated < _REPEATED * (at.size - 1) or changes.size < _FEWEST_STAMPS - 1:
        return []
    text = rows.take(at).binary()
    copies = int((text.slice(1) == text.slice(0, at.size - 1)).sum())
    if repeated - copies < _REPEATED * (at.size - 1):
        return []
    first, last = at[changes[0]], at[changes[-1]]
    apart = float((instant[last] - instant[first]) / max(int(row[last] - row[first]), 1)) / SECOND_NS
    return [
        f"{at.size} rows share {changes.size + 1} times: the time column is coarser than the rows, and of a channel "
        f"one value a time is kept. If the rows are evenly spaced, write interval_s: {apart:.4g} beside the column, "
        "under the source's time; so many seconds are they apart in the mean."
    ]


def _of_two(date: pl.Series, clock: pl.Series, column: TimeColumn, notes: list[str]) -> tuple[Nanoseconds, Flag]:
    """Join a date and a time of day."""
    day = _iso_dates(date, column.date_form)
    if column.unit is not None:
        midnight, good, _ = iso_instants(spans_of(day + "T00:00:00Z"))
        since, known = decimal_times(clock, column.unit)
        good &= known & (np.abs(since) < _FARTHEST)
        return np.where(good, midnight + np.where(good, since, 0), 0), good
    instant, good, zoned = iso_instants(spans_of(day + "T" + _iso_clock(clock)))
    if bool(np.any(good & ~zoned)) and _NO_ZONE not in notes:
        notes.append(_NO_ZONE)
    return instant, good


def _parted(instant: pl.Series, form: str) -> tuple[pl.Series, pl.Series]:
    """Return date and time of day of instants, null where they are not of the form."""
    found = instant.str.extract_groups(form).struct
    return found.field("date"), found.field("clock")


def _date_pattern(form: str) -> str:
    """Return the regular expression of dates of a form."""
    return "".join(_PARTS.get(sign, re.escape(sign)) for sign in re.split(r"(yyyy|yy|mmm|mm|dd)", form))


def _iso_dates(text: pl.Series, form: str | None) -> pl.Series:
    """Return dates as yyyy-mm-dd, null where they are not of the form."""
    pattern = _ISO_DATES if form is None else f"^{_date_pattern(form)}$"
    parts = pl.col("text").str.extract_groups(pattern).struct
    year = parts.field("y")
    last = pl.when(year.cast(pl.Int64, strict=False) >= CENTURY_FROM).then(pl.lit("19")).otherwise(pl.lit("20"))
    full = pl.when(year.str.len_bytes() == 2).then(last + year).otherwise(year)
    month, day = parts.field("m"), parts.field("d").str.pad_start(2, "0")
    if form is not None and "mmm" in form:
        month = month.str.to_lowercase().replace_strict(_MONTH_NUMBERS, default=None)
    return text.alias("text").to_frame().select(full + "-" + month.str.pad_start(2, "0") + "-" + day).to_series()


def _iso_clock(text: pl.Series) -> pl.Series:
    """Return times of day as hh:mm:ss with decimals and zone, null where they are none."""
    shown = []
    for pattern in (_CLOCK, _PLAIN_CLOCK):
        parts = pl.col("text").str.extract_groups(pattern).struct
        rest = [parts.field(key).fill_null(nothing) for key, nothing in (("s", "00"), ("f", ""), ("z", ""))]
        rest[2] = rest[2].replace("UTC", "Z")
        hour = _of_the_day(parts.field("h"), parts.field("half").str.to_lowercase())
        shown.append(hour.str.pad_start(2, "0") + ":" + parts.field("m") + ":" + rest[0] + rest[1] + rest[2])
    return text.alias("text").to_frame().select(pl.coalesce(shown)).to_series()


def _of_the_day(hour: pl.Expr, half: pl.Expr) -> pl.Expr:
    """Return the hour of the day; null where a half of the day stands behind an hour that is none of 1 to 12."""
    number = hour.cast(pl.Int64, strict=False)
    of_twelve = pl.when(number.is_between(1, 12)).then(number % 12 + pl.when(half == "p").then(12).otherwise(0))
    return pl.when(half.is_in(["a", "p"])).then(of_twelve.cast(pl.String)).otherwise(hour)
