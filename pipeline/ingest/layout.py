"""How delimited text is laid out: the sign between its cells, the names of its columns, its rows."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.encoding import as_utf8
from kempf.pipeline.ingest.sniff import separator_of
from kempf.pipeline.ingest.spans import Spans, as_bytes, lines_of, trimmed
from kempf.schemas.profile import Source

#: Longest row that is cut into cells, bytes.
LONGEST_ROW = 1 << 20

#: Rows, spread over the file, by which it is seen how its rows end.
_LOOKED_AT = 40


@dataclass(frozen=True, eq=False)
class Layout:
    """How the lines of a file are laid out."""

    #: Every line of data that is not blank, shape (n,).
    rows: Spans
    #: Names of the columns; empty for one that has none.
    columns: tuple[str, ...]
    #: One character, ``whitespace``, or None for a single column.
    separator: str | None


def layout_of(data: bytes, source: Source) -> Layout:
    """Return how a file is laid out.

    Parameters
    ----------
    data : bytes
        The whole file, decompressed.
    source : Source
        What it leaves open is taken from the first line.

    Raises
    ------
    UsageError
        ``unknown_encoding``.
    """
    lines = trimmed(lines_of(as_bytes(as_utf8(data, source.encoding))))
    behind_header = np.arange(len(lines)) >= source.header_lines
    lines = lines.take(behind_header & (lines.stop > lines.start))
    first = lines.take(np.arange(min(1, len(lines)))).text(limit=1 << 30).to_list()
    separator = source.separator or separator_of(first[0] if first else "")
    if source.columns is not None:
        names, rows = source.columns, _untrimmed(lines, separator)
    else:
        names = cells_of(first[0].strip("\0"), separator) if first else []
        rows = _untrimmed(lines.take(np.arange(1, len(lines))), separator)
    if separator is not None and separator != "whitespace" and len(rows):
        spread = np.unique(np.linspace(0, len(rows) - 1, _LOOKED_AT).astype(np.int64))
        shown = rows.take(spread).text(limit=LONGEST_ROW).to_list()
        names = fitted(names, [cells_of(row, separator) for row in shown])
    return Layout(rows, tuple(names), separator)


def cells_of(line: str, separator: str | None) -> list[str]:
    """Return the cells of one line, without the blanks and the quotation marks around them.

    Parameters
    ----------
    separator : str or None
        One character, ``whitespace``, or None for a line that is one cell.

    Examples
    --------
    >>> cells_of('time, "depth, below keel" ,', ",")
    ['time', 'depth, below keel', '']
    """
    marks = line.count('"')
    # a mark that is never closed is one of damage
    if separator is not None and separator != "whitespace" and marks and marks % 2 == 0:
        try:
            # a blank that is skipped must not be the separator
            (parts,) = csv.reader([line], delimiter=separator, skipinitialspace=separator != " ")
            return [part.strip() for part in parts]
        except csv.Error:
            pass  # longer than any cell it takes, or with a line end within
    parts = [line] if separator is None else line.split() if separator == "whitespace" else line.split(separator)
    return [part.strip().strip('"').strip() for part in parts]


def fitted(names: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the names of the columns with as many at their end as the rows have cells.

    Many loggers write a separator behind the last cell too, be it in the rows or in the header: a cell that is empty,
    or a column without a name.

    Parameters
    ----------
    names : sequence of str
        As the header has them.
    rows : sequence of sequence of str
        The cells of some rows.

    Examples
    --------
    >>> fitted(["t", "heading"], [["1", "90", ""], ["2", "91", ""]])
    ['t', 'heading', '']
    """
    names = list(names)
    behind = sum(len(cells) == len(names) + 1 and not cells[-1] for cells in rows)
    short = sum(len(cells) == len(names) - 1 for cells in rows)
    if 2 * behind > len(rows):
        return [*names, ""]
    if 2 * short > len(rows) and not names[-1]:
        return names[:-1]
    return names


def _untrimmed(lines: Spans, separator: str | None) -> Spans:
    """Give back the tabs at the end of the lines where the tab is the separator: they stand for empty cells."""
    if separator != "\t" or len(lines) == 0:
        return lines
    full = lines_of(lines.buffer)
    at = np.searchsorted(full.start, lines.start, side="right") - 1
    return full.take(at)
