"""How delimited text is laid out: the sign between its cells, the names of its columns, its rows."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.ingest.encoding import as_utf8
from kempf.pipeline.ingest.quoting import has_open_mark
from kempf.pipeline.ingest.sniff import separator_of
from kempf.pipeline.ingest.spans import Spans, as_bytes, is_blank, lines_of, trimmed
from kempf.schemas.profile import Source

#: Longest row that is cut into cells, bytes.
LONGEST_ROW = 1 << 20


@dataclass(frozen=True, eq=False)
class Layout:
    """How the lines of a file are laid out."""

    #: Every line of data that is not blank, shape (n,).
    rows: Spans
    #: Names of the columns as the header or the profile has them; empty for one that has none.
    columns: tuple[str, ...]
    #: One character, ``whitespace``, or None for a single column.
    separator: str | None

    @property
    def fewest(self) -> int:
        """Cells that a row has at least: columns without a name at the end need none."""
        return fewest_cells(self.columns)


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
    if source.header_lines or source.columns is None:
        # a block of zeros that a logger left behind before its first line is none of the lines that the profile counts
        lines = _from_text_on(lines)
    behind_header = np.arange(len(lines)) >= source.header_lines
    lines = lines.take(behind_header & (lines.stop > lines.start))
    written = _from_text_on(lines)
    first = written.take(np.arange(min(1, len(written))))
    separator = source.separator or separator_of(_text_of(first))
    if source.columns is not None:
        return Layout(_untrimmed(lines, separator), tuple(source.columns), separator)
    header = _text_of(_untrimmed(first, separator)).strip("\0")
    names = cells_of(header, separator) if len(first) else []
    return Layout(_untrimmed(written.take(np.arange(1, len(written))), separator), tuple(names), separator)


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
    # a quotation that is never closed is one of damage
    if separator not in {None, "whitespace"} and '"' in line and not has_open_mark(line, str(separator)):
        try:
            # a blank that is skipped must not be the separator
            (parts,) = csv.reader([line], delimiter=separator, skipinitialspace=separator != " ")
            return [part.strip() for part in parts]
        except csv.Error:
            pass  # longer than any cell it takes, or with a line end within
    parts = [line] if separator is None else line.split() if separator == "whitespace" else line.split(separator)
    return [part.strip().strip('"').strip() for part in parts]


def fewest_cells(names: Sequence[str]) -> int:
    """Return how many cells a row has at least: as many as there are names, without empty ones at the end.

    Examples
    --------
    >>> fewest_cells(["t", "", "heading", ""])
    3
    """
    count = len(names)
    while count > 1 and not names[count - 1]:
        count -= 1
    return count


def fits(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a row has as many cells as there are names.

    Many loggers write a separator behind the last cell too, be it in the rows or in the header: a cell that is empty,
    or a column without a name.

    Examples
    --------
    >>> fits(["1", "90", ""], ["t", "heading"]), fits(["1", "90"], ["t", "heading", ""]), fits(["1"], ["t", "heading"])
    (True, True, False)
    """
    more = len(cells) - len(names)
    return more == 1 and not cells[-1] if more > 0 else len(cells) >= fewest_cells(names)


def _text_of(line: Spans) -> str:
    """Return the text of one line, or of none."""
    return "".join(line.text(limit=1 << 30))


def _from_text_on(lines: Spans) -> Spans:
    """Leave out the lines at the beginning that hold nothing but NULs, and blank ones among them."""
    if len(lines) == 0 or lines.stop[0] == lines.start[0] or lines.buffer[lines.start[0] : lines.stop[0]].any():
        return lines
    rest = lines.buffer[lines.stop[0] :]
    written = (rest != 0) & ~is_blank(rest)
    if not written.any():
        return lines.take(np.arange(0))
    begin = int(lines.stop[0]) + int(np.argmax(written))
    return lines.take(lines.stop > begin)


def _untrimmed(lines: Spans, separator: str | None) -> Spans:
    """Give back the tabs at either end of the lines where the tab is the separator: they stand for empty cells."""
    if separator != "\t" or len(lines) == 0:
        return lines
    full = lines_of(lines.buffer)
    at = np.searchsorted(full.start, lines.start, side="right") - 1
    return full.take(at)
