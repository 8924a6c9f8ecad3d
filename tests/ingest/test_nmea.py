"""NMEA 0183: every sentence, every reason, every way a time is found, on logs small enough to check by hand."""

import math
from datetime import UTC, datetime

import pytest

from kempf.pipeline.ingest.mapping import nmea_corrections
from kempf.pipeline.ingest.nmea import frames as nmea_frames
from kempf.pipeline.ingest.nmea.decode import decode
from kempf.pipeline.ingest.nmea.frames import frames_of
from kempf.pipeline.ingest.readings import Readings
from kempf.pipeline.ingest.screen import Screen
from kempf.pipeline.ingest.spans import as_bytes
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import ChannelMap, Source, VesselProfile
from tests.reading import read_log

KN = 1852 / 3600


def sentence(body, opening="$"):
    total = 0
    for char in body.encode():
        total ^= char
    return f"{opening}{body}*{total:02X}"


def stamped(*bodies, at="2025-05-03T07:47:01.147Z"):
    return "".join(f"{at} {sentence(b)}\r\n" for b in bodies)


def read(text, source=None) -> Readings:
    data = text if isinstance(text, bytes) else text.encode()
    readings = Screen("nmea").part(decode(data, nmea_corrections("test.nmea", source)))
    tally = readings.tally
    assert tally.records_read == tally.records_kept + tally.records_rejected
    assert tally.values_read == tally.values_kept + tally.values_rejected
    assert sum(tally.by_reason.values()) == readings.rejected.height
    return readings


def ns(text):
    when = datetime.fromisoformat(text)
    return int(when.replace(microsecond=0).timestamp()) * 10**9 + when.microsecond * 1000


RMC = "GPRMC,074701.15,A,5954.0003,N,02435.9999,E,17.64,13.43,030525,,,A"


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("GPVTG,13.43,T,,M,17.64,N,32.68,K,A", {"course_over_ground_rad": math.radians(13.43)}),
        ("GPVTG,,T,,M,17.64,N,32.68,K,A", {"speed_over_ground_m_s": 17.64 * KN}),
        ("HEHDT,11.37,T", {"heading_rad": math.radians(11.37)}),
        ("HETHS,11.37,A", {"heading_rad": math.radians(11.37)}),
        ("HCHDG,181.7,1.0,W,0.6,E", {"heading_rad": math.radians(181.3)}),
        ("HCHDG,359.7,,,0.6,E", {"heading_rad": math.radians(0.3)}),
        ("TIROT,-6.0,A", {"yaw_rate_rad_s": math.radians(-0.1)}),
        ("AGRSA,-3.5,A,4.0,A", {"rudder_angle_rad": math.radians(-3.5)}),
        ("VDVHW,,T,,M,17.49,N,32.40,K", {"speed_through_water_m_s": 17.49 * KN}),
        ("VDVBW,8.0,0.1,A,8.2,0.0,A", {"speed_through_water_m_s": 8.0 * KN}),
        ("WIMWV,23.3,R,13.1,M,A", {"wind_angle_rad": math.radians(23.3), "wind_speed_m_s": 13.1}),
        ("WIMWV,23.3,R,10.0,N,A", {"wind_speed_m_s": 10 * KN}),
        ("WIMWV,23.3,R,36.0,K,A", {"wind_speed_m_s": 10.0}),
        ("ERRPM,S,1,120.0,,A", {"shaft_speed_per_s": 2.0}),
        ("SDDPT,53.7,0.0", {"water_depth_m": 53.7}),
        ("SDDBT,1.8,f,0.5,M,0.3,F", {"water_depth_m": 0.5}),
        ("YXXDR,A,-2.0,D,ROLL", {"roll_rad": math.radians(-2.0)}),
        (
            "WIXDR,C,,C,WCHR,A,-0.2,D,PTCH,A,-7.1,D,ROLL",
            {"pitch_rad": math.radians(-0.2), "roll_rad": math.radians(-7.1)},
        ),
        ("IIXDR,A,1.5,D,PITCH", {"pitch_rad": math.radians(1.5)}),
        ("GPGGA,074701.00,5954.0,N,02436.0,W,1,08,1.0,1,M,,M,,", {"longitude_rad": math.radians(-24.6)}),
        ("GPGLL,5954.0,S,02436.0,E,074701.00,A", {"latitude_rad": math.radians(-59.9)}),
        (RMC, {"latitude_rad": math.radians(59.900005), "speed_over_ground_m_s": 17.64 * KN}),
    ],
)
def test_a_sentence_gives_its_channels_in_si(body, expected):
    readings = read(stamped(body))
    assert readings.frame.height == 1
    row = readings.frame.row(0, named=True)
    assert row["source"] == body[:5]
    for column, value in expected.items():
        assert row[column] == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (sentence("HEHDT,11.37,T")[:-3], "checksum"),
        (sentence("HEHDT,11.37,T")[:-1], "checksum"),
        (sentence("HEHDT,11.37,T").replace("1.37", "1.38"), "checksum"),
        (sentence("HEHDT,11.37,T") + "x", "checksum"),
        ("$GPRMC,0747" + sentence("HEHDT,11.37,T"), "checksum"),
        ("HEHDT,11.37,T*2B", "malformed"),
        ("#" + sentence("HEHDT,11.37,T")[1:], "malformed"),
        (sentence("GPVTG,13.43,T"), "malformed"),
        (sentence("AIVDM,1,1,,A,13u=hGP3CWPlvs2Q8sHW:5fD0h6a,0", "!"), "no_channel"),
        (sentence("GPRMC,,A", "!"), "no_channel"),
        (sentence("GPGSV,3,3,10,29,69,069,,31,54,240,"), "no_channel"),
        (sentence("PGRMC,A,,,,,,,,,"), "no_channel"),
        (sentence("GPZDA,074701.00,03,05,2025,00,00"), "no_channel"),
        (sentence("HCHDM,181.7,M"), "no_channel"),
        (sentence("HCHDG,181.7,,,,"), "no_channel"),
        (sentence("WIMWV,23.3,T,13.1,M,A"), "no_channel"),
        (sentence("ERRPM,E,1,1200.0,,A"), "no_channel"),
        (sentence("YXXDR,C,10.7,C,AIRTEMP"), "no_channel"),
        (sentence("GPRMC,074701.15,V,,,,,,,030525,,,N"), "void"),
        (sentence("GPGGA,074701.15,5954.0,N,02436.0,E,0,00,,,M,,M,,"), "void"),
        (sentence("GPGLL,5954.0,N,02436.0,E,074701.15,V"), "void"),
        (sentence("AGRSA,3.0,V,,"), "void"),
        (sentence("WIMWV,23.3,R,13.1,M,V"), "void"),
        (sentence("HEHDT,,T"), "void"),
        (sentence("HETHS,11.37,V"), "void"),
        (sentence("YXXDR,A,,D,ROLL"), "void"),
        (sentence("HEHDT,nan,T"), "not_a_number"),
        (sentence("HEHDT,1e999,T"), "not_a_number"),
        (sentence("HEHDT,-1.-3,T"), "not_a_number"),
        (sentence("VDVHW,,T,,M,17.49,X,,K"), "not_a_number"),
        (sentence("HEHDT,999.0,T"), "out_of_range"),
        (sentence("GPGLL,5964.0,N,18136.0,E,074701.15,A"), "not_a_number"),
    ],
)
def test_what_is_refused_has_its_reason(line, reason):
    good = stamped("SDDPT,53.7,0.0", "AGRSA,0.0,A,,")
    readings = read(good + f"2025-05-03T07:47:02.000Z {line}\r\n")
    assert readings.frame.height == 2
    assert readings.tally.by_reason == {reason: 1}
    assert readings.rejected.row(0, named=True)["raw"] == f"2025-05-03T07:47:02.000Z {line}"
    assert readings.rejected["record"].to_list() == [2]


def test_a_value_is_refused_by_itself_where_the_record_has_others():
    readings = read(stamped("WIMWV,23.3,R,999.0,M,A"))
    assert readings.frame["wind_angle_rad"].to_list() == [math.radians(23.3)]
    assert readings.rejected.select("record", "channel", "reason").rows() == [(0, "wind_speed", "out_of_range")]
    assert (readings.tally.values_read, readings.tally.values_rejected, readings.tally.records_rejected) == (2, 1, 0)


def test_sentences_tell_their_own_time_and_others_have_the_stamp():
    text = stamped(RMC, "GPGGA,074701.20,5954.0,N,02436.0,E,1,08,1.0,1,M,,M,,", "HEHDT,11.37,T")
    times = read(text).frame["time_utc_ns"].to_list()
    assert times == [
        ns("2025-05-03T07:47:01.150+00:00"),
        ns("2025-05-03T07:47:01.200+00:00"),
        ns("2025-05-03T07:47:01.147+00:00"),
    ]


def test_a_stamp_that_cannot_be_read_makes_the_line_malformed():
    text = stamped("HEHDT,11.37,T", "SDDPT,5.0,0.0") + stamped("HEHDT,11.38,T", at="2025-13-03T07:47:01.147Z")
    assert read(text).tally.by_reason == {"malformed": 1}


def test_a_logger_clock_that_is_off_is_reported():
    readings = read(stamped(RMC, at="2025-05-03T08:47:01.150Z"))
    assert readings.notes == (
        "The logger's stamps are 3600.000 s ahead of the receiver's UTC (median), by 1 of its fixes: too few to put "
        "them right.",
    )
    assert readings.frame["time_utc_ns"].to_list() == [ns("2025-05-03T07:47:01.150+00:00")]


def test_untimed_sentences_of_a_plain_log_have_the_time_of_the_fix_before():
    text = "\n".join(map(sentence, ["HEHDT,10.0,T", RMC, "HEHDT,11.0,T", "SDDPT,5.0,"]))
    readings = read(text)
    assert readings.tally.by_reason == {"no_time": 1}
    assert set(readings.frame["time_utc_ns"]) == {ns("2025-05-03T07:47:01.150+00:00")}


def test_vtg_that_repeats_the_next_fix_moves_untimed_sentences_there():
    bodies = []
    for k in range(12):
        bodies += [
            f"GNVTG,231.0,T,,M,{k}.114,N,2.0,K,D",
            f"GNHDT,{k}.0,T",
            f"GPRMC,09415{k // 5}.{k % 5 * 2}0,A,2234.3,N,11431.8,E,{k}.11,231.1,051224,,,D",
        ]
    readings = read("\r\n".join(map(sentence, bodies)))
    assert "next fix" in readings.notes[0]
    assert readings.tally.records_rejected == 0
    by_speed = readings.frame.filter(readings.frame["source"] == "GNVTG")["time_utc_ns"].to_list()
    assert by_speed == readings.frame.filter(readings.frame["source"] == "GPRMC")["time_utc_ns"].to_list()


def test_dates_come_from_rmc_or_zda_and_are_carried_back_and_over_midnight():
    text = "\n".join(
        map(
            sentence,
            [
                "GPGLL,5954.0,N,02436.0,E,235958.00,A",
                "GPRMC,235959.00,A,5954.0,N,02436.0,E,1.0,2.0,311224,,,A",
                "GPGLL,5954.0,N,02436.0,E,000000.50,A",
                "GPZDA,000001.00,01,01,2025,00,00",
                "GPGGA,000001.00,5954.0,N,02436.0,E,1,08,1.0,1,M,,M,,",
            ],
        )
    )
    assert [datetime.fromtimestamp(t / 1e9, UTC).isoformat() for t in read(text).frame["time_utc_ns"]] == [
        "2024-12-31T23:59:58+00:00",
        "2024-12-31T23:59:59+00:00",
        "2025-01-01T00:00:00.500000+00:00",
        "2025-01-01T00:00:01+00:00",
    ]


def test_without_any_date_nothing_has_a_time():
    readings = read("\n".join(map(sentence, ["GPGLL,5954.0,N,02436.0,E,235958.00,A", "HEHDT,1.0,T"])))
    assert readings.tally.by_reason == {"no_time": 2}


def test_a_repeater_without_date_does_not_carry_its_late_time():
    bodies = [RMC, "IIRMC,074658,A,5954.0,N,02436.0,E,17.6,13.4,,,E", "HEHDT,11.0,T"]
    readings = read("\n".join(map(sentence, bodies)))
    assert readings.frame["time_utc_ns"].to_list() == [
        ns("2025-05-03T07:47:01.150+00:00"),
        ns("2025-05-03T07:46:58+00:00"),
        ns("2025-05-03T07:47:01.150+00:00"),
    ]


def test_an_unset_clock_is_refused():
    readings = read(sentence("GPRMC,000001.00,A,5954.0,N,02436.0,E,1.0,2.0,060180,,,A"))
    assert readings.tally.by_reason == {"clock_unset": 1}


def test_a_clock_that_runs_back_is_refused_source_by_source():
    text = "".join(
        stamped(b, at=f"2025-05-03T07:47:{s:02d}.000Z")
        for s, b in [(5, "HEHDT,1.0,T"), (3, "HEHDT,2.0,T"), (3, "SDDPT,5.0,"), (5, "HEHDT,3.0,T"), (6, "HEHDT,4.0,T")]
    )
    readings = read(text)
    assert readings.rejected.select("record", "reason").rows() == [(1, "clock_back"), (3, "same_instant")]


def test_one_damaged_time_far_ahead_does_not_cost_the_rest():
    text = "".join(
        stamped(f"HEHDT,{k}.0,T", at=f"20{'75' if k == 2 else '25'}-05-03T07:47:0{k}.000Z") for k in range(6)
    )
    assert read(text).rejected.select("record", "reason").rows() == [(2, "clock_back")]


def test_repeats_are_duplicates_and_other_content_at_one_instant_is_counted():
    readings = read(stamped("HEHDT,1.0,T", "HEHDT,2.0,T", "HEHDT,1.0,T", "AGRSA,1.0,A,,", "IIRSA,1.0,A,,"))
    assert readings.rejected.select("record", "reason").rows() == [(1, "same_instant"), (2, "duplicate")]
    assert readings.frame["source"].to_list() == ["HEHDT", "AGRSA", "IIRSA"]


def test_two_transducer_sentences_at_one_instant_may_carry_different_channels():
    readings = read(stamped("YXXDR,A,1.0,D,ROLL", "YXXDR,A,2.0,D,PTCH,A,3.0,D,ROLL"))
    assert readings.frame.height == 2
    assert readings.frame["roll_rad"].to_list() == [math.radians(1.0), None]
    assert readings.rejected.select("channel", "reason").rows() == [("roll", "same_instant")]


def test_odd_lines_do_not_disturb_the_others():
    odd = b"17.6,13*2A\r\n\r\n   \r\n\0\0\0\r\n" + b"$" + b"A" * 100_000 + b"\r\n\xff\xfe$HEHDT\xff,1*00\n"
    good = stamped("HEHDT,11.37,T", "SDDPT,5.0,", "AGRSA,1.0,A,,", "TIROT,1.0,A", "ERRPM,S,1,1.0,,A").encode()
    readings = read(odd + good + b"2025-05-03T07:47:01.1")
    assert readings.tally.records_read == 4 + 5 + 1
    assert readings.frame.height == 5
    assert readings.tally.by_reason == {"checksum": 2, "malformed": 3}
    assert readings.rejected["raw"].str.len_chars().max() == 2000


def test_tag_blocks_are_stepped_over():
    readings = read("\\s:r1,c:1120959341*hh\\" + sentence(RMC) + "\n" + "\\g:1-2-3*hh\\" + sentence("HEHDT,1.0,T"))
    assert readings.frame["source"].to_list() == ["GPRMC", "HEHDT"]


def test_nul_bytes_in_front_of_a_plain_line_cost_nothing():
    assert read(b"\0\0" + sentence(RMC).encode()).frame.height == 1


def test_the_checksum_oracle():
    lines = [sentence(f"HEHDT,{k / 7:.3f},T") for k in range(200)]
    lines[3] = lines[3].replace(",T", ",M")
    lines[77] = lines[77].lower().replace("$hehdt", "$HEHDT").replace(",t", ",T")
    data = "\n".join(lines).encode()
    right = []
    for line in lines:
        body, _, given = line[1:].rpartition("*")
        total = 0
        for char in body.encode():
            total ^= char
        right.append(total == int(given, 16))
    assert ((frames_of(as_bytes(data)).reason == 0).tolist()) == right
    assert right.count(False) == 1


def test_the_profile_corrects_one_sentence_by_name():
    source = Source(
        match="*",
        channels={"AGRSA.rudder_angle": ChannelMap(channel="rudder_angle", unit="deg", positive="port", offset=0.5)},
    )
    readings = read(stamped("AGRSA,3.0,A,,", "IIRSA,3.0,A,,"), source)
    assert readings.frame["rudder_angle_rad"].to_list() == pytest.approx([math.radians(-2.5), math.radians(3.0)])


@pytest.mark.parametrize("key", ["rudder", "AGRSA.heading", "AGXXX.rudder_angle"])
def test_a_profile_key_that_fits_no_sentence_is_a_usage_error(key):
    source = Source(match="*", channels={key: ChannelMap(channel="rudder_angle", unit="deg")})
    with pytest.raises(UsageError, match="fits none of them"):
        nmea_corrections("a.nmea", source)


@pytest.mark.parametrize("size", [1, 7, 64, 1000])
def test_the_size_of_the_blocks_changes_nothing(monkeypatch, size):
    text = "".join(stamped(f"HEHDT,{k}.5,T", at=f"2025-05-03T07:47:{k:02d}.000Z") for k in range(40)) + "$X" * 300
    whole = read(text)
    monkeypatch.setattr(nmea_frames, "_BLOCK", size)
    cut = read(text)
    assert cut.frame.equals(whole.frame)
    assert cut.rejected.equals(whole.rejected)
    assert whole.frame.height == 40


def test_a_source_for_delimited_text_that_shares_the_pattern_is_left_aside():
    source = Source(match="*", time={"column": "t"}, channels={"h": ChannelMap(channel="heading", unit="deg")})
    assert read(stamped("HEHDT,11.37,T"), source).frame.height == 1


@pytest.mark.parametrize(
    "front",
    [
        "1746258421147 ",
        "1746258421.147,",
        "(1746258421.147000) ",
        "[2025-05-03T07:47:01.147Z] ",
        "<2025-05-03T09:47:01.147+02:00> ",
        '"2025-05-03T07:47:01.147Z","',
        "2025-05-03T07:47:01.147Z,COM3,",
        "2025-05-03 07:47:01,147 INFO ",
        "2025-05-03 07:47:01:147 ",
        "2025-05-03 07:47:01.147 UTC ",
        "2025-05-03 09:47:01.147 +0200 ",
        "2025-05-03 02:47:01.147-05 ",
        "2025-05-03 07:47:01.147 -67 ",
        "2025/05/03 07:47:01.147 ",
        "20250503T074701.147Z ",
        "GPS1 2025-05-03T07:47:01.147Z -> ",
        "2025-05-03T07:47:01.147Z|",
    ],
)
def test_a_time_in_front_of_a_sentence_is_read_whatever_is_around_it(front):
    readings = read((front + sentence("HEHDT,11.37,T") + "\r\n") * 2 + f"{front}{sentence('AGRSA,3.0,A,,')}\r\n")
    assert set(readings.frame["time_utc_ns"].to_list()) == {ns("2025-05-03T07:47:01.147+00:00")}
    assert not any("not read as a time" in note for note in readings.notes)


@pytest.mark.parametrize(
    "front",
    [
        *(
            "07:47:01.147;",
            "03.05.2025 07:47:01.147;",
            "123456 ",
            "GPS1 ",
            "SN1746258421 ",
            "5746258421 ",
            "17462584211 ",
        ),
        # zones and halves of the day that would be read as UTC
        *("2025-05-03 09:47:01.147 UTC+02:00 ", "2025-05-03 09:47:01 GMT+2 ", "2025-05-03T09:47:01.147+2 "),
        *("2025-05-03 01:47:01 PM ", "2025-05-03 09:47:01 CEST "),
    ],
)
def test_text_in_front_of_the_sentences_that_is_no_time_is_shown(front):
    line = f"{front}{sentence(RMC)}\r\n"
    (note,) = [note for note in read(line * 2 + sentence("HEHDT,11.37,T")).notes if "not read as a time" in note]
    assert f"such as {front!r}, is" in note
    notes = read(line + 2 * f"{sentence('HEHDT,11.37,T')}\r\n").notes
    assert not any("not read as a time" in note for note in notes)


def test_a_log_without_any_time_says_that_the_text_in_front_is_none():
    line = f"07:47:01.147;{sentence('HEHDT,11.37,T')}\r\n".encode()
    with pytest.raises(DataRejected, match=r"such as '07:47:01\.147;', is not read as a time"):
        read_log("test.nmea", line * 3, VesselProfile.model_validate({"vessel": "tug"}))


def test_a_cell_of_a_table_ends_with_its_quote():
    row = f'"2025-05-03T07:47:01.147Z","{sentence("HEHDT,11.37,T")}"\r\n'
    readings = read(row)
    assert readings.frame["time_utc_ns"].to_list() == [ns("2025-05-03T07:47:01.147+00:00")]
    assert readings.frame["heading_rad"].to_list() == [math.radians(11.37)]


def test_stamps_in_front_of_sentences_are_read_across_blocks(monkeypatch):
    monkeypatch.setattr(nmea_frames, "_BLOCK", 64)
    text = "".join(f"[{1746258421 + k}.25] {sentence('HEHDT,11.37,T')}\n" for k in range(20))
    times = read(text).frame["time_utc_ns"].to_list()
    assert times == [(1746258421 + k) * 10**9 + 250_000_000 for k in range(20)]


def _checksum_notes(text):
    return [note for note in read(text).notes if "checksum and were refused" in note]


def test_an_instrument_that_sends_no_checksum_is_named():
    rudder = sentence("AGRSA,3.0,A,,")
    heading = f"{sentence('HEHDT,11.37,T')}\r\n"
    (note,) = _checksum_notes((heading + rudder[:-3] + "\r\n") * 4 + heading)
    assert note.startswith("4 sentences AGRSA have no checksum and were refused")
    (note,) = _checksum_notes((heading + rudder[:-2] + "00\r\n") * 4 + heading)
    assert note.startswith("4 sentences AGRSA have a wrong checksum and were refused")
    assert read((heading + rudder[:-3] + "\r\n") * 4).tally.by_reason["checksum"] == 4


def test_sentences_that_were_damaged_here_and_there_accuse_no_instrument():
    rudder = sentence("AGRSA,3.0,A,,")
    sound = f"{rudder}\r\n{sentence('HEHDT,11.37,T')}\r\n"
    assert _checksum_notes(sound * 3 + rudder[:-3] + "\r\n" + rudder[:-2] + "00\r\n") == []
    # a maker's own sentence is not read, with a checksum or without
    assert _checksum_notes(sound + "$PMTK,1\r\n") == []
