"""Output for a person at a terminal: tables on stdout, progress on stderr while somebody watches."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import isnan
from typing import Any

import click

from kempf.flows.process.progress import Progress, silent


def print_json(content: Any) -> None:
    """Print one JSON document on stdout; NaN becomes null."""
    everywhere = "utf" in (sys.stdout.encoding or "").lower()  # else a letter beyond ASCII would not be JSON
    click.echo(json.dumps(_finite(content), indent=2, ensure_ascii=not everywhere))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and not (abs(value) < float("inf")):
        return None
    return value


def print_note(sentence: str | None) -> None:
    """Print a remark on stderr, beside a result that is whole; nothing for None."""
    if sentence is not None:
        click.echo(f"{click.style('note', fg='yellow')}: {one_line(sentence)}", err=True)


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None) -> None:
    """Print a table on stdout, numbers to the right; plain text off a terminal."""
    rows = [[one_line(cell) for cell in row] for row in rows]
    widths = [max(len(cell) for cell in column) for column in zip(head, *rows, strict=True)]
    numeric = [all(_is_number(row[k]) for row in rows) and bool(rows) for k in range(len(head))]
    if title:
        click.echo(click.style(title, bold=True))
    click.echo(click.style(_line(head, widths, numeric), underline=sys.stdout.isatty()))
    for row in rows:
        click.echo(_line(row, widths, numeric))


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
    return "  ".join(parts).rstrip()


def _is_number(text: str) -> bool:
    return text.strip("+-").replace(".", "", 1).replace("e-", "", 1).replace("e+", "", 1).isdigit() or text in ("", "-")


def number(value: float | None, digits: int = 4) -> str:
    """Write a number with so many significant digits, a dash for none.

    Examples
    --------
    >>> number(-0.000130912), number(None)
    ('-0.0001309', '-')
    """
    return "-" if value is None or isnan(value) else f"{value:.{digits}g}"


@contextmanager
def progress() -> Iterator[Progress]:
    """Give a `Progress` that draws a bar on stderr where that is a terminal, and nothing elsewhere."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def tell(done: int, total: int, what: str) -> None:
            bar.update(task, completed=done, total=total, description=what)

        yield tell
