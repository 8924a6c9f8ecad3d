"""docs/predict.md is true: its examples run to their output, its codes and numbers are those of the code."""

from __future__ import annotations

import re
from math import degrees
from pathlib import Path

import pytest

from kempf.pipeline.manoeuvre import draws, prediction
from kempf.pipeline.manoeuvre.rudder_rate import SOLAS_RAD_S
from kempf.pipeline.manoeuvre.surge import usual
from tests.docs.console import follow

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "predict.md").read_text(encoding="utf-8")


def test_the_examples_run_to_their_output(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'")


def test_the_numbers_are_those_of_the_code() -> None:
    assert f"{draws.DRAWS} ships are drawn" in TEXT
    assert f"{degrees(SOLAS_RAD_S):.2f} deg/s" in TEXT
    assert f"tau {usual.TAU_MEDIAN:g} lengths within a factor of 2" in TEXT
    means, stds = [*usual.LOSS_MEAN, usual.BESIDE_MEAN], [*usual.LOSS_STD, usual.BESIDE_STD]
    drift, rate, rudder, wind, beside = (f"{mean:g} ± {std:g}" for mean, std in zip(means, stds, strict=True))
    said = f"k_vr {drift} of tau, k_r {rate} alone and {beside} of tau beside drift, k_d {rudder}, k_w {wind} of tau"
    assert said in " ".join(TEXT.split())
    assert pytest.approx(0.8) == prediction.ENOUGH


def test_every_code_is_raised() -> None:
    sources = [*(ROOT / "flows" / "jobs").rglob("*.py"), *(ROOT / "pipeline" / "manoeuvre").rglob("*.py")]
    text = "".join(path.read_text(encoding="utf-8") for path in [*sources, ROOT / "workbench" / "cli" / "predict.py"])
    rows = TEXT.partition("## Refusals")[2]
    for code in re.findall(r"`([a-z]+(?:_[a-z]+)+)`", rows):
        assert f'"{code}"' in text, code
