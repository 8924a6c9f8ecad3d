"""docs/reruns.md is true: its commands run to their output."""

from __future__ import annotations

from pathlib import Path

from tests.docs.console import follow

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "reruns.md").read_text(encoding="utf-8")


def test_the_commands_run_to_their_output(tmp_path: Path) -> None:
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'", "unset KEMPF_WAREHOUSE") == 5
