"""Write the outputs in documents anew from real runs.

``python -m benchmarks.documents.refresh_documents [docs/compare.md ...]``.

Without a name the README. Every console block of a document is run in an empty folder, in its order. Commands and the
places of ``...`` stay as they are.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.docs.console import Command, Names, Shell, learn, renewed, steps

README = Path(__file__).parents[2] / "README.md"


def refreshed(text: str, folder: Path) -> str:
    """Return a document with the outputs that its commands have in ``folder``."""
    lines, names, shell = text.splitlines(), Names(), Shell(folder)
    edits: list[tuple[int, int, list[str]]] = []
    try:
        for step in steps(text):
            if not isinstance(step, Command):
                (folder / step.name).write_text(step.content, encoding="utf-8")
                continue
            command = names.resolved(step.line)
            found, code = shell.run(command)
            print(f"{code} $ {command}")
            learn(step.shown, found, names)
            edits.append((step.first - 1, step.last, [f"$ {command}", *renewed(step, found)]))
    finally:
        shell.close()
    for first, last, new in reversed(edits):
        lines[first:last] = new
    return "\n".join(lines) + "\n"


def main() -> None:
    for path in [Path(name) for name in sys.argv[1:]] or [README]:
        with tempfile.TemporaryDirectory() as folder:
            path.write_text(refreshed(path.read_text(encoding="utf-8"), Path(folder)), encoding="utf-8")


if __name__ == "__main__":
    main()
