"""Delays and clock rates of the profile: every value is kept, at the time at which it was measured."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from kempf.pipeline.ingest.readings import READING_SCHEMA
from kempf.schemas.channels import CHANNEL_COLUMNS, CHANNELS
from tests.doctor import closed_form_ship
from tests.reading import read_log


def columns(frame: pl.DataFrame, channel: str) -> tuple[np.ndarray, np.ndarray]:
    column = CHANNELS[channel].column
    rows = frame.drop_nulls(column).sort("time_utc_ns")
    return rows["time_utc_ns"].to_numpy(), rows[column].to_numpy()


def test_times_move_and_nothing_is_lost() -> None:
    data = closed_form_ship.text(closed_form_ship.channels("heading", "yaw_rate", "rudder_angle"))
    names = ("heading", "yaw_rate", "rudder_angle")
    plain = read_log("made.csv", data, closed_form_ship.profile(*names))
    moved = read_log(
        "made.csv", data, closed_form_ship.profile(*names, hdg={"delay_s": 1.25}, rot={"clock_rate": 1.01})
    )
    assert (moved.tally, moved.rejected.height) == (plain.tally, plain.rejected.height)
    assert dict(moved.frame.schema) == READING_SCHEMA
    assert moved.frame["record"].is_sorted()
    assert not moved.frame.select(pl.all_horizontal(pl.col(c).is_null() for c in CHANNEL_COLUMNS).any()).item()
    assert moved.tally.values_kept == sum(moved.frame.height - moved.frame[c].null_count() for c in CHANNEL_COLUMNS)
    time, value = columns(plain.frame, "heading")
    later, same = columns(moved.frame, "heading")
    assert np.array_equal(later, time - 1_250_000_000)
    assert np.array_equal(same, value)
    slow, _ = columns(moved.frame, "yaw_rate")
    assert np.max(np.abs((slow - time[0]) * 1.01 - (time - time[0]))) < 2.0
    assert np.array_equal(columns(moved.frame, "rudder_angle")[0], time)
    assert len([note for note in moved.notes if "set right" in note]) == 2


def test_a_sentence_of_nmea_and_no_other() -> None:
    from kempf.schemas.profile import ChannelMap, Source, VesselProfile

    lines = b"2025-05-03T06:00:01.0Z $HEHDT,20.00,T*2D\n2025-05-03T06:00:01.5Z $AGRSA,-5.0,A,,*01\n"
    source = Source(match="*", channels={"HEHDT.heading": ChannelMap(channel="heading", unit="deg", delay_s=0.5)})
    frame = read_log("a.nmea", lines, VesselProfile(sources=[source])).frame
    plain = read_log("a.nmea", lines, VesselProfile()).frame
    assert (plain["time_utc_ns"] - frame["time_utc_ns"]).to_list() == [500_000_000, 0]


@pytest.mark.parametrize("bad", [{"scale": 0.0}, {"delay_s": 1e6}, {"clock_rate": 2.0}])
def test_impossible_corrections_are_refused(bad: dict[str, float]) -> None:
    from pydantic import ValidationError

    from kempf.schemas.profile import ChannelMap

    with pytest.raises(ValidationError):
        ChannelMap(channel="heading", unit="deg", **bad)  # type: ignore[arg-type]
