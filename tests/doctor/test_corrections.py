"""The line that the doctor proposes, put into the profile, makes him silent - through the reader and its bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kempf.flows.jobs.ingest.examine_log import ExaminedLog, examine_instruments
from kempf.pipeline.channels.doctor.corrections import ProfileCorrection, put_into
from kempf.pipeline.channels.doctor.refused import count
from kempf.pipeline.channels.instruments import from_readings
from kempf.schemas.profile import ChannelMap, VesselProfile
from tests.doctor import closed_form_ship
from tests.reading import read_log


def look(data: bytes, profile: VesselProfile) -> ExaminedLog:
    read = read_log("made.csv", data, profile)
    return examine_instruments(from_readings(read.frame), profile, "made.csv", read.format, count(read.rejections()))


def mended(profile: VesselProfile, content: dict[str, Any]) -> VesselProfile:
    source = profile.source_for("made.csv")
    for finding in content["findings"]:
        entries = finding["faults"][0]["entries"]
        source = put_into(
            source, tuple(ProfileCorrection(k, ChannelMap.model_validate(e)) for k, e in entries.items()), "made.csv"
        )
    assert source is not None
    return profile.model_copy(update={"sources": [source]})


@pytest.mark.parametrize(
    ("spoilt", "line"),
    [
        ({"rot": {"unit": "deg/s"}}, "rot: {channel: yaw_rate, unit: deg/min}"),
        ({"rot": {"positive": "port"}}, "rot: {channel: yaw_rate, unit: deg/min}"),
        ({"rudder": {"positive": "port"}}, "rudder: {channel: rudder_angle, unit: deg}"),
        ({"sog": {"unit": "kn"}}, "sog: {channel: speed_over_ground, unit: m/s}"),
        ({"lon": {"scale": -1.0}}, "lon: {channel: longitude, unit: deg}"),
        ({"hdg": {"positive": "port", "offset": 90.0}}, "hdg: {channel: heading, unit: deg}"),
    ],
)
def test_a_spoilt_entry_is_written_as_it_was(spoilt: dict[str, Any], line: str) -> None:
    data, profile = closed_form_ship.text(closed_form_ship.channels()), closed_form_ship.profile(**spoilt)
    found = look(data, profile)
    (finding,) = found.content["findings"]
    assert finding["faults"][0]["profile"] == [line]
    assert look(data, mended(profile, found.content)).content["verdict"] == "clean"


@pytest.mark.parametrize(
    ("spoilt", "key", "value"),
    [
        ({"hdg": {"offset": -70.0}}, "offset", 0.0),
        ({"rot": {"delay_s": -5.0}}, "delay_s", 0.0),
        ({"rot": {"clock_rate": 0.99}}, "clock_rate", 1.0),
        ({"rot": {"scale": 0.4}}, "scale", 1.0),
    ],
)
def test_an_estimate_comes_back_to_where_it_was(spoilt: dict[str, Any], key: str, value: float) -> None:
    data, profile = closed_form_ship.text(closed_form_ship.channels()), closed_form_ship.profile(**spoilt)
    found = look(data, profile)
    (finding,) = found.content["findings"]
    (column,) = spoilt
    fault = next(f for f in finding["faults"] if column in f["entries"])
    assert fault["entries"][column].get(key, value) == pytest.approx(
        value, abs={"offset": 6.0, "delay_s": 0.3}.get(key, 0.02)
    )
    one = {**found.content, "findings": [{**finding, "faults": [fault]}]}
    assert look(data, mended(profile, one)).content["verdict"] == "clean"


def test_swaps_and_frames_exchange_the_entries() -> None:
    values = closed_form_ship.channels()
    velocity = values["speed_over_ground"] * np.exp(1j * values["course_over_ground"])
    rest = {n: v for n, v in values.items() if n not in ("speed_over_ground", "course_over_ground")}
    data = closed_form_ship.text({**rest, "velocity_north": velocity.real, "velocity_east": velocity.imag})
    names = (*rest, "velocity_north", "velocity_east")
    right = ["ve: {channel: velocity_east, unit: m/s}", "vn: {channel: velocity_north, unit: m/s}"]
    for spoilt in (
        {"vn": {"channel": "velocity_east"}, "ve": {"channel": "velocity_north"}},
        {"vn": {"channel": "velocity_forward"}, "ve": {"channel": "velocity_starboard"}},
    ):
        profile = closed_form_ship.profile(*names, **spoilt)
        found = look(data, profile)
        (finding,) = found.content["findings"]
        assert sorted(finding["faults"][0]["profile"]) == right
        assert look(data, mended(profile, found.content)).content["verdict"] == "clean"
