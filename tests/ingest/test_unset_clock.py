"""Logs of 1970: taken as they are, with a note, or dated by the profile; a log that is dated later is none of them."""

from __future__ import annotations

import io
import json

import pytest
from mcap.writer import Writer

from kempf.pipeline.ingest.mcap import decode
from kempf.schemas.errors import DataRejected
from kempf.schemas.profile import VesselProfile, parse
from tests.ingest.test_nmea import sentence
from tests.reading import read_log

SECOND = 10**9
TRUE_START = 1_746_252_000 * SECOND


def profile(time: dict | None, key: str = "hdg") -> VesselProfile:
    source = {"match": "*", "channels": {key: {"channel": "heading", "unit": "deg"}}}
    return parse({"sources": [{**source, **({"time": time} if time is not None else {})}]}, "profile.yaml")


def rows(times: list[object]) -> bytes:
    return ("t,hdg\n" + "".join(f"{t},{k % 90}.5\n" for k, t in enumerate(times))).encode()


def stated(readings) -> bool:
    return any("The times are of 1970" in note and "start:" in note for note in readings.notes)


@pytest.mark.parametrize(
    ("time", "times"),
    [
        ({"column": "t", "unit": "s"}, [k * 0.5 for k in range(100)]),
        ({"column": "t", "unit": "s"}, [k * 0.5 - 20.0 for k in range(100)]),
        ({"column": "t", "unit": "ms"}, [5_000_000 + k * 500 for k in range(100)]),
        ({"column": "t"}, [f"1970-01-01T00:{k // 60:02d}:{k % 60:02d}Z" for k in range(100)]),
        ({"interval_s": 0.5}, list(range(100))),
    ],
)
def test_a_log_that_counts_from_1970_is_taken_with_a_note(time: dict, times: list[object]) -> None:
    readings = read_log("a.csv", rows(times), profile(time))
    assert readings.tally.records_kept == 100 and readings.tally.records_rejected == 0
    assert stated(readings)
    assert readings.frame["time_utc_ns"].is_sorted()


def test_the_start_of_the_profile_dates_it() -> None:
    start = {"start": "2025-05-03T06:00:00Z"}
    seconds = [k * 0.5 for k in range(100)]
    texts = [f"1970-01-01T00:{k // 60:02d}:{k % 60:02d}Z" for k in range(100)]
    elapsed = read_log("a.csv", rows(seconds), profile({"column": "t", "unit": "s", **start}))
    text = read_log("a.csv", rows(texts), profile({"column": "t", **start}))
    assert elapsed.frame["time_utc_ns"][0] == text.frame["time_utc_ns"][0] == TRUE_START
    assert elapsed.notes == () and "the start that the profile states" in text.notes[0]


def test_a_start_of_long_ago_is_no_clock_that_was_not_set() -> None:
    time = {"column": "t", "unit": "s", "start": "1977-08-02T06:00:00Z"}
    readings = read_log("a.csv", rows([k * 0.5 for k in range(100)]), profile(time))
    assert readings.tally.records_kept == 100 and readings.notes == ()
    assert readings.frame["time_utc_ns"][0] == 239_349_600 * SECOND


def test_a_clock_that_is_set_on_the_way_leaves_out_what_was_before() -> None:
    times = [*range(40), *(1_746_252_000 + k for k in range(60))]
    readings = read_log("a.csv", rows(times), profile({"column": "t", "unit": "s"}))
    assert readings.tally.by_reason == {"clock_unset": 40} and readings.tally.records_kept == 60
    assert not stated(readings)


def test_a_damaged_time_does_not_date_a_log_and_is_refused() -> None:
    times: list[object] = [*range(300)]
    times[100] = 1_746_252_000
    readings = read_log("a.csv", rows(times), profile({"column": "t", "unit": "s"}))
    assert stated(readings) and readings.tally.by_reason == {"no_time": 1}


def test_a_wrong_unit_is_still_seen() -> None:
    times = [1_746_252_000 + k for k in range(100)]
    with pytest.raises(DataRejected, match="100 clock_unset") as error:
        read_log("a.csv", rows(times), profile({"column": "t", "unit": "us"}))
    assert "unit" in error.value.next_step


def test_an_nmea_log_with_stamps_of_1970() -> None:
    lines = [f"1970-01-01T00:{k // 60:02d}:{k % 60:02d}Z {sentence(f'HEHDT,{k}.0,T')}" for k in range(100)]
    readings = read_log("a.nmea", "".join(line + "\n" for line in lines).encode(), VesselProfile())
    assert stated(readings) and readings.tally.records_kept == 100
    dated = parse({"sources": [{"match": "*", "time": {"start": "2025-05-03T06:00:00Z"}}]}, "profile.yaml")
    readings = read_log("a.nmea", "".join(line + "\n" for line in lines).encode(), dated)
    # the middle of the second that the first stamp, of whole seconds, stands for
    assert readings.frame["time_utc_ns"][0] == TRUE_START + SECOND // 2 and not stated(readings)


def test_a_receiver_that_knows_the_date_sets_stamps_of_1970_right() -> None:
    lines = []
    for k in range(100):
        at = f"1970-01-01T00:{k // 60:02d}:{k % 60:02d}"
        when = f"06{k // 60:02d}{k % 60:02d}.00"
        lines += [
            f"{at}.250Z {sentence(f'GPRMC,{when},A,5954.0,N,02436.0,E,1.0,2.0,030525,,,A')}",
            f"{at}.750Z {sentence(f'HEHDT,{k}.0,T')}",
        ]
    readings = read_log("a.nmea", "".join(line + "\n" for line in lines).encode(), VesselProfile())
    assert readings.tally.records_kept == 200 and not stated(readings)
    assert readings.frame["time_utc_ns"][:3].to_list() == [TRUE_START + k * SECOND // 2 for k in range(3)]
    assert "200 stamps were put right by the receiver's UTC" in readings.notes[0]


def mcap(times: list[int]) -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=4096)
    writer.start()
    schema = writer.register_schema("psi", "jsonschema", b"{}")
    channel = writer.register_channel("/gyro", "json", schema)
    for k, time in enumerate(times):
        writer.add_message(channel, time, json.dumps({"psi": k % 90 + 0.5}).encode(), time)
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize("together", [1 << 16, 100])
def test_an_mcap_log_of_1970_in_one_part_or_in_several(together: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decode, "_TOGETHER", together)
    log = mcap([k * SECOND // 2 for k in range(1000)])
    readings = read_log("a.mcap", log, profile(None, "/gyro.psi"))
    assert stated(readings) and readings.tally.records_kept == 1000
    start = {"start": "2025-05-03T06:00:00Z"}
    for time in (start, {"column": "log_time", **start}):
        dated = read_log("a.mcap", log, profile(time, "/gyro.psi"))
        assert dated.frame["time_utc_ns"][0] == TRUE_START and dated.tally.records_kept == 1000
    later = mcap([*(k * SECOND for k in range(500)), *(TRUE_START + k * SECOND for k in range(500))])
    readings = read_log("a.mcap", later, profile(None, "/gyro.psi"))
    assert readings.tally.by_reason == {"clock_unset": 500} and not stated(readings)
