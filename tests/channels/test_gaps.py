"""Gaps of a log are named: those of the whole log once, those of a channel with its name."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.gaps import named_gaps
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS

#: 2025-05-03 06:00:00 UTC
START_S = 1_746_252_000


def recorded(*spans: tuple[int, int], every_s: float = 1.0) -> Series:
    """A channel with a reading every so often in some spans, s after the start."""
    seconds = np.concatenate([np.arange(begin, end, every_s) for begin, end in spans])
    return Series(START_S * SECOND_NS + np.rint(seconds * SECOND_NS).astype(np.int64), np.zeros(seconds.size))


def test_a_log_without_gaps_has_no_note() -> None:
    assert named_gaps({}) == []
    # a depth each half minute is sampled, and nine seconds without a heading are no gap
    channels = {"heading": recorded((0, 100), (109, 600)), "water_depth": recorded((0, 600), every_s=30.0)}
    assert named_gaps(channels) == []


def test_what_no_channel_holds_is_named_once() -> None:
    channels = {"heading": recorded((0, 301), (361, 600)), "rudder_angle": recorded((0, 301), (361, 600), every_s=0.5)}
    # the rudder's last reading is half a second behind the heading's
    assert named_gaps(channels) == ["nothing is recorded for 60 s from 2025-05-03 06:05:00 UTC on"]


def test_what_one_receiver_lost_is_named_with_its_channels() -> None:
    lost = ((0, 101), (121, 201), (261, 600))
    channels = {
        "heading": recorded((0, 600)),
        "latitude": recorded(*lost),
        "longitude": recorded(*lost),
        "yaw_rate": recorded((0, 101), (121, 600)),
    }
    assert named_gaps(channels) == [
        "latitude and longitude: not recorded in 2 gaps of 82 s together, the longest of 61 s "
        "from 2025-05-03 06:03:20 UTC on",
        "yaw_rate: not recorded for 21 s from 2025-05-03 06:01:40 UTC on",
    ]


def test_a_gap_that_outlasts_the_logger_s_is_the_channel_s_own() -> None:
    channels = {"heading": recorded((0, 101), (131, 600)), "roll": recorded((0, 101), (171, 600))}
    shared, own = named_gaps(channels)
    assert shared == "nothing is recorded for 31 s from 2025-05-03 06:01:40 UTC on"
    assert own == "roll: not recorded for 71 s from 2025-05-03 06:01:40 UTC on"
