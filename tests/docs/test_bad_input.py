"""docs/bad_input.md is true: every refusal and flag of a segment is in its tables, and nothing else is."""

import re
from pathlib import Path

import numpy as np

from kempf.pipeline.channels import grid
from kempf.pipeline.channels.doctor import outcome
from kempf.pipeline.channels.doctor.faults import UNITS
from kempf.pipeline.estimate.record import channel_faults, checks, cut, jumps
from tests.estimate.test_checks import REFUSED

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "bad_input.md").read_text(encoding="utf-8")
SOURCES = [
    (ROOT / "pipeline" / f"{name}.py").read_text(encoding="utf-8")
    for name in (
        "estimate/record/cut",
        "estimate/record/checks",
        "estimate/record/channel_faults",
        "estimate/maximum_likelihood",
        "estimate/no_log/companions",
        "channels/doctor/verdict",
        "channels/there_and_back",
    )
]
CODE = re.compile(r'DataRejected\(\s*"(\w+)"(?: if \w+ else "(\w+)")?')


def table(heading: str) -> list[list[str]]:
    section = TEXT.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    rows = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("| ")]
    return rows[1:]


def test_every_code_is_listed_and_no_other() -> None:
    listed = [row[0].strip("`") for row in table("Refused")]
    raised = {code for text in SOURCES for pair in CODE.findall(text) for code in pair if code}
    raised |= set(channel_faults.CODES.values())
    assert len(listed) == len(set(listed))
    assert set(listed) == raised
    assert {code for _, _, code, _ in REFUSED} <= set(listed)
    assert all(len(row) == 3 and all(row) for row in table("Refused"))


def test_every_flag_is_in_the_code() -> None:
    # a message is written in pieces of one line each
    said = " ".join(re.sub(r'"\s+f?"', "", text) for text in SOURCES)
    for row in table("Flagged"):
        assert row[0] in said, row[0]


def test_thresholds_are_the_codes() -> None:
    assert f"fewer than {cut._MIN_INSTANTS // 2} readings" in TEXT
    assert f"fewer than {cut._MIN_INSTANTS} instants" in TEXT
    assert f"less than {np.rad2deg(cut._MIN_RUDDER_STD_RAD):.1f} deg rms" in TEXT
    assert f"more than {grid.LONGEST_SPEED_GAP_S:.0f} s" in TEXT
    assert f"beyond {np.rad2deg(checks._FARTHEST_RUDDER_RAD):.0f} deg" in TEXT
    assert f"within {np.rad2deg(checks._FAINT_RUDDER_RAD):.0f} deg" in TEXT
    assert (checks._SWING_PER_RUDDER, checks._EXECUTES) == (10.0, 2)
    assert f"more than {np.rad2deg(channel_faults.FARTHEST_RAD):.0f} deg off" in TEXT
    assert (outcome.DOUBTFUL, outcome.SURE) == (2.0, 4.0)
    assert (jumps._LARGEST_SHARE, jumps._LEAP) == (0.2, 6.0)
    assert f"57.3, {60} or {UNITS['rad/s']['rad/s taken for deg/min']:.0f} times" in TEXT
