"""docs/bad_input.md is true: every refusal and flag of a segment is in its tables, and nothing else is."""

import re
from pathlib import Path

import numpy as np

from kempf.pipeline.estimate.record import agreement, checks, jumps, record
from tests.estimate.test_checks import REFUSED

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "bad_input.md").read_text(encoding="utf-8")
SOURCES = [
    (ROOT / "pipeline" / "estimate" / f"{name}.py").read_text(encoding="utf-8")
    for name in ("record/record", "record/checks", "record/agreement", "maximum_likelihood")
]
CODE = re.compile(r'DataRejected\(\s*"(\w+)"(?: if \w+ else "(\w+)")?')


def table(heading: str) -> list[list[str]]:
    section = TEXT.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    rows = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return rows[1:]


def test_every_code_is_told_and_no_other() -> None:
    told = [row[0].strip("`") for row in table("Refused")]
    raised = {code for text in SOURCES for pair in CODE.findall(text) for code in pair if code}
    assert len(told) == len(set(told))
    assert set(told) == raised
    assert {code for _, _, code, _ in REFUSED} <= set(told)
    assert all(len(row) == 3 and all(row) for row in table("Refused"))


def test_every_flag_is_in_the_code() -> None:
    # a message is written in pieces of one line each
    said = " ".join(re.sub(r'"\s+f?"', "", text) for text in SOURCES)
    for row in table("Flagged"):
        assert row[0] in said, row[0]


def test_thresholds_are_as_told() -> None:
    assert f"fewer than {record._MIN_INSTANTS // 2} readings" in TEXT
    assert f"fewer than {record._MIN_INSTANTS} instants" in TEXT
    assert f"less than {np.rad2deg(record._MIN_RUDDER_STD_RAD):.1f} deg rms" in TEXT
    assert f"more than {record._MAX_SPEED_GAP_S:.0f} s" in TEXT
    assert f"beyond {np.rad2deg(checks._FARTHEST_RUDDER_RAD):.0f} deg" in TEXT
    assert f"within {np.rad2deg(checks._FAINT_RUDDER_RAD):.0f} deg" in TEXT
    assert (checks._SWING_PER_RUDDER, checks._EXECUTES) == (10.0, 2)
    low, high = agreement._ALIKE
    assert f"less than {low} or more than {high}" in TEXT
    assert f"more than {np.rad2deg(agreement._LOST_RAD):.0f} deg off" in TEXT
    assert f"more than {np.rad2deg(agreement._CRAB_RAD):.0f} deg off" in TEXT
    assert f"more than {agreement._FASTEST_STREAM_M_S} m/s" in TEXT
    assert (jumps._LARGEST_SHARE, jumps._LEAP) == (0.2, 6.0)
    assert f"57.3, {60} or {max(agreement._RATE_UNITS):.0f} times" in TEXT
