"""Delimited text: separators, headers, encodings, times, cells."""

import io
import math
import random
import tarfile
from datetime import UTC, datetime
from time import process_time

import numpy as np
import pytest

from kempf.pipeline.ingest import delimited
from kempf.pipeline.ingest.quoting import inside_quotes
from kempf.pipeline.ingest.spans import lines_of
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log


def profile(channels=None, time=None, **source):
    channels = channels or {
        "sog": {"channel": "speed_over_ground", "unit": "kn"},
        "hdg": {"channel": "heading", "unit": "deg"},
    }
    source = {"match": "*", "time": time or {"column": "utc"}, "channels": channels, **source}
    return VesselProfile.model_validate({"sources": [source]})


def read(text, given=None):
    data = text if isinstance(text, bytes) else text.encode()
    readings = read_log("log.csv", data, given or profile())
    tally = readings.tally
    assert readings.format == "delimited"
    assert tally.records_read == tally.records_kept + tally.records_rejected
    assert tally.values_read == tally.values_kept + tally.values_rejected
    return readings


T = "2025-05-03T07:47:0"


@pytest.mark.parametrize("sign", [",", ";", "\t"])
def test_the_separator_is_taken_from_the_header(sign):
    readings = read(f"utc,sog,hdg\n{T}1Z,10,90\n{T}2Z,,91\n".replace(",", sign))
    assert readings.frame["speed_over_ground_m_s"].to_list() == [pytest.approx(18520 / 3600), None]
    assert readings.frame["heading_rad"].to_list() == [math.radians(90), math.radians(91)]
    assert readings.frame["source"].to_list() == ["row", "row"]


def test_cells_and_rows_have_their_reasons():
    text = (
        f"utc,sog,hdg\n{T}0Z,1,2\n{T}1Z,nan,2\n{T}2Z,1\n{T}3Z,1,2,3\n{T}4Z,x,y\n\n{T}5Z,,\n,1,2\n25:00,1,2\n"
        f"{T}6Z,999,2\n{T}6Z,999,2\n1990-01-01T00:00:00Z,1,2\n{T}1Z,1,2\n{T}7Z,1;5,2"
    )
    readings = read(text)
    assert readings.tally.records_read == 13
    assert readings.rejected.select("record", "channel", "reason").rows() == [
        (1, "speed_over_ground", "not_a_number"),
        (2, None, "malformed"),
        (3, None, "malformed"),
        (4, None, "not_a_number"),
        (5, None, "void"),
        (6, None, "no_time"),
        (7, None, "malformed"),
        (8, "speed_over_ground", "out_of_range"),
        (9, None, "duplicate"),
        (10, None, "clock_unset"),
        (11, None, "clock_back"),
        (12, "speed_over_ground", "not_a_number"),
    ]
    assert readings.rejected["raw"][0] == f"{T}1Z,nan,2"


def test_elapsed_times_are_exact_nanoseconds():
    given = profile(
        {"h": {"channel": "heading", "unit": "deg"}},
        {"column": "t", "unit": "s", "start": "2006-01-01T00:00:00Z"},
        encoding="cp1252",
        header_lines=2,
        separator="whitespace",
        columns=["t", "h"],
    )
    text = "  KVLCC2 \xb0\n\n   .050000000   -1.5\n  0.1 \t 2\n  12345.678901234  3\n 2.0e4 4\n 30000.0000000005 5\n"
    readings = read(text.encode("cp1252"), given)
    start = int(datetime(2006, 1, 1, tzinfo=UTC).timestamp()) * 10**9
    assert [t - start for t in readings.frame["time_utc_ns"]] == [
        50_000_000,
        100_000_000,
        12_345_678_901_234,
        20_000_000_000_000,
        30_000_000_000_000,
    ]


@pytest.mark.parametrize(
    ("unit", "text"), [("s", "1714722421.5"), ("ms", "1714722421500"), ("ns", "1714722421500000000")]
)
def test_epoch_numbers(unit, text):
    given = profile(None, {"column": "utc", "unit": unit})
    assert read(f"utc,sog,hdg\n{text},1,2\n", given).frame["time_utc_ns"].to_list() == [1714722421500000000]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2025-05-03T07:47:01Z", "2025-05-03T07:47:01+00:00"),
        ("2025-05-03 07:47:01.5", "2025-05-03T07:47:01.500000+00:00"),
        ("2025-05-03T10:47:01,25+03:00", "2025-05-03T07:47:01.250000+00:00"),
        ("2025-05-03T02:17:01.000001-0530", "2025-05-03T07:47:01.000001+00:00"),
        ("2024-02-29T23:59:60Z", "2024-03-01T00:00:00+00:00"),
        ("2025-05-03 7:47:01Z", "2025-05-03T07:47:01+00:00"),
        ("2025-05-03T7:47:01.25+00:00", "2025-05-03T07:47:01.250000+00:00"),
        ("2025-05-03 07:47:01.123 UTC", "2025-05-03T07:47:01.123000+00:00"),
        ("2025-05-03 07:47:01 Z", "2025-05-03T07:47:01+00:00"),
        ("2025-05-03 07:47:01UTC", "2025-05-03T07:47:01+00:00"),
        ("2025-05-03 10:47:01 +0300", "2025-05-03T07:47:01+00:00"),
        ("20250503T074701.147Z", "2025-05-03T07:47:01.147000+00:00"),
    ],
)
def test_iso_times(text, expected):
    readings = read(f"utc;sog;hdg\n{text};1;2\n")
    when = datetime.fromisoformat(expected)
    assert readings.frame["time_utc_ns"].to_list() == [int(when.timestamp()) * 10**9 + when.microsecond * 1000]
    assert bool(readings.notes) == (text == "2025-05-03 07:47:01.5")


def test_quoted_cells_and_a_byte_order_mark():
    text = f'\ufeffutc,"sog",note,hdg\r\n"{T}1Z",1,"a, b",3\r\n{T}2Z,1,"open,3\r\n'
    readings = read(text)
    assert readings.frame["heading_rad"].to_list() == [math.radians(3)]
    assert readings.tally.by_reason == {"malformed": 1}


def test_tabs_at_the_end_stand_for_empty_cells():
    assert read(f"utc\tsog\thdg\n{T}1Z\t1\t\n").frame["heading_rad"].to_list() == [None]


def test_sign_and_offset_of_the_profile():
    given = profile({"r": {"channel": "rudder_angle", "unit": "deg", "positive": "port", "offset": 2.0}})
    assert read(f"utc,r\n{T}1Z,10\n", given).frame["rudder_angle_rad"].to_list() == [pytest.approx(math.radians(-8))]


def test_columns_that_are_missing_are_named_with_those_that_are_there():
    with pytest.raises(DataRejected, match=r"'hdg'.*'utc', 'sog', 'heading'") as error:
        read(f"utc,sog,heading\n{T}1Z,1,2\n")
    assert error.value.details == {"name": "log.csv", "missing": ["hdg"], "found": ["utc", "sog", "heading"]}


def test_without_a_source_the_error_names_the_columns():
    with pytest.raises(UsageError, match="'utc', 'sog'") as error:
        read_log("log.csv", b"utc,sog\n1,2\n", VesselProfile())
    assert error.value.code == "no_source_for_log"


def test_an_unknown_encoding_is_a_usage_error():
    with pytest.raises(UsageError, match="klingon"):
        read("utc,sog,hdg\n", profile(encoding="klingon"))


def test_two_columns_for_one_channel_are_a_usage_error():
    given = profile({"a": {"channel": "heading", "unit": "deg"}, "b": {"channel": "heading", "unit": "deg"}})
    with pytest.raises(UsageError, match="'a' and 'b'"):
        read(f"utc,a,b\n{T}1Z,1,2\n", given)


def test_a_column_named_twice_is_refused():
    with pytest.raises(DataRejected, match="more than one column named 'sog'"):
        read(f"utc,sog,sog,hdg\n{T}1Z,1,2,3\n")


def test_a_header_of_very_many_columns_costs_no_more_than_its_bytes():
    wide = b",".join(b"c%d" % k for k in range(100_000))
    data = b"t,h," + wide + b"\n" + b"\n".join(b"%d,%d" % (k, k) + b",3" * 100_000 for k in range(3))
    source = {"match": "*", "time": {"column": "t", "unit": "s", "start": "2025-05-03T00:00:00Z"}}
    given = VesselProfile.model_validate(
        {"sources": [{**source, "channels": {"h": {"channel": "heading", "unit": "deg"}}}]}
    )
    begin = process_time()
    assert read_log("wide.csv", data, given).frame.height == 3
    assert process_time() - begin < 2.0


def test_a_message_does_not_list_very_many_columns():
    data = b",".join(b"c%d" % k for k in range(50_000)) + b"\n1,2\n"
    with pytest.raises(DataRejected, match="and 49960 more") as caught:
        read_log("wide.csv", data, profile({"x": {"channel": "heading", "unit": "deg"}}))
    assert len(caught.value.message) < 1_000


def test_lines_may_end_with_carriage_returns_alone():
    assert read(f"utc,sog,hdg\r{T}1Z,10,90\r{T}2Z,,91\r").frame.height == 2


@pytest.mark.parametrize("sign", [",", "whitespace"])
@pytest.mark.parametrize("block", [16, 100, 1_000])
def test_where_the_rows_are_cut_into_blocks_changes_nothing(monkeypatch, sign, block):
    empty = "n/a" if sign == "whitespace" else ""
    rows = [f"{T}1.{k:03d}Z,{empty if k % 7 == 0 else k / 8},{k}{',x' if k % 11 == 0 else ''}" for k in range(200)]
    rows[5] = f'{T}1.005Z,"5",5'
    rows[150] = f'{T}1.150Z,"1""5",5'
    rows[151] = f'{T}1.151Z,"15,5'
    text = "\n".join(["utc,sog,hdg", *rows, ""])
    given = profile()
    if sign == "whitespace":
        text = "\n".join(row.replace(",", "  " if k % 2 else "\t") for k, row in enumerate(text.split("\n")))
        given = profile(separator="whitespace")
    whole = read(text, given)
    assert 0 < whole.tally.records_rejected < whole.tally.records_kept
    monkeypatch.setattr(delimited, "_BLOCK", block)
    parted = read(text, given)
    assert parted.frame.equals(whole.frame) and parted.rejected.equals(whole.rejected)
    assert parted.tally == whole.tally


def test_a_row_longer_than_any_is_refused_and_the_others_are_kept():
    rows = [f"{T}1Z,1,1", f'{T}2Z,"{"7" * (2 << 20)}",2', f"{T}3Z,3,3"]
    readings = read("\n".join(["utc,sog,hdg", *rows]))
    assert readings.tally.by_reason == {"malformed": 1}
    assert readings.frame["heading_rad"].to_list() == [math.radians(1), math.radians(3)]
    (raw,) = readings.rejected["raw"].to_list()
    assert raw.startswith(f'{T}2Z,"777')


def test_a_decimal_comma_is_read_where_the_profile_names_it():
    text = f"utc;sog;hdg\n{T}1,5Z;8,20162;-1\n{T}2,5Z;,5;1,5e1\n{T}3,5Z;7;90,0\n"
    readings = read(text, profile(decimal=","))
    assert readings.frame["heading_rad"].to_list() == [math.radians(x) for x in (-1.0, 15.0, 90.0)]
    assert readings.frame["speed_over_ground_m_s"].to_list() == [
        pytest.approx(x * 1852 / 3600) for x in (8.20162, 0.5, 7.0)
    ]


def test_a_decimal_comma_that_the_profile_does_not_name_is_refused_with_its_line():
    with pytest.raises(UsageError) as error:
        read(f"utc;sog;hdg\n{T}1Z;8,20162;90\n{T}2Z;8,3;91\n")
    assert error.value.code == "decimal_comma" and "'8,20162'" in error.value.message
    assert "decimal: ','" in error.value.next_step


def test_a_log_of_which_most_is_refused_says_so_first():
    rows = "".join(f"{T}{9 - k}Z,{k + 1},90\n" for k in range(9))
    readings = read("utc,sog,hdg\n" + rows)
    assert readings.tally.by_reason == {"clock_back": 8}
    assert readings.notes[0].startswith("8 of 9 records, most of the log, are refused as clock_back")
    assert "backwards" in readings.notes[0]


@pytest.mark.parametrize(("bad", "much"), [(100, "all"), (60, "60")])
def test_a_channel_of_which_most_values_are_refused_is_named_where_the_records_are_kept(bad, much):
    rows = [row.replace(",1,", ",-9999,") if k < bad else row for k, row in enumerate(rows_of(100))]
    readings = read("\n".join(["utc,sog,hdg", *rows]))
    assert readings.tally.records_kept == 100 and readings.tally.by_reason == {"out_of_range": bad}
    (note,) = readings.notes
    assert note.startswith(
        f"Of 100 values of speed_over_ground in records of which something is kept, {much} are refused as out_of_range"
    )


def test_values_that_are_refused_are_no_share_of_the_records():
    rows = [row.replace(",1,", ",-9999,") if k < 40 else row for k, row in enumerate(rows_of(100))]
    assert read("\n".join(["utc,sog,hdg", *rows])).notes == ()


def test_advice_on_coarse_times_is_that_for_the_format():
    rows = [f"{T}{k // 5}Z,1,{k}" for k in range(20)]
    note = read("\n".join(["utc,sog,hdg", *rows])).notes[0]
    assert note.startswith("16 of 20 records, most of the log, are refused as same_instant") and "coarser" in note
    assert "column of finer ones" in note and "MCAP" not in note and "publish_time" not in note


def test_nothing_that_can_be_read_is_shown_by_a_sample():
    with pytest.raises(DataRejected) as error:
        read("utc,sog,hdg\n03/05/2025 07:47:01,8,90\n")
    assert error.value.code == "no_valid_reading" and "'03/05/2025 07:47:01,8,90'" in error.value.message
    assert "date_form" in error.value.next_step


@pytest.mark.parametrize("sign", [",", ";", "\t"])
@pytest.mark.parametrize(("header", "row"), [("", ","), (",", ""), (",", ",")])
def test_a_separator_behind_the_last_cell_is_read_in_rows_in_the_header_and_in_both(header, row, sign):
    lines = [f"utc,sog,hdg{header}", *(f"{T}{k}Z,{k},{k + 90}{row}" for k in range(1, 9)), f"{T}9Z,3"]
    readings = read("\n".join(lines).replace(",", sign))
    assert readings.frame["heading_rad"].to_list() == [math.radians(k + 90) for k in range(1, 9)]
    assert readings.tally.by_reason == {"malformed": 1}
    with pytest.raises(UsageError) as error:
        read_log("log.csv", "\n".join(lines).replace(",", sign).encode(), VesselProfile())
    assert error.value.details["columns"] == ["utc", "sog", "hdg"]


def test_a_last_cell_that_is_empty_for_once_is_no_separator_too_many():
    readings = read(f"utc,sog,hdg\n{T}1Z,1,\n{T}2Z,1,\n{T}3Z,1,90,\n{T}4Z,1,90\n{T}5Z,1,90,,\n{T}6Z,1,90,7\n")
    assert readings.frame["heading_rad"].to_list() == [None, None, math.radians(90), math.radians(90)]
    assert readings.rejected["record"].to_list() == [4, 5]


@pytest.mark.parametrize("sign", [",", "\t"])
@pytest.mark.parametrize(
    ("header", "some", "more"), [("", "", ","), ("", ',""', ", "), (",", "", ","), (",,", "", ",,")]
)
def test_rows_with_and_without_a_separator_behind_the_last_cell_stand_in_one_file(header, some, more, sign):
    lines = [f"utc,sog,hdg{header}", *rows_of(30, 0, some), *rows_of(50, 30, more), "2025-05-03T08:00:00Z,1"]
    readings = read("\n".join(lines).replace(",", sign))
    assert readings.frame["heading_rad"].to_list() == [math.radians(k) for k in range(80)]
    assert readings.tally.by_reason == {"malformed": 1}


def test_a_message_has_the_number_of_columns_of_the_header_itself():
    lines = ["utc,sog,hdg", *rows_of(30, 0, ","), *rows_of(25, 30, ",7,8")]
    assert "25 of 55 rows have 5 cells" in (note := read("\n".join(lines)).notes[0]) and "the header has 3." in note


def test_a_column_without_a_name_may_be_the_first_as_pandas_writes_an_index():
    lines = ["\tutc\tsog\thdg", *(f"{k}\t{T}{k}Z\t1\t{k}" for k in range(9))]
    readings = read("\n".join(lines))
    assert readings.frame["heading_rad"].to_list() == [math.radians(k) for k in range(9)]
    assert delimited.titled("\n".join(lines).encode()) is None


@pytest.mark.parametrize(
    ("more", "source", "found", "todo"),
    [
        (",7", {}, "All 30 rows have 4 cells parted by ','; the header has 3.", "`columns` of the source"),
        (",7,7", {}, "All 30 rows have 5 cells parted by ','; the header has 3.", "`decimal: ','`"),
        (
            ",7",
            {"header_lines": 1, "columns": ["utc", "sog", "hdg"]},
            "All 30 rows have 4 cells parted by ','; the profile names 3 columns.",
            "`columns` of the source",
        ),
        (
            ",7",
            {"separator": "whitespace"},
            "All 30 rows have 2 cells parted by blanks; the header has 3.",
            "correct `separator`",
        ),
    ],
)
def test_rows_with_another_number_of_cells_are_reported_with_both_numbers(more, source, found, todo):
    text = "utc,sog,hdg\n" + "".join(f"{T}{k % 10}Z,1,2{more}\n" for k in range(30))
    if source.get("separator"):
        text = text.replace("sog,hdg", " sog hdg").replace("utc,", "utc").replace(f",1,2{more}", " 1,2")
    with pytest.raises(DataRejected) as error:
        read(text, profile(**source))
    assert error.value.code == "no_valid_reading" and error.value.details["by_reason"] == {"malformed": 30}
    assert found in error.value.message and todo in error.value.next_step
    assert "date_form" not in error.value.next_step


@pytest.mark.parametrize(
    ("text", "time", "advice"),
    [
        ("13/05/2025 06:00:0{}.638", {"date_form": "mm/dd/yyyy"}, "Times are read as"),
        ("03-May-2025 06:00:0{}", {}, "The date is no yyyy-mm-dd"),
        ("03/05/2025 06:00:0{}", {}, "The date is no yyyy-mm-dd"),
        ("3.5.2025 06:00:0{} UTC", {}, "The date is no yyyy-mm-dd"),
        ("03/05/2025 06:00:0{} AM", {}, "The date is no yyyy-mm-dd"),
        ("06:00:0{}.638", {}, "date: DATE"),
        ("4578{}.250007384", {}, "its `unit`"),
        ("2025-05-03 06:00:0{}:638", {}, "a point before the decimals of a second"),
        ("2025-05-03 06:00:0{} CEST", {}, "such as +02:00"),
        ("2025-05-03T06:00:0{}Z", {"unit": "s"}, "leave `unit` out"),
        ("yesterday at {}", {}, "ISO 8601"),
    ],
)
def test_times_that_cannot_be_read_are_quoted_with_their_column_and_the_forms_that_can(text, time, advice):
    rows = "".join(f"{text.format(k)},1,2\n" for k in range(1, 9))
    with pytest.raises(DataRejected) as error:
        read("utc,sog,hdg\n" + rows, profile(None, {"column": "utc", **time}))
    assert f"{text.format(5)!r} in the column 'utc' of row 5 (line 6)" in error.value.message
    assert "The time of all 8 rows cannot be read" in error.value.message
    assert advice in error.value.next_step and "2025-05-03T06:00:00.5Z" in error.value.next_step


def test_advice_on_a_time_is_about_what_is_wrong_with_it():
    with pytest.raises(DataRejected) as error:
        read("utc,sog,hdg\n3.5.2025 06:00:01 UTC,1,2\n")
    assert "zone" not in error.value.next_step and "clock" not in error.value.next_step
    text = "day,utc,sog,hdg\n" + "".join(f"3.5.2025,06:00:0{k},1,2\n" for k in range(3))
    with pytest.raises(DataRejected) as error:
        read(text, profile(None, {"date": "day", "time": "utc"}))
    assert "'3.5.2025' in the column 'day' and '06:00:01' in the column 'utc' of row 2 (line 3)" in error.value.message
    assert error.value.next_step.startswith("The date is no yyyy-mm-dd")
    with pytest.raises(DataRejected) as error:
        read(text, profile(None, {"date": "day", "time": "utc", "date_form": "dd/mm/yyyy"}))
    assert "cannot be read with `date_form: dd/mm/yyyy`" in error.value.message
    assert error.value.next_step.startswith("Times are read as")
    with pytest.raises(DataRejected) as error:
        read(text.replace(",1,2", " AM,1,2"), profile(None, {"date": "day", "time": "utc", "date_form": "dd/mm/yyyy"}))
    assert error.value.next_step.startswith("Times are read as")


def test_many_times_that_cannot_be_read_are_noted_and_a_few_are_not():
    def notes(bad):
        rows = "".join(f"{'?' if k < bad else ''}2025-05-03T07:{k // 60:02d}:{k % 60:02d}Z,1,2\n" for k in range(900))
        readings = read("utc,sog,hdg\n" + rows)
        assert readings.tally.by_reason == {"malformed": bad}
        return readings.notes

    assert notes(19) == ()
    (note,) = notes(30)
    assert note.startswith("The time of 30 of 900 rows cannot be read, such as '?2025-05-03T07:00:15Z'")


def test_an_hour_of_one_digit_beside_hours_of_two_costs_no_row():
    text = "utc,sog,hdg\n2025-05-03 9:59:59,1,2\n2025-05-03 10:00:00,1,2\n2025-05-03 7,1,2\n2025-05-03 7:47,1,2\n"
    readings = read(text)
    assert (readings.frame["time_utc_ns"][1] - readings.frame["time_utc_ns"][0]) == 10**9
    assert readings.rejected["record"].to_list() == [2, 3]
    assert readings.notes[1:] == ("Times without a zone are taken as UTC.",)


@pytest.mark.parametrize(
    ("header", "sign"),
    [
        ('utc,"depth, below keel",sog,hdg', ","),
        ('"utc", "depth, below ""the"" keel" , "sog","hdg"', ","),
        ('utc;"depth, below, the, keel";sog;hdg', ";"),
        ("utc,depth 5' below,sog,hdg", ","),
        ('utc,"depth,sog,hdg', ","),
    ],
)
def test_the_header_may_have_separators_between_quotation_marks(header, sign):
    rows = f"{T}1Z,7,10,90\n{T}2Z,8,11,91\n".replace(",", sign)
    readings = read(f"{header}\n{rows}")
    assert readings.frame["heading_rad"].to_list() == [math.radians(90), math.radians(91)]


@pytest.mark.parametrize("header", ['t,"depth, below keel",hdg', "t,depth,hdg", "t,depth,hdg,"])
@pytest.mark.parametrize("more", ["", ","])
def test_a_header_with_quoted_names_or_a_separator_at_its_end_is_no_title(header, more):
    text = f"{header}\n" + f"1.5,2,3{more}\n" * 9
    assert delimited.titled(text.encode()) is None


@pytest.mark.parametrize("place", [0, 1, 5, 199])
@pytest.mark.parametrize("length", [16, 4096, 60_000])
def test_a_block_of_nul_bytes_costs_one_row_wherever_it_stands(place, length):
    lines = ["utc,sog,hdg", *(f"2025-05-03T07:{k // 60:02d}:{k % 60:02d}Z,1,{k}" for k in range(200))]
    lines[place] = "\0" * length + lines[place]
    readings = read("\n".join(lines))
    assert readings.rejected["record"].to_list() == ([place - 1] if place else [])
    assert readings.tally.records_read == 200


@pytest.mark.parametrize("title", [[], ["KVLCC2, a trial"]])
def test_a_block_of_nul_bytes_that_ends_a_line_before_the_header_is_no_header(title):
    data = "\n".join(["\0" * 600, *title, "utc,sog,hdg", *rows_of(9), "\0" * 16, *rows_of(9, 9)]).encode()
    readings = read(data, profile(header_lines=len(title)))
    assert readings.rejected["record"].to_list() == [9] and readings.tally.records_kept == 18
    assert delimited.titled(data) is None or delimited.titled(data).header_lines == len(title)


def test_a_block_of_nul_bytes_is_a_row_where_no_header_stands_before_the_rows():
    data = "\n".join(["\0" * 600, *rows_of(9)])
    readings = read(data, profile(columns=["utc", "sog", "hdg"]))
    assert readings.rejected["record"].to_list() == [0] and readings.tally.records_kept == 9


@pytest.mark.parametrize("data", [bytes(100), b"\0\n" * 99, bytes(50_000) + b"\x01\x02,\x03\n" * 9, b"a,b\0\n" * 99])
def test_other_bytes_with_nul_among_them_are_no_text(data):
    with pytest.raises(DataRejected) as error:
        read_log("log.csv", data, profile())
    assert error.value.code == "unknown_format"


def test_an_archive_is_named_as_one():
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as archive:
        archive.addfile(tarfile.TarInfo("log.csv"), io.BytesIO())
    with pytest.raises(DataRejected, match="is a tar archive") as error:
        read_log("log.tar", stream.getvalue(), profile())
    assert error.value.code == "unknown_format"


def rows_of(n, begin=0, more=""):
    return [f"2025-05-03T07:{k // 60:02d}:{k % 60:02d}Z,1,{k % 360}{more}" for k in range(begin, begin + n)]


def test_a_column_that_was_added_on_the_way_is_noted_with_the_row_from_which_on():
    lines = ["utc,sog,hdg", *rows_of(600), "", "utc,sog,hdg,trim", *rows_of(400, 600, ",0.1")]
    lines[700] = "2025-05-03T07:11:3"
    readings = read("\n".join(lines))
    assert readings.tally.by_reason == {"malformed": 401}
    (note,) = readings.notes
    assert note.startswith(
        "400 of 1001 rows have 4 cells parted by ',', from row 601 (line 603) on, and 1 has another number; the "
        "header has 3. Columns were added"
    )


@pytest.mark.parametrize(
    ("lines", "found"),
    [
        # between two stretches of whole rows
        (
            [*rows_of(300), *rows_of(100, 300, ",1"), *rows_of(200, 400)],
            "100 of 600 rows have 4 cells parted by ',', from row 301 (line 302) to row 400 (line 401)",
        ),
        # before a column was taken away
        (
            [*rows_of(100, 0, ",1"), *rows_of(200, 100)],
            "100 of 300 rows have 4 cells parted by ',', from row 1 (line 2) to row 100 (line 101)",
        ),
        # here and there
        (
            [row + (",1" if k % 10 == 3 else "") for k, row in enumerate(rows_of(600))],
            "60 of 600 rows have 4 cells parted by ','",
        ),
    ],
)
def test_a_note_says_which_rows_have_another_number_of_cells(lines, found):
    readings = read("\n".join(["utc,sog,hdg", *lines]))
    (note,) = readings.notes
    assert note.startswith(f"{found}; the header has 3.")
    assert readings.tally.records_read == len(lines)


def test_a_few_damaged_rows_are_counted_and_not_noted():
    lines = rows_of(3000)
    lines[100:1100:50] = [row + ",7" for row in lines[100:1100:50]]
    readings = read("\n".join(["utc,sog,hdg", *lines]))
    assert readings.tally.by_reason == {"malformed": 20} and readings.notes == ()


def test_one_row_is_no_stretch_at_which_a_log_is_to_be_cut():
    (note,) = read(f"utc,sog,hdg\n{T}1Z,1,90\n{T}2Z\n{T}3Z,2,91,4,5\n").notes[:1]
    assert note.startswith("1 of 3 rows has 1 cell parted by ',', and 1 has another number; the header has 3.")
    assert "cut the log" not in note
    with pytest.raises(DataRejected, match=r"The only row has 1 cell parted by ','; the header has 3\."):
        read(f"utc,sog,hdg\n{T}2Z\n")


@pytest.mark.parametrize("unit", ["s", None])
def test_a_time_with_a_decimal_comma_is_reported_as_one(unit):
    text = "utc;sog;hdg\n" + "".join(f"{k},5;1;90\n" for k in range(9))
    with pytest.raises(DataRejected) as error:
        read(text, profile(None, {"column": "utc", **({"unit": unit} if unit else {})}))
    assert "`decimal: ','`" in error.value.next_step and "leave `unit` out" not in error.value.next_step


INCHES, NOTE = '5",6"', '5"'


@pytest.mark.parametrize(
    ("names", "more"), [("a,b", INCHES), ("note", NOTE), ("a", ' 5" of "x"'), ("a,b", '"a, b", 5"')]
)
def test_a_quotation_mark_within_a_cell_is_text(names, more):
    readings = read("\n".join([f"utc,sog,hdg,{names}", *rows_of(30, 0, f",{more}")]))
    assert readings.frame.height == 30 and readings.notes == ()


def test_quotations_that_are_never_closed_are_reported_as_such():
    rows = [*rows_of(10), *rows_of(30, 10, ',"open')]
    with pytest.raises(DataRejected) as error:
        read("\n".join(["utc,sog,hdg,note", *rows[10:]]))
    assert "In all 30 rows a cell begins with a quotation mark that is never closed, such as" in error.value.message
    assert "of row 16 (line 17); expected a second mark" in error.value.message
    assert error.value.next_step.startswith("Export the log with a mark at either end")
    assert "In 30 of 40 rows" in read("\n".join(["utc,sog,hdg", *rows])).notes[0]


def _by_steps(row, sign):
    """Return the cells of a row, None where a quotation is not closed, character by character."""
    cells, state = [""], "begin"
    for c in row:
        if state == "quoted":
            state = "closed" if c == '"' else "quoted"
        elif state == "closed" and c == '"':
            state = "quoted"
        elif c == sign:
            cells.append("")
            state = "begin"
            continue
        elif state == "begin" and c == '"':
            state = "quoted"
        elif not (state == "begin" and c in " \t"):
            state = "text"
        cells[-1] += c
    return None if state == "quoted" else cells


@pytest.mark.parametrize("sign", [",", "\t", ";"])
def test_quotations_in_columns_are_those_character_by_character(sign):
    chance = random.Random(7)
    rows = ["".join(chance.choices('"" a' + 2 * sign, k=chance.randint(1, 12))) for _ in range(4000)]
    data = ("\n".join(rows)).encode()
    inside, closed = inside_quotes(
        np.frombuffer(data, dtype=np.uint8), lines_of(np.frombuffer(data, dtype=np.uint8)), sign
    )
    at = 0
    for row, whole in zip(rows, closed, strict=True):
        expected = _by_steps(row, sign)
        assert whole == (expected is not None), row
        if expected is not None:
            assert sum(c == sign and not inside[at + k] for k, c in enumerate(row)) == len(expected) - 1, row
        at += len(row) + 1
