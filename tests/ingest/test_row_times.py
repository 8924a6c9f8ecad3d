"""Times of rows: date and time of day apart, rows counted at an interval, a column that is too coarse."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import polars as pl
import pytest

from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import VesselProfile, parse
from tests.reading import read_log

WANTED = int(datetime(2025, 5, 3, 7, 47, 1, tzinfo=UTC).timestamp()) * 10**9


def profile(time: dict) -> VesselProfile:
    channels = {"hdg": {"channel": "heading", "unit": "deg"}}
    return parse({"sources": [{"match": "*", "time": time, "channels": channels}]}, "profile.yaml")


def read(text: str, time: dict):
    readings = read_log("log.csv", text.encode(), profile(time))
    tally = readings.tally
    assert tally.records_read == tally.records_kept + tally.records_rejected
    return readings


@pytest.mark.parametrize(
    ("day", "clock", "more"),
    [
        ("2025-05-03", "07:47:01", {}),
        ("20250503", "074701", {}),
        ("2025-05-03", "07:47:01Z", {}),
        ("2025-05-03", "10:47:01+03:00", {}),
        ("2025-05-03", "074701.000Z", {}),
        ("03.05.2025", "7:47:01.000", {"date_form": "dd.mm.yyyy"}),
        ("3.5.2025", "07:47:01", {"date_form": "dd.mm.yyyy"}),
        ("05/03/2025", "07:47:01", {"date_form": "mm/dd/yyyy"}),
        ("030525", "074701", {"date_form": "ddmmyy"}),
        ("03-May-2025", "7:47:01 AM", {"date_form": "dd-mmm-yyyy"}),
        ("3 MAY 25", "07:47:01 a.m.", {"date_form": "dd mmm yy"}),
        ("2025-05-03", "28021", {"unit": "s"}),
        ("2025-05-03", "0.32431712962963", {"unit": "d"}),
        ("2025-05-03", "28021000", {"unit": "ms"}),
    ],
)
def test_date_and_time_in_two_columns(day: str, clock: str, more: dict) -> None:
    readings = read(f"day;at;hdg\n{day};{clock};90\n{day};x;91\n{day};;92\n", {"date": "day", "time": "at", **more})
    assert readings.frame["time_utc_ns"].to_list() == [WANTED]
    assert readings.tally.by_reason == {"malformed": 1, "no_time": 1}
    zoned = clock.endswith("Z") or "+" in clock or "unit" in more
    assert ("Times without a zone are taken as UTC." in readings.notes) != zoned


@pytest.mark.parametrize(
    ("instant", "form"),
    [
        ("03/05/2025 07:47:01", "dd/mm/yyyy"),
        ("5/3/2025 07:47:01.0", "mm/dd/yyyy"),
        ("5/3/2025 7:47:01 AM", "mm/dd/yyyy"),
        ("03.05.25T07:47:01", "dd.mm.yy"),
        ("3-May-2025 07:47:01", "dd-mmm-yyyy"),
        ("3 May 2025 07:47:01", "dd mmm yyyy"),
    ],
)
def test_date_and_time_in_one_column_that_is_not_iso(instant: str, form: str) -> None:
    readings = read(f"utc;hdg\n{instant};90\n{instant[:8]};91\nx;92\n", {"column": "utc", "date_form": form})
    assert readings.frame["time_utc_ns"].to_list() == [WANTED]
    assert readings.tally.by_reason == {"malformed": 2}


def test_names_of_months() -> None:
    names = ["Jan", "FEB", "march", "Apr", "May", "Jun", "july", "Aug", "Sept", "Oct", "OCTOBER", "Nov", "Dec", "Mai"]
    text = "utc,hdg\n" + "".join(f"07-{name}-2025 12:00:00Z,1\n" for name in names)
    readings = read(text, {"column": "utc", "date_form": "dd-mmm-yyyy"})
    months = [time.month for time in readings.frame["time_utc_ns"].cast(pl.Datetime("ns")).to_list()]
    assert months == [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]
    # October comes twice, and of a channel one value a time is kept
    assert readings.tally.by_reason == {"malformed": 1, "same_instant": 1}


def test_halves_of_the_day() -> None:
    clocks = {
        "12:00:00 AM": 0,
        "1:00:00 am": 1,
        "11:00:00AM": 11,
        "12:00:00 PM": 12,
        "01:00:00 p.m.": 13,
        "11:00 PM": 23,
    }
    text = "day,at,hdg\n" + "".join(f"2025-05-03,{clock},1\n" for clock in [*clocks, "13:00:00 PM", "00:10:00 AM"])
    readings = read(text, {"date": "day", "time": "at"})
    hours = [time.hour for time in readings.frame["time_utc_ns"].cast(pl.Datetime("ns")).to_list()]
    assert hours == list(clocks.values())
    assert readings.rejected["reason"].to_list() == ["malformed", "malformed"]


def test_days_of_a_spreadsheet() -> None:
    exact = "45780.324317129629630"
    text = f"day,hdg\n{exact},1\n45781,2\n4.57815e4,3\nx,4\n45.000.1,5\n"
    readings = read(text, {"column": "day", "unit": "d", "start": "1899-12-30T00:00:00Z"})
    first, second, third = readings.frame["time_utc_ns"].to_list()
    assert first == WANTED and third - second == 43_200 * 10**9
    assert datetime.fromtimestamp(second / 1e9, UTC) == datetime(2025, 5, 4, tzinfo=UTC)
    assert readings.rejected["reason"].to_list() == ["malformed", "malformed"]


def test_days_that_have_passed_may_be_small_and_have_an_exponent() -> None:
    text = "t,hdg\n-0.5,1\n0,2\n1.1574074074074e-05,3\n.25,4\n+1,5\n"
    readings = read(text, {"column": "t", "unit": "d", "start": "2025-05-03T07:47:01Z"})
    seconds = [round((time - WANTED) / 1e9, 6) for time in readings.frame["time_utc_ns"].to_list()]
    assert seconds == [-43_200.0, 0.0, 1.0, 21_600.0, 86_400.0]


def test_a_night_goes_on_behind_midnight() -> None:
    readings = read("day,at,hdg\n2024-02-28,23:59:59.5,1\n2024-02-29,00:00:00.5,2\n", {"date": "day", "time": "at"})
    first, second = readings.frame["time_utc_ns"].to_list()
    assert second - first == 10**9


def test_a_date_that_is_not_of_the_form_is_refused_row_by_row() -> None:
    text = "day,at,hdg\n03.05.2025,07:47:01,90\n2025-05-03,07:47:02,91\n31.02.2025,07:47:03,92\n"
    readings = read(text, {"date": "day", "time": "at", "date_form": "dd.mm.yyyy"})
    assert readings.frame["time_utc_ns"].to_list() == [WANTED]
    assert readings.rejected["reason"].to_list() == ["malformed", "malformed"]


@pytest.mark.parametrize(
    "time",
    [
        {},
        {"date": "day"},
        {"time": "at"},
        {"date": "day", "time": "at", "column": "utc"},
        {"date": "day", "time": "at", "date_form": "dd.mm"},
        {"date": "day", "time": "at", "date_form": "dd.mm/yyyy"},
        {"column": "t", "unit": "s", "date_form": "dd.mm.yyyy"},
        {"date": "day", "time": "at", "start": "2025-05-03T00:00:00Z"},
        {"column": "t", "unit": "s", "interval_s": 0},
    ],
)
def test_a_time_that_says_two_things_or_none_is_refused(time: dict) -> None:
    with pytest.raises(UsageError) as error:
        profile(time)
    assert error.value.code == "profile_invalid" and "time" in error.value.message


def test_a_profile_that_uses_none_of_the_newer_keys_keeps_its_hash() -> None:
    known = {"vessel": "a", "sources": [{"match": "*", "time": {"column": "utc"}, "channels": {}}]}
    # of a stored profile of an earlier version
    assert parse(known, "x").sha256 == "52e4ae0787f27350a679132071a0d7dc769f95ddc38fb0a64e60f629e3a20347"
    newer = parse({"vessel": "a", "sources": [{"match": "*", "time": {"interval_s": 0.5}}]}, "x")
    assert parse(newer.model_dump(mode="json"), "x") == newer


INTERVAL_S = 0.1352


def coarse(count: int, resolution_s: float = 1.0, *, interval_s: float = INTERVAL_S, pause_s: float = 0.0) -> str:
    """Rows whose time is cut to a resolution; a pause halfway."""
    at = np.arange(count) * interval_s + np.where(np.arange(count) >= count // 2, pause_s, 0.0)
    shown = np.floor(at / resolution_s + 1e-9) * resolution_s
    return "t,hdg\n" + "".join(f"{t:.3f},{k * 0.1 % 360:.1f}\n" for k, t in enumerate(shown))


ELAPSED = {"column": "t", "unit": "s", "start": "2025-05-03T07:47:01Z"}


def test_a_coarse_column_is_told_with_what_to_write() -> None:
    readings = read(coarse(1000), ELAPSED)
    (note,) = [note for note in readings.notes if "interval_s" in note]
    assert "1000 rows share 136 times" in note and "interval_s: 0.135" in note
    # and no longer once it is written
    counted = read(coarse(1000), {**ELAPSED, "interval_s": INTERVAL_S})
    assert counted.tally.records_kept == 1000 and counted.tally.values_rejected == 0
    assert not any("share" in note for note in counted.notes)
    assert np.ptp(np.diff(counted.frame["time_utc_ns"].to_numpy()) - 135_200_000) == 0
    assert counted.frame["time_utc_ns"][0] == WANTED


@pytest.mark.parametrize("resolution_s", [0.01, 0.1, 0.5, 10.0])
def test_the_interval_is_held_against_a_column_of_any_resolution(resolution_s: float) -> None:
    assert read(coarse(2000, resolution_s), {**ELAPSED, "interval_s": INTERVAL_S}).tally.records_kept == 2000


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (coarse(1000, interval_s=0.15), "0.149"),
        (coarse(1000, pause_s=60.0), r"leap by 6[01] s at row 501"),
        (
            coarse(1000, 0.01, interval_s=0.136),
            r"0\.135996 s apart in the mean of 1000 rows, and the last is \+0\.795 s off\. ",
        ),
    ],
)
def test_an_interval_that_the_column_contradicts_is_refused_with_what_was_found(text: str, found: str) -> None:
    with pytest.raises(DataRejected, match=found) as error:
        read(text, {**ELAPSED, "interval_s": INTERVAL_S})
    assert error.value.code == "interval_contradicts_times" and "interval_s" in error.value.next_step


def test_the_interval_is_held_against_a_date_beside_a_time_of_day_too() -> None:
    rows = [f"2025-05-03,07:47:{int(1 + k * INTERVAL_S):02d},{k}\n" for k in range(300)]
    time = {"date": "day", "time": "at", "interval_s": INTERVAL_S}
    readings = read("day,at,hdg\n" + "".join(rows), time)
    assert readings.tally.records_kept == 300
    assert readings.frame["time_utc_ns"].to_list() == [WANTED + k * 135_200_000 for k in range(300)]
    assert any("agrees within 1 s" in note for note in readings.notes)


def test_a_damaged_stamp_does_not_contradict_the_interval() -> None:
    lines = coarse(1000).splitlines(keepends=True)
    lines[500], lines[700] = lines[500].replace(lines[500].split(",")[0], "9e6"), "x" + lines[700]
    assert read("".join(lines), {**ELAPSED, "interval_s": INTERVAL_S}).tally.records_kept == 1000


def test_rows_without_a_time_are_counted_from_the_start_damaged_ones_with_them() -> None:
    time = {"interval_s": 0.05, "start": "2025-05-03T07:47:01Z"}
    readings = read("n,hdg\n1,10\n2\n3,11\n", time)
    assert readings.frame["time_utc_ns"].to_list() == [WANTED, WANTED + 100_000_000]
    assert readings.tally.by_reason == {"malformed": 1}


def test_lines_that_come_twice_are_no_coarse_column() -> None:
    rows = [f"2025-05-03T07:47:{k:02d}Z,{k}\n" for k in range(50)]
    readings = read("t,hdg\n" + "".join(row + row for row in rows), {"column": "t"})
    assert readings.notes == () and readings.tally.by_reason == {"duplicate": 50}
