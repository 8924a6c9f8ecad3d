"""Real and simulated logs that stand beside the project; skipped where they are absent."""

import gzip
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from kempf.schemas.profile import VesselProfile, parse
from tests.reading import read_log

ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared"


def profile(name) -> VesselProfile:
    return parse(yaml.safe_load((ROOT / "docs" / "profiles" / name).read_text()), name)


def logs(pattern):
    found = sorted(SHARED.glob(pattern))
    if not found:
        return [pytest.param(None, marks=pytest.mark.skip(reason=f"no {pattern} in ../shared"))]
    return [pytest.param(path, id=f"{path.parent.name}-{path.name}") for path in found]


def read(path, profile_name):
    readings = read_log(path.name, path.read_bytes(), profile(profile_name))
    tally = readings.tally
    assert tally.records_read == tally.records_kept + tally.records_rejected
    assert tally.values_read == tally.values_kept + tally.values_rejected
    assert sum(tally.by_reason.values()) == readings.rejected.height
    return readings


def _sound(line):
    body, _, given = line[line.index(b"$") + 1 :].partition(b"*")
    total = 0
    for byte in body:
        total ^= byte
    return given == b"%02X" % total


@pytest.mark.parametrize("path", logs("trials/*/*.nmea.gz"))
def test_trial_nmea(path):
    readings = read(path, "trial_logger.yaml")
    tally = readings.tally
    refused = tally.by_reason["checksum"] + tally.by_reason["duplicate"]
    assert 1 / 700 < refused / tally.records_read < 1 / 400
    lines = gzip.decompress(path.read_bytes()).splitlines()
    assert tally.by_reason["checksum"] == sum(not _sound(line) for line in lines)
    assert set(tally.by_reason) <= {"checksum", "duplicate", "out_of_range", "malformed"}
    assert tally.records_kept > 0.99 * tally.records_read


@pytest.mark.parametrize("path", logs("trials/*/*.csv.gz") + logs("trials/*/*.mcap"))
def test_trial_csv_and_mcap(path):
    readings = read(path, "trial_logger.yaml")
    assert set(readings.tally.by_reason) <= {"out_of_range"}
    assert readings.tally.records_kept > 0.9 * readings.tally.records_read
    assert all(readings.frame[c].null_count() < readings.frame.height for c in ("heading_rad", "rudder_angle_rad"))


@pytest.mark.parametrize("path", logs("data/kvlcc2_hsva/*.dat"))
def test_hsva(path):
    readings = read(path, "hsva_kvlcc2.yaml")
    frame = readings.frame
    assert readings.tally.records_rejected == 0
    assert set(np.diff(frame["time_utc_ns"].to_numpy())) == {50_000_000}
    # the file's own yaw rate is that of its heading, and the rudder turns her to the side it says
    heading, rate = frame["heading_rad"].to_numpy(), frame["yaw_rate_rad_s"].to_numpy()
    assert np.corrcoef(np.gradient(heading, 0.05), rate)[0, 1] > 0.98
    rudder = frame["rudder_angle_rad"].to_numpy()
    assert np.corrcoef(rudder[:-40], rate[40:])[0, 1] > 0.0
    assert abs(rudder).max() == pytest.approx(math.radians(int(path.stem.split("_")[4])), rel=0.03)


@pytest.mark.parametrize("path", logs("data/usv_open_water/*_xy.csv"))
def test_usv_open_water(path):
    readings = read(path, "usv_open_water.yaml")
    assert readings.tally.records_rejected == readings.tally.values_rejected == 0
    assert readings.frame["rudder_order_rad"].abs().max() <= math.radians(30.001)


EXPECTED = {
    "gofree_merrimac.log": 6324,
    "hakefjord.txt": 25721,
    "opencpn_stupan.log": 2238,
    "rtk_usv_202412051751.txt": 11588,
    "rtk_usv_202412071206_dropouts.txt": 4136,
}


@pytest.mark.parametrize("path", logs("data/nmea/*"))
def test_nmea_as_it_comes(path):
    readings = read(path, "trial_logger.yaml")
    assert readings.tally.records_read == EXPECTED[path.name]
    assert readings.frame.height > 100
    if path.name.startswith("rtk"):
        assert set(readings.tally.by_reason) <= {"void"}
        assert "next fix" in readings.notes[0]
        rmc = readings.frame.filter(readings.frame["source"] == "GPRMC")
        vtg = readings.frame.filter(readings.frame["source"].is_in(["GNVTG", "GPVTG"]))
        both = rmc.join(vtg, on="time_utc_ns", suffix="_vtg")
        difference = (both["speed_over_ground_m_s"] - both["speed_over_ground_m_s_vtg"]).abs()
        assert both.height > 0.9 * rmc.height
        assert difference.max() < 0.001
