"""Measured logs with their own profiles: nobody is accused falsely, in the whole log and in parts of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import measured_ships
from benchmarks.ingest.doctor_traps import examined
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.pipeline.channels.doctor.examine import examine
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.series import Series
from kempf.schemas.profile import VesselProfile

SHARED = Path(__file__).parents[2].parent / "shared"
POND = SHARED / "data" / "esso_osaka"


def pond(kind: str) -> list[Path]:
    if not POND.is_dir():
        pytest.skip(f"the measured data {POND} are not here")
    return sorted(POND.glob(f"{kind}_*.csv.gz"))


def log_of(path: Path) -> Log:
    profile = read_profiles(measured_ships.pond(SHARED).profiles)
    return examined(path, profile).log


def parts(log: Log, count: int) -> Iterator[Log]:
    start = min(int(one.time_utc_ns[0]) for one in log.series.values())
    end = max(int(one.time_utc_ns[-1]) for one in log.series.values())
    for k in range(count):
        yield log.between(start + k * (end - start) // count, start + (k + 1) * (end - start) // count)


def test_circles_on_the_pond_do_not_test_the_rudder() -> None:
    for path in pond("turn"):
        found = examine(log_of(path))
        assert found.findings == (), path.name
        rudder = [o for o in found.outcomes if o.check.startswith("rudder_angle_")]
        assert all(o.state == "untestable" and "one side only" in o.words for o in rudder), path.name


def test_zigzags_on_the_pond_are_clean_and_a_rudder_to_port_is_found() -> None:
    found = 0
    logs = pond("zigzag")
    for path in logs:
        log = log_of(path)
        assert examine(log).verdict == "clean", path.name
        rudder = log.series["rudder_angle"]
        turned = examine(log.with_series({"rudder_angle": Series(rudder.time_utc_ns, -rudder.value)})).findings
        named = {f.key[:2] for x in turned for f in x.faults}
        assert named <= {("sign", ("rudder_angle",))}, path.name
        found += bool(named)
    assert found >= 4


def test_parts_of_the_runs_on_the_pond_are_clean() -> None:
    for path in [*pond("turn"), *pond("zigzag")]:
        for count in (2, 3):
            for part in parts(log_of(path), count):
                assert examine(part).findings == (), path.name


def test_a_boat_that_hardly_moves_is_not_accused() -> None:
    path = SHARED / "data" / "nmea" / "rtk_usv_202412071206_dropouts.txt"
    if not path.is_file():
        pytest.skip(f"the measured log {path} is not here")
    log = examined(path, VesselProfile()).log
    for part in (log, *parts(log, 4)):
        assert examine(part).findings == ()


def test_the_ship_that_capsizes_is_not_clean() -> None:
    if not (SHARED / "trials").is_dir():
        pytest.skip(f"the trial logs in {SHARED} are not here")
    ship = next(one for one in measured_ships.fleet(SHARED) if one.name == "ekaterina")
    content = examined(ship.logs[0], read_profiles(ship.profiles)).content
    assert content["verdict"] == "faults"
    words = " ".join(finding["words"] for finding in content["findings"])
    for name in ("speed_over_ground", "yaw_rate", "roll"):
        assert f"{name} has values that no ship has" in words
    assert "not those of one ship" in words


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_length_ten_times_off_is_said_of_a_trial_log(factor: float) -> None:
    if not (SHARED / "trials_as_sold").is_dir():
        pytest.skip(f"the trial logs in {SHARED} are not here")
    ship = measured_ships.fleet(SHARED, "trials_as_sold")[0]
    profile = read_profiles(ship.profiles)
    assert profile.length_m is not None
    wrong = profile.model_copy(update={"length_m": factor * profile.length_m})
    (finding,) = examined(ship.logs[0], wrong).content["findings"]
    assert finding["words"].startswith("length_m of the profile")
    assert not finding["faults"]
