"""The real traps: measured logs read without the line that mends them."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.ingest.doctor_traps import Trap, examined, traps

SHARED = Path(__file__).parents[2].parent / "shared"


def trap(name: str) -> Trap:
    if not (SHARED / "data").is_dir():
        pytest.skip(f"the measured data {SHARED} are not here")
    return next(one for one in traps(SHARED) if one.name == name)


@pytest.mark.parametrize(
    ("name", "log", "lines"),
    [
        (
            "earth-fixed velocities read as body-fixed",
            "Z_20_10_P",
            {"dx_dt: {channel: velocity_north, unit: m/s}", "dy_dt: {channel: velocity_east, unit: m/s}"},
        ),
        ("rudder positive to port", "Z_20_10_P", {"rudder: {channel: rudder_angle, unit: deg, positive: port}"}),
        ("knots unlabelled", "zigzag", {"speed: {channel: speed_over_ground, unit: kn}"}),
    ],
)
def test_the_trap_is_found_and_its_line_written(name: str, log: str, lines: set[str]) -> None:
    one = trap(name)
    path = next(p for p in one.logs if log in p.name)
    (finding,) = examined(path, one.profile).content["findings"]
    assert finding["certain"]
    assert set(finding["faults"][0]["profile"]) == lines


def test_the_antenna_is_62_to_78_degrees_off_the_bow() -> None:
    one = trap("antenna baseline off the bow")
    (finding,) = examined(one.logs[0], one.profile).content["findings"]
    (fault,) = finding["faults"]
    assert (fault["kind"], fault["channels"]) == ("offset", ["heading"])
    assert 62.0 < fault["entries"]["GNHDT.heading"]["offset"] < 78.0


@pytest.mark.parametrize("ship", ["aurora", "gannet"])
def test_honest_logs_are_clean(ship: str) -> None:
    from benchmarks.measured_ships import fleet
    from kempf.flows.jobs.ingest.files import read_profiles

    if not (SHARED / "trials").is_dir():
        pytest.skip(f"the trial logs in {SHARED} are not here")
    found = next(one for one in fleet(SHARED) if one.name == ship)
    assert examined(found.logs[0], read_profiles(found.profiles)).content["verdict"] == "clean"
