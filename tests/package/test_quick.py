"""``make quick`` has something of every room."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_quick_covers_every_room() -> None:
    command = ["make", "--dry-run", "--always-make", "quick"]
    planned = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    named = [Path(word) for line in planned.splitlines() for word in line.split() if word.startswith("tests/")]
    assert named
    assert [str(path) for path in named if not (ROOT / path).exists()] == []
    rooms = {path.parts[1] for path in named}
    wanted = {p.name for p in (ROOT / "pipeline").iterdir() if (p / "__init__.py").exists()}
    assert rooms >= wanted | {"warehouse", "flows", "workbench", "docs"}
