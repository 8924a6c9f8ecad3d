"""A page that another benchmark has written, read back: its sentences and its tables by the headings above them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from benchmarks import result_page

Row = dict[str, str]


@dataclass(frozen=True)
class Section:
    """What stands under one heading, down to the next of any level."""

    heading: str
    text: str

    def found(self, pattern: str) -> str:
        """Return what the first group of a pattern holds; empty where the section has nothing like it."""
        match = re.search(pattern, self.text)
        return match.group(1) if match else ""

    @property
    def rows(self) -> list[Row]:
        """The rows of its tables by column; of several tables one after the other."""
        found: list[Row] = []
        head: list[str] = []
        for line in self.text.splitlines():
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if not line.startswith("|"):
                head = []
            elif not head:
                head = cells
            elif not all(set(cell) <= {"-"} for cell in cells):
                found.append(dict(zip(head, cells, strict=False)))
        return found


def sections(name: str, folder: Path = result_page.RESULTS) -> list[Section]:
    """Return the sections of ``results/NAME.md``; none where the benchmark was not run."""
    path = folder / f"{name}.md"
    if not path.exists():
        return []
    parts = re.split(r"^#+ (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [Section(heading, text) for heading, text in zip(parts[1::2], parts[2::2], strict=True)]


def section(name: str, heading: str, folder: Path = result_page.RESULTS) -> Section:
    """Return the first section of a page whose heading holds a text; an empty one where there is none."""
    return next((one for one in sections(name, folder) if heading in one.heading), Section(heading, ""))
