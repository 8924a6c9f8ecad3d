"""docs/compare.md is true: its examples run to their output, its keys are those of the code."""

from __future__ import annotations

import re
from pathlib import Path

from tests.docs.console import follow

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "compare.md").read_text(encoding="utf-8")


def test_the_examples_run_to_their_output(tmp_path: Path) -> None:
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'")


def test_the_keys_of_where_are_those_of_the_code() -> None:
    source = (ROOT / "pipeline" / "compare" / "misfit.py").read_text(encoding="utf-8")
    documented = set(re.findall(r"^\| `(\w+)` \|", TEXT.partition("## Where it fails")[2], flags=re.MULTILINE))
    assert documented == {"by_phase", "by_side", "by_bin", "by_run", "by_band", "correlations", "worst", "stands_out"}
    for key in documented:
        assert f'"{key}"' in source
