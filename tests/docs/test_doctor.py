"""docs/doctor.md is true: its commands run, its checks are those of the code, its thresholds are the code's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

from kempf.pipeline.channels.doctor import (
    heading_course,
    heading_rate,
    misalignment,
    motion,
    plausible,
    rudder_order,
    rudder_turn,
    standstill,
    track,
    water_speed,
)
from kempf.pipeline.channels.doctor.examine import examine
from kempf.pipeline.channels.doctor.faults import Kind
from kempf.pipeline.channels.doctor.log import SLOWEST_M_S
from kempf.pipeline.channels.doctor.outcome import SURE
from tests.docs.console import follow
from tests.doctor import closed_form_ship

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "doctor.md").read_text(encoding="utf-8")


def test_the_example_runs_to_its_output(tmp_path: Path) -> None:
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'") == 4
    assert (tmp_path / "ferry.png").stat().st_size > 10_000


def test_every_check_is_listed() -> None:
    listed = re.findall(r"`([a-z_.]+)`", TEXT.partition("| check |")[2].partition("\n\n")[0])
    patterns = [name.replace(".", r"\.").replace(r"\.\.\.", r"[a-z_]*") for name in listed]
    for outcome in examine(closed_form_ship.log()).outcomes:
        assert any(re.fullmatch(pattern, outcome.check) for pattern in patterns), outcome.check


def test_thresholds_are_the_codes() -> None:
    def row(check: str) -> str:
        return next(line for line in TEXT.splitlines() if line.startswith(f"| `{check}"))

    for check, (low, high) in (
        ("heading_rate", heading_rate.SLOPES),
        ("heading_course", heading_course.SLOPES),
        ("heading_body", heading_course._BODY_SLOPES),
        ("path_", track.RATIOS),
        ("water_speed_", water_speed._RATIOS),
        ("rudder_order_angle", rudder_order._SLOPES),
    ):
        assert f"{low:g} to {high:g}" in row(check), check
    assert f"within {misalignment._DEVIATION_DEG:g} deg" in row("legs_")
    assert f"within {track._ANGLES_DEG[1]:g} deg" in row("bearing_")
    assert f"within {rudder_turn._NEUTRAL_DEG:g} deg" in row("rudder_angle_")
    assert f"within {rudder_order._OFFSETS_DEG[1]:g} deg" in row("rudder_order_angle")
    assert f"for {standstill._LEAST_S:.0f} s or more" in row("heading_standstill")
    assert f"at most {standstill._TURN_DEG:g} deg" in row("heading_standstill")
    assert (SURE, motion.STREAM_SHARE) == (4.0, 1 / 8)
    assert f"{motion.STREAM_STD_M_S:g} m/s, or an eighth" in TEXT
    assert f"exceeds {SLOWEST_M_S:g} m/s" in TEXT
    assert f"below {motion._DRIFTS_M_S:g} m/s at sea" in TEXT
    assert f"at most {plausible._DAMAGED:.0%}".replace("%", " %") in row("range_")
    size = row("size_and_speed")
    assert f"up to {plausible._OF_TRIAL:g} times the trial speed" in size
    assert f"Froude number up to {plausible._FROUDE[1]:g}" in size
    assert f"over speed up to {plausible._TURN[1]:g}" in size
    assert "{:g} to {:g}".format(*plausible._TURN_OF_RUDDER) in size


def test_every_kind_of_fault_is_listed() -> None:
    table = TEXT.partition("| fault |")[2].partition("\n\n")[0]
    for kind in get_args(Kind):
        assert kind.replace("_", " ") in table, kind
