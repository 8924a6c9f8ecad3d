"""docs/no_log.md is true: every setting is given with its default, its example runs, what it quotes was measured."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from kempf.pipeline.estimate.no_log.identify import NoLogSettings
from tests.docs.console import blocks
from tests.estimate.test_no_log import sailed, true_speed

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "no_log.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("key", [f.name for f in fields(NoLogSettings)])
def test_settings_are_as_documented(key: str) -> None:
    default = getattr(NoLogSettings(), key)
    assert f"| `{key}` | {'none' if default is None else default} |" in TEXT


def test_example_runs() -> None:
    (code,) = ("\n".join(lines) for kind, _, lines in blocks(TEXT) if kind == "python")
    names: dict[str, Any] = {}
    exec(compile(code, "no_log.py", "exec"), names)  # noqa: S102 - the example of this repository's own document
    trial, records = sailed(0.6)
    speed = names["both"](*records, trial.truth.wind_arm_per_m).report["speed"]
    assert abs(speed["mean_m_s"] - true_speed(trial, records[0])) < 3.0 * speed["std_m_s"]
    for word in ("mean_m_s", "std_m_s", "current_along_m_s", "correlation_with_current_along", "rounds"):
        assert word in speed


def test_what_it_quotes_was_measured() -> None:
    measured = (ROOT / "benchmarks" / "results" / "no_log.md").read_text(encoding="utf-8").splitlines()
    section = TEXT.partition("## What it costs")[2].partition("\n## ")[0]
    quoted = [line for line in section.splitlines() if line.startswith("|")]
    assert len(quoted) > 8
    assert set(quoted) <= set(measured)
