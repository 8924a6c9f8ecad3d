"""docs/history.md is true: its example runs to its output, its settings are the defaults, its verdicts exist."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

from kempf.pipeline.history.settings import ChangeSettings
from tests.docs.console import blocks, follow

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "history.md").read_text(encoding="utf-8")


def test_the_example_runs_to_its_output(tmp_path: Path) -> None:
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'")
    assert [kind for kind, _, _ in blocks(TEXT)] == ["python", "console"]


def test_every_setting_is_documented_with_its_value() -> None:
    documented = dict(re.findall(r"^\| `(\w+)` \| ([\d.]+) \|", TEXT, flags=re.MULTILINE))
    assert {name: float(value) for name, value in documented.items()} == {
        field.name: float(getattr(ChangeSettings(), field.name)) for field in fields(ChangeSettings)
    }


def test_the_verdicts_are_those_of_the_code() -> None:
    source = (ROOT / "pipeline" / "history" / "changes.py").read_text(encoding="utf-8")
    comment = source.partition("class Changes:")[2].partition("verdict: str")[0].replace("\n    #:", "")
    documented = re.findall(r"``([a-z ]+)``", comment)
    table = TEXT.partition("| verdict |")[2].partition("\n\n")[0]
    assert set(documented) == set(re.findall(r"`([a-z ]+)`", table))
    assert len(documented) == 7
