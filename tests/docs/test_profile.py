"""docs/profile.md is true: every profile in it is valid, reads the log beside it, and keys and channels are named."""

import itertools
from math import radians
from pathlib import Path

import polars as pl
import pytest
import yaml

from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.ingest.readings import Readings
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.manoeuvre import SteadyCourse
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import TrialSettings, simulate_trial
from kempf.schemas.channels import CHANNELS
from kempf.schemas.profile import (
    Antenna,
    ChannelMap,
    Source,
    TimeColumn,
    VesselProfile,
    merge,
    overlay,
    parse,
)
from kempf.schemas.units import TO_SI
from tests.docs.console import blocks
from tests.ingest.test_mcap_messages import START, fix, header, imu, ros
from tests.reading import read_log

FOLDER = Path(__file__).parents[2] / "docs"
TEXT = (FOLDER / "profile.md").read_text(encoding="utf-8")
BLOCKS = [(kind, "\n".join(lines) + "\n") for kind, _, lines in blocks(TEXT)]
PROFILES = [parse(yaml.safe_load(text), "docs/profile.md") for kind, text in BLOCKS if kind == "yaml"]


def profile(vessel: str) -> VesselProfile:
    return next(p for p in PROFILES if p.vessel == vessel)


def read(vessel: str) -> Readings:
    """Read the log that stands behind a profile."""
    found = profile(vessel)
    at = next(k for k, (kind, text) in enumerate(BLOCKS) if kind == "yaml" and f"vessel: {vessel}\n" in text)
    kind, log = BLOCKS[at + 1]
    assert kind == "text"
    return read_log(found.sources[0].match.replace("*", "x"), log.encode(), found)


def test_every_example_reads_its_log_whole() -> None:
    behind = [text for (kind, text), (following, _) in itertools.pairwise(BLOCKS) if following == "text"]
    assert len(behind) == 7
    for text in behind:
        vessel = yaml.safe_load(text)["vessel"]
        readings = read(vessel)
        assert readings.tally.records_rejected == readings.tally.values_rejected == 0
        assert readings.tally.records_kept >= 2
        for mapped in profile(vessel).sources[0].channels.values():
            assert readings.frame[CHANNELS[mapped.channel].column].is_not_null().any(), (vessel, mapped)


def test_delimited_example_turns_the_rudder_and_corrects_the_compass() -> None:
    row = read("aurora").frame.row(1, named=True)
    assert row["rudder_angle_rad"] == pytest.approx(radians(5.0))
    assert row["heading_rad"] == pytest.approx(radians(20.0))
    assert row["speed_over_ground_m_s"] == pytest.approx(10 * 1852 / 3600)
    assert row["yaw_rate_rad_s"] == pytest.approx(radians(0.2))


def test_elapsed_example_counts_from_its_start() -> None:
    times = read("model_a").frame["time_utc_ns"].to_list()
    assert times == [1_746_252_000_000_000_000, 1_746_252_000_050_000_000]


def test_date_and_time_of_day_are_joined() -> None:
    assert read("coaster").frame["time_utc_ns"].to_list() == [1_746_252_000_000_000_000, 1_746_252_000_500_000_000]


def test_rows_of_one_second_are_counted() -> None:
    times = read("launch").frame["time_utc_ns"].to_list()
    assert times == [1_746_252_000_000_000_000 + k * 135_200_000 for k in range(3)]


def test_velocities_become_speed_and_course() -> None:
    readings = read("model_b")
    assert readings.frame["time_utc_ns"][0] == 1_746_252_000_000_000_000
    instruments = from_readings(readings.frame)
    assert instruments.series["speed_over_ground"].value[0] == pytest.approx(1.179)
    assert instruments.series["course_over_ground"].value[0] == pytest.approx(0.0)


def test_nmea_example_corrects_three_instruments() -> None:
    frame = read("tug").frame
    stated = {
        column: frame[column].drop_nulls().to_list() for column in ("rudder_angle_rad", "heading_rad", "roll_rad")
    }
    assert stated["rudder_angle_rad"] == pytest.approx([radians(5.0)])
    assert stated["heading_rad"] == pytest.approx([radians(22.0)])
    assert stated["roll_rad"] == pytest.approx([radians(-0.04)])


def test_mcap_example_reads_a_logger_file() -> None:
    data = to_mcap(simulate_trial(TrialSettings(HULLS["ferry"], (SteadyCourse(30.0),))))
    readings = read_log("day.mcap", data, profile("ferry"))
    for mapped in profile("ferry").sources[0].channels.values():
        assert readings.frame[CHANNELS[mapped.channel].column].is_not_null().sum() > 10


def test_ros_example_reads_axes_of_ros() -> None:
    twist = {"linear": {"x": 3.0, "y": 4.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}}
    messages = [
        ("/fix", "sensor_msgs/msg/NavSatFix", fix(0)),
        ("/vel", "geometry_msgs/msg/TwistStamped", {"header": header(1), "twist": twist}),
        ("/imu", "sensor_msgs/msg/Imu", imu(2)),
        ("/rudder", "std_msgs/msg/Float64", {"data": 5.0}),
    ]
    readings = read_log("day.mcap", ros(messages), profile("boat"))
    assert readings.frame["time_utc_ns"].to_list()[:3] == [START + k * 10**9 + 250 for k in range(3)]
    row = readings.frame.select(pl.exclude("record", "time_utc_ns", "source").max()).row(0, named=True)
    assert (row["velocity_east_m_s"], row["velocity_north_m_s"], row["yaw_rate_rad_s"]) == (3.0, 4.0, -0.05)
    assert row["heading_rad"] == pytest.approx(radians(90.0) - 0.3)
    assert row["rudder_angle_rad"] == pytest.approx(radians(5.0))
    assert row["latitude_rad"] == pytest.approx(radians(59.9))


def test_ship_and_logger_files_are_laid_over_each_other() -> None:
    ship = next(p for p in PROFILES if p.vessel == "dorado")
    logger = next(p for p in PROFILES if p.vessel is None)
    both = merge([("ship", ship), ("logger", logger)])
    assert (both.vessel, both.length_m, len(both.sources)) == ("dorado", 42.0, 1)
    changed = overlay(both, VesselProfile(length_m=43.0))
    assert (changed.length_m, changed.sources) == (43.0, both.sources)


def test_every_key_channel_and_unit_is_documented() -> None:
    for model in (VesselProfile, Source, ChannelMap, TimeColumn, Antenna):
        for key in model.model_fields:
            assert f"`{key}`" in TEXT, (model.__name__, key)
    for channel in CHANNELS.values():
        assert f"| `{channel.name}` | {channel.unit} | {channel.words} |" in TEXT
    for unit in TO_SI:
        assert f"`{unit}`" in TEXT


def test_profiles_of_measured_ships_are_valid() -> None:
    found = sorted((FOLDER / "profiles").glob("*.yaml"))
    assert found
    for path in found:
        assert parse(yaml.safe_load(path.read_text(encoding="utf-8")), path.name).sources
