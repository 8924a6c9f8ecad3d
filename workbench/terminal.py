"""Output for a person at a terminal: tables on stdout, progress on stderr while somebody watches."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from textwrap import wrap
from typing import Any

import click

from kempf.flows.process.progress import Progress, silent
from kempf.workbench.documents.text import json_text

#: Columns of the narrowest terminal that a table is not to overflow; how narrow a folded column may become.
WIDEST, _NARROWEST = 100, 8
_GAP = "  "
_log = logging.getLogger("kempf.progress")


def print_json(content: Any) -> None:
    """Print one JSON document on stdout; NaN becomes null."""
    everywhere = "utf" in (sys.stdout.encoding or "").lower()  # else a letter beyond ASCII would not be JSON
    click.echo(json_text(content, ascii_only=not everywhere))


def print_note(sentence: str | None) -> None:
    """Print a remark on stderr, beside a result that is whole; nothing for None."""
    if sentence is not None:
        click.echo(f"{click.style('note', fg='yellow')}: {one_line(sentence)}", err=True)


def print_paragraph(text: str, indent: str = "  ") -> None:
    """Print a sentence on stdout in lines of at most `WIDEST` columns, each indented."""
    for line in wrap(text, WIDEST, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False):
        click.echo(line)


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None) -> None:
    """Print a table on stdout, numbers to the right; plain text off a terminal.

    One that is wider than `WIDEST` is made narrower by folding its head, then the widest cells of words.
    """
    rows = [[one_line(cell) for cell in row] for row in rows]
    numeric = [all(_is_number(row[k]) for row in rows) and bool(rows) for k in range(len(head))]
    widths = _widths(head, rows)
    if title:
        click.echo(click.style(title, bold=True))
    for line in _folded(head, widths, numeric):
        click.echo(click.style(line, underline=sys.stdout.isatty()))
    for row in rows:
        for line in _folded(row, widths, numeric):
            click.echo(line)


def _widths(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[int]:
    """Return the widths of the columns: what is in them, less where the table would be too wide."""
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(head)
    inside = [max(map(len, column), default=0) for column in columns]
    widths = [max(len(name), width) for name, width in zip(head, inside, strict=True)]
    over = sum(widths) + len(_GAP) * (len(widths) - 1) - WIDEST
    words = [_longest_word([name]) for name in head]
    # the head first, the widest of the columns that can give; then what is in them
    for least in (
        [max(word, width) for word, width in zip(words, inside, strict=True)],
        [max(word, _longest_word(column), _NARROWEST) for word, column in zip(words, columns, strict=True)],
    ):
        while over > 0:
            room = [width if width > low else 0 for width, low in zip(widths, least, strict=True)]
            if not any(room):
                break
            widths[room.index(max(room))] -= 1
            over -= 1
    return widths


def _longest_word(cells: Sequence[str]) -> int:
    return max((len(word) for cell in cells for word in cell.split(" ")), default=0)


def _folded(cells: Sequence[str], widths: Sequence[int], numeric: Sequence[bool]) -> list[str]:
    """Return the lines of a row, its cells folded between words."""
    folded = [wrap(c, w, break_long_words=False, break_on_hyphens=False) if len(c) > w else [c]
              for c, w in zip(cells, widths, strict=True)]  # fmt: skip
    return [_line(list(parts), widths, numeric) for parts in zip_longest(*folded, fillvalue="")]


def short_ids(names: Iterable[str]) -> dict[str, str]:
    """Return the beginnings of ids that tell them apart, for a table; commands that take an id take these.

    Examples
    --------
    >>> short_ids(["ps-ba3d03040ef0caf4", "ps-7cbd05343e3a84a8"])
    {'ps-ba3d03040ef0caf4': 'ps-ba3d0304', 'ps-7cbd05343e3a84a8': 'ps-7cbd0534'}
    """
    different = list(dict.fromkeys(names))
    begin = {name: name[: name.find("-") + 9] for name in different}
    return begin if len(set(begin.values())) == len(different) else {name: name for name in different}


def one_line(text: str) -> str:
    r"""Return a text with line ends, escape sequences and bytes that are no letters written out.

    Examples
    --------
    >>> one_line("day 1\x1b[2J.log")
    'day 1\\x1b[2J.log'
    """
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def _line(cells: Sequence[str], widths: Sequence[int], numeric: Sequence[bool]) -> str:
    parts = [c.rjust(w) if n else c.ljust(w) for c, w, n in zip(cells, widths, numeric, strict=True)]
    return _GAP.join(parts).rstrip()


def _is_number(text: str) -> bool:
    return text.strip("+-").replace(".", "", 1).replace("e-", "", 1).replace("e+", "", 1).isdigit() or text in ("", "-")


def _logged(done: int, total: int, what: str) -> None:
    _log.info("%s (%d of %d)", what, done, total)


@contextmanager
def progress_bar() -> Iterator[Progress]:
    """Give a `Progress` that draws a bar on stderr where that is a terminal, and log lines elsewhere."""
    if not sys.stderr.isatty():
        yield _logged if _log.isEnabledFor(logging.INFO) else silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def update(done: int, total: int, what: str) -> None:
            bar.update(task, completed=done, total=total, description=what)

        yield update
