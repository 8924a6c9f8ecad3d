"""The page that a benchmark writes of itself: command, library versions, tables; no time of day, no path of a machine.

Equal code and equal data write equal bytes, but for the figures that are times.
"""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

#: Where the measured data lie unless ``--data`` says otherwise: beside the repository.
DATA = Path(__file__).parents[1].parent / "shared"
RESULTS = Path(__file__).parent / "results"
LIBRARIES = ("numpy", "scipy", "numba", "polars", "deltalake", "mcap")


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table."""
    return [f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *rows)]


def write(name: str, title: str, lines: Sequence[str], *, options: str = "", page: str = "") -> Path:
    """Write the page of a benchmark, ``results/NAME.md`` without its room, and return its path.

    Parameters
    ----------
    name : str
        Of the benchmark's module below `benchmarks`, such as ``identify.hsva``.
    lines : sequence of str
        Markdown after the line that names command and versions.
    options : str, optional
        Options of the command that change the result.
    page : str, optional
        Another name of the page, where a command writes several.
    """
    RESULTS.mkdir(exist_ok=True)
    command = f"python -m benchmarks.{name} {options}".strip()
    versions = ", ".join(f"{library} {version(library)}" for library in LIBRARIES)
    head = [f"# {title}", "", f"`{command}`; Python {platform.python_version()}, {versions}.", ""]
    path = RESULTS / f"{page or name.rpartition('.')[2]}.md"
    path.write_text("\n".join([*head, *lines, ""]), encoding="utf-8")
    return path
