"""docs/compare.md is true: its examples run to their output, its keys are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

from tests.docs.console import File, Names, Shell, difference, steps

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "compare.md").read_text(encoding="utf-8")


def test_the_examples_run_to_their_output(tmp_path: Path) -> None:
    shell, names = Shell(tmp_path), Names()
    try:
        shell.run(f"export PYTHONPATH='{ROOT}'")
        for step in steps(TEXT):
            if isinstance(step, File):
                (tmp_path / step.name).write_text(step.content, encoding="utf-8")
                continue
            found, code = shell.run(names.resolved(step.line))
            assert code == 0, found
            assert difference(step.shown, found, names) is None
    finally:
        shell.close()


def test_the_keys_of_where_are_those_of_the_code() -> None:
    source = (ROOT / "pipeline" / "compare" / "where.py").read_text(encoding="utf-8")
    told = set(re.findall(r"^\| `(\w+)` \|", TEXT.partition("## Where it fails")[2], flags=re.MULTILINE))
    assert told == {"by_phase", "by_side", "by_bin", "by_run", "by_band", "correlations", "worst", "stands_out"}
    for key in told:
        assert f'"{key}"' in source
