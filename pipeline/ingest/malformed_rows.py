"""Why many rows of delimited text are malformed: their number of cells, or how their times are written."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import polars as pl

from kempf.pipeline.ingest.decoded import MalformedRows
from kempf.pipeline.ingest.layout import Layout
from kempf.pipeline.ingest.spans import Index, Spans
from kempf.pipeline.ingest.text.cells import DECIMAL_COMMA
from kempf.schemas.enumeration import at_the_beginning, counted
from kempf.schemas.profile import TimeColumn

#: Damage is a few rows here and there: of so many, and of such a share, the layout is to blame.
_FEWEST, _SHARE = 20, 0.01

#: Share of a stretch of rows that makes it one of rows with another number of cells.
_DENSE = 0.9

#: Number of cells of a row with a quotation that is not closed: nobody can say.
OPEN = -1

#: Characters of a cell that a message quotes.
_CUT = 60

_FORMS = (
    "Times are read as ISO 8601, such as 2025-05-03T06:00:00.5Z or 2025-05-03 06:00:00.5+02:00; with `date_form: "
    "dd/mm/yyyy` or the like where the date is written another way before hh:mm:ss; with `date` and `time` where they "
    "stand in two columns; as a number with `unit`. See docs/profile.md."
)

#: What to do about a time of day, by how it is written, and about a column that says nothing but this.
_ON_CLOCKS = (
    (
        r"\d:\d\d:\d\d:\d+",
        "Write a point before the decimals of a second, in a copy of the log or in the settings of its logger.",
    ),
    (
        r"\d:\d\d(:\d\d)?[.,\d]* ?(?!UTC$|[AaPp][Mm]$)[A-Za-z]{2,5}$",
        "Write the zone as Z, UTC or its offset, such as +02:00: abbreviations of zones are ambiguous.",
    ),
)
_ON_LONE_COLUMNS = (
    (
        r"^\d{1,2}:\d\d(:\d\d)?[.,\d]*\S*$",
        "This is a time of day: name the column of its date, as `time: {date: DATE, time: TIME}`, or write the date "
        "before it in a copy of the log.",
    ),
    (
        r"^[+-]?\d+([.,]\d+)?([eE][+-]?\d+)?$",
        "This is a number: write its `unit` (s, ms, us, ns, or d for days) into the source's time and, unless it "
        "counts from 1970, its `start`: for days of a spreadsheet mostly `unit: d, start: 1899-12-30T00:00:00Z`.",
    ),
)
_COMMA_ADVICE = (
    "This is a number with a comma before its decimals: write `decimal: ','` into the profile's source for this log."
)
_OTHER_DATE = r"^(?!\d{4}-\d\d-\d\d)\d{1,4}[-./ ](\d{1,2}|[A-Za-z]{3,9})[-./ ]\d{1,4}(?!\d)"
_DATE_ADVICE = "The date is no yyyy-mm-dd: write its form into the source's time, as `date_form`."


def cells_amiss(layout: Layout, count: Index, *, named: bool) -> MalformedRows | None:
    """Return what is to be said of rows with another number of cells than there are columns; None if they are few.

    Parameters
    ----------
    layout : Layout
    count : ndarray of int64, shape (n,)
        Cells of each row, 0 or `OPEN` where nobody can say.
    named : bool
        Whether the profile names the columns, not the header.
    """
    n, width = len(layout.rows), len(layout.columns)
    wrong = count[(count != width) & (count > 0)]
    if not _many(wrong.size, n):
        return None
    kinds, often = np.unique(wrong, return_counts=True)
    usual = int(kinds[np.argmax(often)])
    at = np.flatnonzero(count == usual)
    first, last = int(at[0]), int(at[-1])
    to_the_end = last >= n - 1 - _SHARE * n
    where = ""
    if at.size >= _FEWEST and at.size >= _DENSE * (last - first + 1) and not (first == 0 and to_the_end):
        until = "on" if to_the_end else f"to {_place(layout.rows, last)}"
        where = f", from {_place(layout.rows, first)} {until}"
        step = (
            "Columns were added or taken away there: cut the log at these rows and ingest its parts, each with the "
            "line that names its columns."
        )
    elif 2 * wrong.size <= n:
        step = (
            "Look at them with `kempf logs rejected`: they are damaged, of another kind, or have a text with a "
            "separator that does not stand between quotation marks."
        )
    elif layout.separator == "," and usual > width + 1:
        step = (
            "A comma that stands before decimals parts cells too: export the log with a decimal point, or with "
            "semicolons between the cells and `decimal: ','` in the source. If none does, correct the header."
        )
    else:
        step = (
            "Write a name for every cell of a row into the header, in a copy of the log, or into `columns` of the "
            "source (with `header_lines: 1` for the line that names them now); or correct `separator`."
        )
    expected = f"the profile names {counted(width, 'column')}" if named else f"the header has {width}"
    parted = {None: "", "whitespace": " parted by blanks", "\t": " parted by tabs"}.get(
        layout.separator, f" parted by {layout.separator!r}"
    )
    more = wrong.size - at.size
    others = f", and {more} {'has' if more == 1 else 'have'} another number" if more else ""
    has = "has" if at.size == 1 else "have"
    rows = at_the_beginning(_of_all(at.size, n))
    found = f"{rows} {has} {counted(usual, 'cell')}{parted}{where}{others}; {expected}."
    return MalformedRows(found, step, wrong.size)


def quotations_amiss(layout: Layout, count: Index) -> MalformedRows | None:
    """Return what is to be said of rows with a quotation that is not closed; None if they are few.

    Parameters
    ----------
    layout : Layout
    count : ndarray of int64, shape (n,)
        Cells of each row, `OPEN` for these.
    """
    n = len(layout.rows)
    amiss = np.flatnonzero(count == OPEN)
    if not _many(amiss.size, n):
        return None
    one = int(amiss[amiss.size // 2])
    (text,) = layout.rows.take(np.array([one])).text(limit=_CUT)
    found = (
        f"In {_of_all(amiss.size, n)} a cell begins with a quotation mark that is never closed, such as "
        f"{text!r} of {_place(layout.rows, one)}; expected a second mark at the end of the cell, in the same line."
    )
    step = (
        "Export the log with a mark at either end of such a cell or with none, and without line ends within a cell; or "
        "take the marks out of a copy of it."
    )
    return MalformedRows(found, step, amiss.size)


def times_amiss(
    rows: Spans, cells: Mapping[str, pl.Series], row: Index, unread: Index, column: TimeColumn
) -> MalformedRows | None:
    """Return what is to be said of times that cannot be read; None if they are few.

    Parameters
    ----------
    rows : Spans
        All rows, shape (n,).
    cells : mapping of str to polars.Series of String
        The columns of the time, each shape (m,).
    row : ndarray of int64, shape (m,)
        Numbers of the rows that they are of.
    unread : ndarray of int64
        Numbers of the rows whose time is there and cannot be read.
    column : TimeColumn
    """
    if not _many(unread.size, len(rows)):
        return None
    # the first ones may be a line of units, or another header
    one = int(unread[unread.size // 2])
    shown = {key: str(text[int(np.searchsorted(row, one))])[:_CUT] for key, text in cells.items()}
    quoted = " and ".join(f"{text!r} in the column {key!r}" for key, text in shown.items())
    said = "".join(
        f" with `{key}: {value}`"
        for key, value in (("date_form", column.date_form), ("unit", column.unit))
        if value is not None
    )
    found = (
        f"The time of {_of_all(unread.size, len(rows))} cannot be read{said}, such as {quoted} of {_place(rows, one)}."
    )
    return MalformedRows(found, " ".join([*_advice(list(shown.values()), column), _FORMS]), unread.size)


def _advice(shown: list[str], column: TimeColumn) -> list[str]:
    """Return what to do about a time that stands in one column or, date and time of day apart, in two."""
    if column.unit is not None and len(shown) == 1 and re.search(DECIMAL_COMMA, shown[0]):
        return [_COMMA_ADVICE]
    if column.unit is not None:
        return ["This is no number: leave `unit` out of the source's time."] if len(shown) == 1 else []
    known = _ON_CLOCKS if len(shown) > 1 else (*_ON_CLOCKS, *_ON_LONE_COLUMNS)
    advice = [step for form, step in known if re.search(form, shown[-1])]
    if len(shown) == 1 and re.search(DECIMAL_COMMA, shown[0]):
        advice.append(_COMMA_ADVICE)
    if column.date_form is None and re.search(_OTHER_DATE, shown[0]):
        advice.append(_DATE_ADVICE)
    return advice


def _many(amiss: int, n: int) -> bool:
    return 2 * amiss > n or (amiss >= _FEWEST and amiss >= _SHARE * n)


def _of_all(some: int, n: int) -> str:
    """Return how many of the rows, in words."""
    if n == 1:
        return "the only row"
    return f"all {n} rows" if some == n else f"{some} of {n} rows"


def _place(rows: Spans, row: int) -> str:
    """Return which row it is, and in which line of the file it stands, both from 1 on."""
    before = rows.buffer[: int(rows.start[row])]
    ends = np.count_nonzero(before == 10) or np.count_nonzero(before == 13)
    return f"row {row + 1} (line {ends + 1})"
