"""Headings that count on beyond 360 deg: taken where they continue a course, refused where they are nonsense."""

from __future__ import annotations

import io
import json
import random
from dataclasses import replace
from math import degrees, pi, radians

import numpy as np
import pytest
from mcap.writer import Writer

from kempf.pipeline.ingest.decoded import Decoded, Values
from kempf.pipeline.ingest.screen import Screen
from kempf.pipeline.ingest.spans import Spans
from kempf.schemas.profile import VesselProfile
from tests.ingest.test_nmea import read as read_nmea
from tests.ingest.test_nmea import stamped
from tests.ingest.test_parts import START_NS, cut, equal
from tests.reading import joined, read_log

SECOND = 10**9


def course(n: int, begin_deg: float, to_deg: float) -> np.ndarray:
    """A turn at a changing rate."""
    x = np.linspace(0.0, 1.0, n)
    return begin_deg + (to_deg - begin_deg) * (x + 0.1 * np.sin(2 * pi * x) / (2 * pi))


def read_csv(values: np.ndarray, unit: str = "deg"):
    channels = {"psi": {"channel": "heading", "unit": unit}}
    given = VesselProfile.model_validate(
        {"sources": [{"match": "*", "time": {"column": "t", "unit": "ns"}, "channels": channels}]}
    )
    rows = "".join(f"{START_NS + k * SECOND},{v!r}\n" for k, v in enumerate(values.tolist()))
    return read_log("log.csv", f"t,psi\n{rows}".encode(), given)


def same_course(readings, values: np.ndarray) -> None:
    found = readings.frame["heading_rad"].to_numpy()
    assert np.abs(found).max() <= 2 * pi
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * np.radians(values)), atol=1e-9)


@pytest.mark.parametrize(("begin", "to"), [(10.0, 1500.0), (300.0, -1500.0), (500.0, 1100.0), (-7000.0, -6000.0)])
@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_a_heading_that_counts_on_is_taken(begin: float, to: float, unit: str) -> None:
    values = course(400, begin, to)
    readings = read_csv(values if unit == "deg" else np.radians(values), unit)
    assert readings.tally.values_rejected == readings.tally.records_rejected == 0
    same_course(readings, values)
    beyond = int(np.sum(np.abs(values) > 360.0))
    assert f"heading: {beyond} readings beyond one turn" in readings.notes[0]


def test_a_heading_in_circles_of_two_turns_is_taken() -> None:
    values = np.mod(course(900, 700.0, 2300.0), 720.0)
    readings = read_csv(values)
    assert readings.tally.records_rejected == 0
    same_course(readings, values)


def test_a_ship_at_rest_beyond_one_turn_is_taken_once_she_moves() -> None:
    values = np.append(np.full(3000, 725.0), course(100, 725.0, 700.0))
    assert read_csv(values).tally.records_rejected == 0


@pytest.mark.parametrize(
    ("place", "wrong"),
    [
        (50, [999.0]),
        (0, [511.0] * 40),
        (90, [999.9] * 10),
        (50, [36_001.0] * 3),
        (50, [4e5, 1.0e6, 3.0e5]),
        (60, [720.5, 999.0, 540.0]),
    ],
)
def test_nonsense_is_refused_and_counted(place: int, wrong: list[float]) -> None:
    values = course(100, 10.0, 80.0)
    at = np.arange(place, place + len(wrong))
    values = np.insert(values, place, wrong) if place else np.append(wrong, values)
    readings = read_csv(values)
    assert readings.tally.by_reason == {"out_of_range": len(wrong)}
    assert readings.rejected["record"].to_list() == at.tolist()
    assert not [note for note in readings.notes if "out_of_range" not in note]


@pytest.mark.parametrize("wrong", [[511.0], [511.0] * 3, [511.0] * 90, [409.5, 409.5]])
@pytest.mark.parametrize("place", [0, 40, 90, 100])
def test_a_leap_out_and_back_is_no_heading_that_counts_on_however_near_north_she_heads(place, wrong) -> None:
    values = course(100, 335.0, 359.5)
    readings = read_csv(np.concatenate([values[:place], wrong, values[place:]]))
    assert readings.tally.by_reason == {"out_of_range": len(wrong)}
    assert readings.rejected["record"].to_list() == list(range(place, place + len(wrong)))
    assert not [note for note in readings.notes if "out_of_range" not in note]
    same_course(readings, values)


def test_a_heading_that_counts_on_goes_on_behind_a_gap_in_which_she_turned() -> None:
    values = np.concatenate([course(100, 300.0, 400.0), course(100, 500.0, 560.0)])
    assert read_csv(values).tally.records_rejected == 0


def test_a_spike_within_a_heading_that_counts_on_costs_itself_alone() -> None:
    values = course(300, 10.0, 1200.0)
    values[200] = 9999.0
    readings = read_csv(values)
    assert readings.rejected["record"].to_list() == [200]
    same_course(readings, np.delete(values, 200))


def test_an_instrument_that_has_nothing_to_say_is_refused_whole() -> None:
    channels = {"psi": {"channel": "heading", "unit": "deg"}, "rot": {"channel": "yaw_rate", "unit": "deg/s"}}
    given = VesselProfile.model_validate(
        {"sources": [{"match": "*", "time": {"column": "t", "unit": "ns"}, "channels": channels}]}
    )
    rows = "".join(f"{START_NS + k * SECOND},999,{k % 7}\n" for k in range(200))
    readings = read_log("log.csv", f"t,psi,rot\n{rows}".encode(), given)
    assert readings.tally.by_reason == {"out_of_range": 200} and readings.tally.records_kept == 200


def test_other_channels_keep_their_ranges() -> None:
    values = course(100, 10.0, 200.0)
    given = VesselProfile.model_validate(
        {
            "sources": [
                {
                    "match": "*",
                    "time": {"column": "t", "unit": "ns"},
                    "channels": {"psi": {"channel": "rudder_angle", "unit": "deg"}},
                }
            ]
        }
    )
    rows = "".join(f"{START_NS + k * SECOND},{v!r}\n" for k, v in enumerate(values.tolist()))
    readings = read_log("log.csv", f"t,psi\n{rows}".encode(), given)
    assert readings.tally.by_reason == {"out_of_range": int(np.sum(values > 90.0))}


def test_an_mcap_log_with_such_a_heading() -> None:
    values = course(500, 20.0, 2000.0)
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    schema = writer.register_schema("psi", "jsonschema", b"{}")
    channel = writer.register_channel("/observer", "json", schema)
    for k, value in enumerate(values.tolist()):
        data = json.dumps({"psi_hat": radians(value)}).encode()
        writer.add_message(channel, START_NS + k * SECOND, data, START_NS + k * SECOND)
    writer.finish()
    channels = {"/observer.psi_hat": {"channel": "heading", "unit": "rad"}}
    given = VesselProfile.model_validate({"sources": [{"match": "*", "channels": channels}]})
    readings = read_log("day.mcap", stream.getvalue(), given)
    assert readings.tally.records_rejected == 0
    same_course(readings, values)


def test_an_nmea_log_with_such_a_heading() -> None:
    values = course(60, 340.0, 500.0)
    lines = [stamped(f"HEHDT,{v:.2f},T", at=f"2025-05-03T07:47:{k:02d}.000Z") for k, v in enumerate(values)]
    readings = read_nmea("".join(lines))
    assert readings.tally.records_rejected == 0
    assert degrees(readings.frame["heading_rad"][-1]) == pytest.approx(140.0)


def wandering(seed: int, n: int) -> Decoded:
    """Headings of two sources that count on, stand still, leap and come back, on clocks that stand still at times."""
    draw = random.Random(seed)
    time, value, angle = [], [], dict.fromkeys(range(2), 0.0)
    source = [draw.randrange(2) for _ in range(n)]
    latest = dict.fromkeys(range(2), START_NS)
    for own in source:
        latest[own] += draw.choice([0, 1, 1, 1]) * SECOND
        time.append(latest[own])
        kind = draw.random()
        if kind < 0.05:
            angle[own] += draw.choice([20.0, -20.0, 7.0, 50.0])
        elif kind < 0.7:
            angle[own] += draw.uniform(-1.0, 1.2)
        value.append(draw.choice([1e4, 17.0, np.nan]) if draw.random() < 0.1 else angle[own])
    words = [b"%d" % k for k in range(n)]
    stop = np.cumsum([len(word) for word in words], dtype=np.int64)
    spans = Spans(np.frombuffer(b"".join(words), dtype=np.uint8), np.append(0, stop)[:-1].astype(np.int64), stop)
    there = np.array([draw.random() < 0.9 for _ in range(n)], dtype=np.bool_)
    return Decoded(
        np.arange(n, dtype=np.int64),
        *(spans, spans, np.array(time, dtype=np.int64), np.array(source, dtype=np.int64), ("a", "b")),
        np.zeros(n, dtype=np.int8),
        {"heading": Values(np.array(value), there), "yaw_rate": Values(np.full(n, 0.01), ~there)},
        ["one note"],
    )


# where what is held back decided a reading before it
@pytest.mark.parametrize("seed", [*range(60), 68, 198, 200, 236])
def test_it_does_not_matter_where_the_log_is_cut(seed: int) -> None:
    draw = random.Random(1000 + seed)
    whole = wandering(seed, draw.choice([1, 3, 40, 200]))
    at = sorted(draw.randrange(len(whole) + 1) for _ in range(draw.choice([1, 2, 7, 30])))
    checks = Screen("mcap")
    found = joined([checks.part(part) for part in cut(replace(whole), at)])
    equal(found, Screen("mcap").part(whole))
