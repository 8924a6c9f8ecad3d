"""Write the outputs in documents anew from real runs.

``python -m benchmarks.documents.refresh_documents [docs/compare.md ...]``.

Without a name the README. Every console block of a document is run in an empty folder, in its order. Commands and the
places of ``...`` stay as they are.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.docs.console import Command, Names, learn, renewed, sessions_in, steps

README = Path(__file__).parents[2] / "README.md"


def refreshed(text: str, folder: Path) -> str:
    """Return a document with the outputs that its commands have in ``folder``."""
    lines, names, sessions = text.splitlines(), Names(), sessions_in(folder)
    edits: list[tuple[int, int, list[str]]] = []
    try:
        sessions["console"].run(f"export PYTHONPATH='{README.parent}'")
        for step in steps(text):
            if not isinstance(step, Command):
                (folder / step.name).write_text(step.content, encoding="utf-8")
                continue
            command = names.resolved(step.line)
            found, code = sessions[step.kind].run(command)
            typed = step.typed(command)
            print(*typed, sep="\n")
            if code:
                raise SystemExit("\n".join(found))
            learn(step.shown, found, names)
            edits.append((step.first - len(typed), step.last, [*typed, *renewed(step, found)]))
    finally:
        for session in sessions.values():
            session.close()
    for first, last, new in reversed(edits):
        lines[first:last] = new
    return "\n".join(lines) + "\n"


def main() -> None:
    for path in [Path(name) for name in sys.argv[1:]] or [README]:
        with tempfile.TemporaryDirectory() as folder:
            path.write_text(refreshed(path.read_text(encoding="utf-8"), Path(folder)), encoding="utf-8")


if __name__ == "__main__":
    main()
