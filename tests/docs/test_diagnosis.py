"""docs/diagnosis.md is true: its tour runs to its output, its thresholds and verdicts are those of the code."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import get_args

from kempf.pipeline.diagnose.screening.ridge_reference import TERMS
from kempf.pipeline.diagnose.verdicts.effect_finding import EffectFinding
from kempf.pipeline.diagnose.verdicts.verdict import Verdict
from tests.docs.console import Command, follow, sailed, steps

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")


def test_the_tour_runs_to_its_output(late_ingested: Path, tmp_path: Path) -> None:
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'", sailed(late_ingested))
    assert all(isinstance(step, Command) for step in steps(TEXT))


def test_the_thresholds_are_those_of_the_code() -> None:
    rows = re.findall(r"^\| [^|]+ \| ([\d.]+) \| `(\w+)\.([\w.]+)` \|$", TEXT, flags=re.MULTILINE)
    assert len(rows) == TEXT.partition("## Thresholds")[2].partition("\n## ")[0].count("\n|") - 2
    for value, module, path in rows:
        rooms = (ROOT / "pipeline" / room for room in ("diagnose", "estimate", "shooting"))
        (file,) = (file for room in rooms for file in room.rglob(f"{module}.py"))
        found = import_module(".".join(["kempf", *file.relative_to(ROOT).with_suffix("").parts]))
        for name in path.split("."):
            found = getattr(found, name)
        assert float(value) == found, path


def test_every_verdict_is_documented() -> None:
    section = TEXT.partition("## The verdicts")[2].partition("\n## ")[0]
    whole, _, single = section.partition("Each effect has a verdict")
    documented = [set(re.findall(r"^\| `(\w+)` \|", part, flags=re.MULTILINE)) for part in (whole, single)]
    of_an_effect = get_args(import_module("typing").get_type_hints(EffectFinding)["verdict"])
    assert documented == [set(get_args(Verdict)), set(of_an_effect)]


def test_the_reference_has_as_many_terms_as_documented() -> None:
    assert f"{len(TERMS)} smooth terms" in TEXT
