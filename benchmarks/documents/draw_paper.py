"""Write the output and the figures of docs/paper.md anew from a real run.

``python -m benchmarks.documents.draw_paper``.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from shutil import copyfile

from benchmarks.documents.refresh_documents import refreshed

PAGE = Path(__file__).parents[2] / "docs" / "paper.md"


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = refreshed(PAGE.read_text(encoding="utf-8"), folder)
        PAGE.write_text(text, encoding="utf-8")
        target = PAGE.parent / "figures" / "paper"
        target.mkdir(parents=True, exist_ok=True)
        for path in sorted((folder / "kempf-paper").iterdir()):
            copyfile(path, target / path.name)


if __name__ == "__main__":
    main()
