"""Delimited text: one row a record, columns named by the file or by the profile."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import dropwhile

import numpy as np
import polars as pl

from kempf.pipeline.ingest.decoded import CODE, NO_TIME, Decoded, Flag, Reason, Values
from kempf.pipeline.ingest.encoding import advice_on, as_utf8
from kempf.pipeline.ingest.layout import LONGEST_ROW, Layout, cells_of, fits, layout_of
from kempf.pipeline.ingest.malformed_rows import OPEN, cells_amiss, quotations_amiss, times_amiss
from kempf.pipeline.ingest.mapping import check_once
from kempf.pipeline.ingest.quoting import inside_quotes
from kempf.pipeline.ingest.sniff import SAMPLE, separator_of
from kempf.pipeline.ingest.spans import Bytes, Index, Spans, is_blank, trimmed
from kempf.pipeline.ingest.text.cells import DECIMAL_COMMA, number
from kempf.pipeline.ingest.text.row_times import row_times
from kempf.schemas.channels import ROW
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import Source

_QUOTE, _TAB, _FEED = 34, 9, 10

#: How many cells of a column are looked at for a decimal comma.
_LOOKED_AT_CELLS = 2000
#: Most characters of a cell that are looked at: far more than any number or time has.
_LONGEST_CELL = 1_000

#: About so many bytes of rows are cut at a time.
_BLOCK = 4 << 20

#: Most names of columns that a message lists.
_SHOWN = 40


@dataclass(frozen=True)
class Titled:
    """A table below lines of title."""

    #: Lines before it.
    header_lines: int
    #: One character or ``whitespace``.
    separator: str
    #: Names of its columns; none where no line names them.
    names: tuple[str, ...]
    #: Number of its columns.
    count: int


#: Lines in which a table is looked for below a title, at most and at least.
_LOOKED_AT, _FEWEST = 200, 6


def decode(name: str, data: bytes, source: Source) -> Decoded:
    """Decode delimited text as the profile's source describes it.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    data : bytes
        The whole file, decompressed.
    source : Source
        With ``time`` and ``channels``.

    Raises
    ------
    UsageError
        The encoding is unknown; ``no_time_column``; ``decimal_comma``: numbers are written with a comma that the
        profile does not name.
    DataRejected
        A column that the profile maps is not in the file, two columns bear its name, or the rows are not spaced as the
        profile says.
    """
    if source.time is None or not (source.time.columns or source.time.interval_s):
        raise UsageError("no_time_column", f"The source for {name} names no time column.", "Add 'time' to the source.")
    layout = layout_of(data, source)
    wanted = list(dict.fromkeys([*source.time.columns, *source.channels]))
    _check_columns(name, layout, wanted, source.encoding)
    check_once(name, source.channels)
    count, cells = _cells(layout, wanted)
    whole = count == len(layout.columns)
    cells = _with_points(name, cells, source)
    n = len(layout.rows)
    reason = np.zeros(n, dtype=np.int8)
    reason[~whole] = CODE[Reason.MALFORMED]
    record = np.flatnonzero(whole)
    timed = row_times(name, cells, record, layout.rows.take(record), source.time)
    time = np.full(n, NO_TIME, dtype=np.int64)
    time[record[timed.good]] = timed.time_utc_ns[timed.good]
    unread = record[~timed.good & timed.stated]
    reason[unread] = CODE[Reason.MALFORMED]
    malformed = (
        quotations_amiss(layout, count),
        cells_amiss(layout, count, named=source.columns is not None),
        times_amiss(layout.rows, {key: cells[key] for key in source.time.columns}, record, unread, source.time),
    )
    channels: dict[str, Values] = {}
    for column, mapped in source.channels.items():
        value = cells[column]
        there = value.is_not_null().to_numpy()
        values = channels.setdefault(mapped.channel, Values.empty(n))
        values.put(record[there], (number(value) * mapped.factor + mapped.offset_si)[there])
    rows, sources = np.arange(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    return Decoded(
        rows,
        layout.rows,
        layout.rows,
        time,
        sources,
        (ROW,),
        reason,
        channels,
        timed.notes,
        malformed=tuple(sorted(filter(None, malformed), key=lambda cause: -cause.records)),
    )


def columns_found(data: bytes, source: Source | None, most: int | None = _SHOWN) -> list[str]:
    """Return the first names of columns that a file's header shows, for a person who writes its profile."""
    columns = list(layout_of(data, source or Source(match="*")).columns)
    # those without a name at the end are separators too many
    while columns and not columns[-1]:
        columns.pop()
    return columns[:most]


def titled(data: bytes) -> Titled | None:
    """Return where a table begins that has a title before it or blanks between its cells; None for other text.

    Parameters
    ----------
    data : bytes
        Whole, or its first lines.
    """
    text = as_utf8(data[:SAMPLE], "utf-8").decode("utf-8", errors="replace").splitlines()
    # a block of NULs before the first line is no line of title
    written = list(dropwhile(lambda line: line and not line.strip("\0"), text))
    # tabs at either end may part empty cells
    lines = [(k, line.strip(" \r\v\f")) for k, line in enumerate(written[:_LOOKED_AT]) if line.strip()]
    if len(lines) < _FEWEST:
        return None
    later = [line for _, line in lines[len(lines) // 2 : -1]]
    first = separator_of(lines[0][1])
    # a damaged row or two make no title of a head
    below = [cells_of(line, first) for line in later]
    names = cells_of(lines[0][1], first)
    if first and 2 * sum(fits(cells, names) for cells in below) > len(below):
        return None
    for separator in (",", ";", "\t", "whitespace"):
        counts = {len(cells_of(line, separator)) for line in later}
        if len(counts) == 1 and (count := counts.pop()) > 1:
            break
    else:
        return None
    begin = len(lines) - 1  # the last one may be cut
    while begin and len(cells_of(lines[begin - 1][1], separator)) == count:
        begin -= 1
    place, head = lines[begin]
    cells = cells_of(head, separator)
    named = () if any(map(_is_number, cells)) else tuple(cells)
    return Titled(place, separator, named, count) if begin or separator == "whitespace" else None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _check_columns(name: str, layout: Layout, wanted: list[str], encoding: str) -> None:
    columns = list(layout.columns)
    missing = [column for column in wanted if column not in columns]
    if missing:
        raise DataRejected(
            "columns_missing",
            f"{name} lacks columns that the profile maps: {', '.join(map(repr, missing))}; "
            f"it has {', '.join(map(repr, columns[:_SHOWN])) or 'none'}"
            f"{f' and {len(columns) - _SHOWN} more' if len(columns) > _SHOWN else ''}.",
            advice_on(columns, encoding)
            + "Correct the names in the profile's source, or its separator, header_lines or columns.",
            {"name": name, "missing": missing, "found": columns[:_SHOWN]},
        )
    twice = sorted({column for column in wanted if columns.count(column) > 1})
    if twice:
        raise DataRejected(
            "columns_ambiguous",
            f"{name} has more than one column named {', '.join(map(repr, twice))}.",
            "Name the columns in the profile ('columns', with the file's own names among 'header_lines').",
            {"name": name, "columns": twice},
        )


def _with_points(name: str, cells: dict[str, pl.Series], source: Source) -> dict[str, pl.Series]:
    """Return the cells with a point before the decimals; a comma that the profile does not name is refused."""
    if source.decimal == ",":
        return {column: cell.str.replace(DECIMAL_COMMA, "$1.$2") for column, cell in cells.items()}
    for column in source.channels:
        shown = cells[column].head(_LOOKED_AT_CELLS).drop_nulls()
        with_comma = shown.filter(shown.str.contains(DECIMAL_COMMA))
        if 2 * len(with_comma) > len(shown):
            raise UsageError(
                "decimal_comma",
                f"{name} writes numbers with a decimal comma, such as {with_comma[0]!r} in the column {column!r}; "
                "expected a point.",
                "Write `decimal: ','` into the profile's source for this log.",
                {"name": name, "column": column, "example": with_comma[0]},
            )
    return cells


def _cells(layout: Layout, wanted: list[str]) -> tuple[Index, dict[str, pl.Series]]:
    """Cut the cells of some columns out of the rows that have as many as there are columns.

    Also return how many cells each row has, as `_cut` does; 0 for one that is too long to be cut.
    """
    rows = layout.rows
    count = np.zeros(len(rows), dtype=np.int64)
    parts: list[dict[str, pl.Series]] = [{name: pl.Series(name, [], dtype=pl.String) for name in wanted}]
    looked_at = np.flatnonzero(rows.stop - rows.start <= LONGEST_ROW)
    # so that what is known of every byte is not held for all of a file
    for of_block in np.split(looked_at, _cuts(rows.take(looked_at))):
        if of_block.size:
            count[of_block], cells = _cut(layout, _alone(rows.take(of_block)), wanted)
            parts.append(cells)
    return count, {name: pl.concat([part[name] for part in parts]) for name in wanted}


def _cuts(rows: Spans) -> Index:
    """Return the rows with which blocks of about `_BLOCK` bytes begin, but for the first."""
    block = rows.start // _BLOCK
    return np.flatnonzero(np.diff(block)) + 1


def _alone(rows: Spans) -> Spans:
    """Return rows with a buffer of their own, behind which there is room for one byte."""
    first, last = int(rows.start[0]), int(rows.stop[-1])
    return Spans(np.append(rows.buffer[first:last], np.uint8(_FEED)), rows.start - first, rows.stop - first)


def _cut(layout: Layout, rows: Spans, wanted: list[str]) -> tuple[Index, dict[str, pl.Series]]:
    """Cut the cells of some columns out of the rows of one block, which fill its buffer but for a byte at the end.

    Also return how many cells each row has, `OPEN` where a quotation is not closed. A row that has one empty cell more
    than there are columns, or none for columns without a name at the end, counts as one that has them all.
    """
    buffer, width = rows.buffer, len(layout.columns)
    separator = layout.separator or "\x1f"
    if separator == "whitespace":
        buffer[rows.stop] = _FEED
        buffer, rows = _one_tab(buffer, rows)
        separator = "\t"
    quoted = layout.separator != "whitespace" and bool((buffer == _QUOTE).any())
    mark = buffer == ord(separator) if ord(separator) < 128 else np.zeros(buffer.size, dtype=np.bool_)
    closed = np.ones(len(rows), dtype=np.bool_)
    if quoted:
        inside, closed = inside_quotes(buffer, rows, separator)
        mark &= ~inside
    places = np.flatnonzero(mark)
    low, high = np.searchsorted(places, rows.start), np.searchsorted(places, rows.stop)
    count = np.where(closed, high - low + 1, OPEN)
    more = np.flatnonzero(count == width + 1)
    count[more[_is_empty(Spans(buffer, places[high[more] - 1] + 1, rows.stop[more]))]] = width
    count[(count >= layout.fewest) & (count < width)] = width
    whole = count == width
    low, good = low[whole], rows.take(whole)
    signs = high[whole] - low
    # a file may have very many columns of which few are asked for: only these are cut
    bounds = np.append(places, 0)
    cells = {}
    for name in wanted:
        k = layout.columns.index(name)
        start, stop = good.start, good.stop
        if k:
            start = np.where(k <= signs, bounds[np.minimum(low + k - 1, places.size)] + 1, good.stop)
        if k < width - 1 or more.size:
            stop = np.where(k < signs, bounds[np.minimum(low + k, places.size)], good.stop)
        text = Spans(buffer, start, stop).text(limit=_LONGEST_CELL).alias(name)
        cell = _unquoted(pl.col(name).str.strip_chars()) if quoted else pl.col(name).str.strip_chars()
        cells[name] = text.to_frame().select(cell.replace("", None)).to_series()
    return count, cells


def _is_empty(cells: Spans) -> Flag:
    """Return which cells hold nothing, be it between quotation marks."""
    cells = trimmed(cells)
    buffer, length = cells.buffer, cells.stop - cells.start
    pair = (length == 2) & (buffer[cells.start] == _QUOTE) & (buffer[cells.stop - 1] == _QUOTE)
    empty: Flag = (length == 0) | pair
    return empty


def _unquoted(cell: pl.Expr) -> pl.Expr:
    """Take off the marks round a quoted cell; where they stand otherwise they are part of the text."""
    inner = cell.str.slice(1, cell.str.len_chars() - 2).str.replace_all('""', '"', literal=True).str.strip_chars()
    is_quoted = cell.str.starts_with('"') & cell.str.ends_with('"') & (cell.str.len_chars() >= 2)
    return pl.when(is_quoted).then(inner).otherwise(cell)


def _one_tab(buffer: Bytes, rows: Spans) -> tuple[Bytes, Spans]:
    """Replace every run of blanks within the rows by one tab."""
    blank = is_blank(buffer)
    keep = ~(blank & np.append([False], blank[:-1]))
    before: Index = np.concatenate(([0], np.cumsum(keep, dtype=np.int64)))
    slim = np.where(blank, np.uint8(_TAB), buffer)[keep]
    start, stop = before[rows.start], before[rows.stop]
    slim[stop] = _FEED
    return slim, Spans(slim, start, stop)
