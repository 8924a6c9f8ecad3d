"""Sentences against an independent decoder, on real logs and generated ones; what only we read, by hand."""

import math
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kempf.pipeline.ingest.decoded import CODE, Reason
from kempf.pipeline.ingest.nmea.decode import decode
from kempf.pipeline.ingest.screen import Screen
from kempf.schemas.profile import parse
from tests.reading import read_log

SHARED = Path(__file__).parents[2].parent / "shared"
DEG, KN = math.pi / 180, 1852 / 3600


def sentence(body):
    return f"${body}*{reduce(xor, body.encode(), 0):02X}"


def number(text, factor=1.0):
    try:
        return float(text) * factor
    except (TypeError, ValueError):
        return None


def fix(message, mark, good, mode):
    """Return the position, None where status, quality or mode say that it is none."""
    data = [*message.data, *[""] * 21]
    if data[mark] not in good or data[mode] not in ("", *"ADFRP"):
        return None
    return {"latitude": message.latitude * DEG, "longitude": message.longitude * DEG}


def rmc(m):
    said = fix(m, 1, "A", 11)
    over_ground = {
        "speed_over_ground": number(m.spd_over_grnd, KN),
        "course_over_ground": number(m.true_course, DEG),
    }
    return None if said is None else said | over_ground


def hdg(m):
    if not m.variation:
        return None
    side = {"E": 1, "W": -1, "": 0}
    shift = float(m.variation) * side[m.var_dir] + (float(m.deviation) * side[m.dev_dir] if m.deviation else 0.0)
    return {"heading": math.radians((float(m.heading) + shift) % 360)}


def mwv(m):
    unit = {"M": 1.0, "N": KN, "K": 1 / 3.6}[m.wind_speed_units]
    said = {"wind_angle": number(m.wind_angle, DEG), "wind_speed": number(m.wind_speed, unit)}
    return said if (m.reference, m.status) == ("R", "A") else None


def rpm(m):
    shaft = m.source == "S" and str(m.engine_no) in {"0", "1"} and m.status == "A"
    return {"shaft_speed": number(m.speed, 1 / 60)} if shaft else None


def vbw(m):
    said = {
        "speed_through_water": number(m.lon_water_spd, KN),
        "lateral_speed_through_water": number(m.trans_water_spd, KN),
    }
    return said if m.data_validity_water_spd == "A" else None


#: What a sentence says by the independent decoder, channel -> SI; None where it is void or silent.
EXPECTED = {
    "RMC": rmc,
    "GGA": lambda m: fix(m, 5, "123459", 20),
    "GLL": lambda m: fix(m, 5, "A", 6),
    "VTG": lambda m: {
        "course_over_ground": number(m.true_track, DEG),
        "speed_over_ground": number(m.spd_over_grnd_kts, KN),
    },
    "HDT": lambda m: {"heading": number(m.heading, DEG)},
    "HDG": hdg,
    "ROT": lambda m: {"yaw_rate": number(m.rate_of_turn, DEG / 60)} if m.status == "A" else None,
    "RSA": lambda m: {"rudder_angle": number(m.rsa_starboard, DEG)} if m.rsa_starboard_status == "A" else None,
    "VHW": lambda m: {"speed_through_water": number(m.water_speed_knots, KN)},
    "VBW": vbw,
    # a logger wrote sentences into each other whose checksum holds all the same
    "VLW": lambda m: {"distance_through_water": number(m.data[0], 1852.0)} if "$" not in "".join(m.data) else None,
    "MWD": lambda m: {
        "true_wind_direction": number(m.direction_true, DEG),
        "true_wind_speed": number(m.wind_speed_knots, KN),
    },
    "MWV": mwv,
    "RPM": rpm,
    "DPT": lambda m: {"water_depth": number(m.depth)},
    "DBT": lambda m: {"water_depth": number(m.depth_meters)},
}


def agree(data):
    """Compare every sentence of a log; return how many values were compared."""
    pynmea2 = pytest.importorskip("pynmea2")
    decoded = decode(data)
    raw = decoded.raw.text().to_list()
    compared = 0
    for record, line in enumerate(raw):
        if decoded.reason[record] == CODE[Reason.CHECKSUM]:
            continue
        try:
            message = pynmea2.parse(line[line.index("$") :], check=True)
        except (pynmea2.ParseError, ValueError):
            continue
        if not isinstance(message, pynmea2.TalkerSentence):
            continue
        said = EXPECTED.get(message.sentence_type, lambda _: None)(message)
        if said is None:
            continue
        for channel, value in said.items():
            values = decoded.channels.get(channel)
            found = None if values is None or not values.present[record] else float(values.value[record])
            assert (found is None) == (value is None), (line, channel)
            if value is not None:
                assert found == pytest.approx(value, rel=1e-12, abs=1e-14), (line, channel)
                compared += 1
    return compared


@pytest.mark.parametrize(
    "name",
    [
        "rtk_usv_202412051751.txt",
        "rtk_usv_202412071206_dropouts.txt",
        "hakefjord.txt",
        "opencpn_stupan.log",
        "gofree_merrimac.log",
    ],
)
def test_real_logs_against_the_independent_decoder(name):
    path = SHARED / "data" / "nmea" / name
    if not path.is_file():
        pytest.skip(f"no {name} in ../shared/data/nmea")
    assert agree(path.read_bytes()) > 100


digits = st.integers(0, 4)
talker = st.sampled_from(["GP", "GN", "II", "HE", "AG", "VD", "SD", "WI", "ER"])


def decimal(low, high):
    return st.tuples(st.floats(low, high), digits).map(lambda p: f"{p[0]:.{p[1]}f}")


def maybe(text):
    return st.one_of(text, text, text, st.just(""))


angle = decimal(0, 359)
latitude = st.tuples(st.integers(0, 89), st.floats(0, 59.9)).map(lambda p: f"{p[0]:02d}{p[1]:08.5f},N")
longitude = st.tuples(st.integers(0, 179), st.floats(0, 59.9)).map(lambda p: f"{p[0]:03d}{p[1]:08.5f},W")
clock = st.tuples(st.integers(0, 23), st.integers(0, 59), decimal(10, 59)).map(lambda p: f"{p[0]:02d}{p[1]:02d}{p[2]}")
status = st.sampled_from("AAAV")


def body(*parts):
    return st.tuples(*(part if not isinstance(part, str) else st.just(part) for part in parts)).map(",".join)


def of(letters, *parts):
    return st.tuples(talker, body(letters, *parts)).map("".join)


generated = st.one_of(
    of("RMC", clock, status, latitude, longitude, maybe(decimal(0, 40)), maybe(angle), "030525", "", "", "A"),
    of("GGA", clock, latitude, longitude, st.sampled_from("012345678"), "08", "1.0", "1.0", "M", "", "M", "", ""),
    of("GLL", latitude, longitude, clock, status, st.sampled_from("ADENS")),
    of("VTG", maybe(angle), "T", "", "M", decimal(0, 40), "N", "", "K", "A"),
    of("HDT", angle, "T"),
    of("HDG", decimal(0, 359), maybe(decimal(0, 9)), "W", decimal(0, 20), st.sampled_from("EW")),
    of("ROT", decimal(-300, 300), status),
    of("RSA", decimal(-40, 40), status, "", ""),
    of("VHW", "", "T", "", "M", decimal(0, 40), "N", "", "K"),
    of("VBW", decimal(-5, 40), decimal(-3, 3), status, "", "", "V"),
    of("VLW", decimal(0, 9000), "N", decimal(0, 90), "N"),
    of("MWD", maybe(angle), "T", "", "M", decimal(0, 60), "N", "", "M"),
    of("MWV", angle, st.sampled_from("RT"), decimal(0, 60), st.sampled_from("MNK"), status),
    of("RPM", st.sampled_from("SE"), st.sampled_from("012"), decimal(-200, 200), "", status),
    of("DPT", decimal(0, 900), "0.0"),
    of("DBT", "", "f", decimal(0, 900), "M", "", "F"),
    of("XDR", "A", decimal(-40, 40), "D", "ROLL"),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(generated, min_size=1, max_size=12))
def test_generated_sentences_against_the_independent_decoder(bodies):
    agree("".join(f"2025-05-03T07:47:01.147Z {sentence(b)}\r\n" for b in bodies).encode())


def read(*bodies):
    lines = "".join(f"2025-05-03T07:47:{k // 10:02d}.{k % 10}00Z {sentence(b)}\r\n" for k, b in enumerate(bodies))
    return Screen("nmea").part(decode(lines.encode()))


def column(readings, name):
    return readings.frame[name].to_list()


def test_a_magnetic_heading_is_made_true_by_the_variation_in_the_log():
    fix = "GPRMC,074701.15,A,5954.0003,N,02435.9999,E,17.64,13.43,030525,3.4,W,A"
    readings = read(fix, "HCHDM,10.0,M", "HCHDG,1.0,1.0,E,,")
    assert np.degrees(column(readings, "heading_rad")[1:]) == pytest.approx([6.6, 358.6])
    assert any("HDM were made true by the variation that GPRMC sends: -3.4 deg" in note for note in readings.notes)


def test_the_compass_own_variation_comes_before_that_of_the_receiver():
    fix = "GPRMC,074701.15,A,5954.0003,N,02435.9999,E,17.64,13.43,030525,3.4,W,A"
    readings = read(fix, "HCHDM,10.0,M", "HCHDG,1.0,,,2.0,E", "HCHDM,10.0,M")
    assert np.degrees(column(readings, "heading_rad")[1:]) == pytest.approx([12.0, 3.0, 12.0])


@pytest.mark.parametrize("degrees", ["180.1", "1e308"])
def test_a_variation_of_more_than_half_a_turn_is_none(degrees):
    fix = "GPRMC,07470{}.00,A,5954.0003,N,02435.9999,E,17.64,13.43,030525,{},W,A"
    readings = read(
        fix.format(1, "3.4"), fix.format(2, degrees), "HCHDM,10.0,M", f"HCHDG,1.0,,,{degrees},E", "HCHDM,1e308,M"
    )
    assert np.degrees(column(readings, "heading_rad")[2:]) == pytest.approx([6.6])
    assert readings.tally.by_reason == {"not_a_number": 1, "out_of_range": 1}
    assert any("sends: -3.4 deg" in note for note in readings.notes)


def test_two_rudders_that_turn_together_are_their_mean():
    angles = [(-10.0, -11.0), (0.0, 0.5), (10.0, 11.0)]
    readings = read(
        *(f"AGRSA,{s},A,{p},A" for s, p in angles), "AGRSA,5.0,A,6.0,V", "AGRSA,5.0,V,6.0,A", "AGRSA,5.0,V,6.0,V"
    )
    assert np.degrees(column(readings, "rudder_angle_rad")) == pytest.approx([-10.5, 0.25, 10.5, 5.0, 6.0])
    assert "the mean of both rudders, which differ by 0.87 deg rms" in readings.notes[0]
    assert readings.tally.by_reason == {"void": 1}


@pytest.mark.parametrize("port", ["0.0", "-3.0", "", "x"])
def test_a_port_field_that_does_not_follow_is_no_second_rudder(port):
    readings = read(*(f"AGRSA,{s},A,{port},A" for s in (-10.0, 0.0, 10.0)))
    assert np.degrees(column(readings, "rudder_angle_rad")) == pytest.approx([-10.0, 0.0, 10.0])


def test_a_port_rudder_alone_is_the_rudder():
    readings = read("AGRSA,,V,3.0,A", "AGRSA,,V,4.0,A")
    assert np.degrees(column(readings, "rudder_angle_rad")) == pytest.approx([3.0, 4.0])


@pytest.mark.parametrize(
    ("body", "name", "value"),
    [
        ("GPVTG,1.0,T,,M,,N,36.0,K,A", "speed_over_ground_m_s", 10.0),
        ("VDVHW,,T,,M,,N,36.0,K", "speed_through_water_m_s", 10.0),
        ("SDDBT,100.0,f,,M,,F", "water_depth_m", 30.48),
        ("SDDBT,,f,,M,10.0,F", "water_depth_m", 18.288),
        ("HETHS,90.0,A", "heading_rad", math.pi / 2),
        ("WIMWD,,T,240.3,M,,N,1.2,M", "true_wind_speed_m_s", 1.2),
        ("VDVLW,10.0,N,2.5,N", "distance_through_water_m", 18520.0),
    ],
)
def test_an_empty_field_is_read_from_its_neighbour_in_another_unit(body, name, value):
    assert column(read(body), name) == pytest.approx([value], rel=1e-12)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("GPRMC,074701.15,A,5954.0,N,02436.0,E,1.0,2.0,030525,,,N", "void"),
        ("GPRMC,074701.15,A,5954.0,N,02436.0,E,1.0,2.0,030525,,,E", "void"),
        ("GPGGA,074701.15,5954.0,N,02436.0,E,6,08,1.0,1,M,,M,,", "void"),
        ("GPGLL,5954.0,N,02436.0,E,074701.15,A,S", "void"),
        ("GPVTG,1.0,T,,M,5.0,N,,K,N", "void"),
        ("WIMWV,23.3,T,13.1,M,A", "no_channel"),
    ],
)
def test_what_an_instrument_does_not_measure_is_refused(body, reason):
    readings = read("SDDPT,53.7,0.0", body)
    assert readings.tally.by_reason == {reason: 1}


def test_what_is_left_aside_is_counted():
    ais = "!AIVDM,1,1,,A,13u=hGP3CWPlvs2Q8sHW:5fD0h6a,0*7A"
    line = f"2025-05-03T07:47:01.147Z {ais[:-2]}{reduce(xor, ais[1:-3].encode(), 0):02X}\r\n"
    good = (
        f"2025-05-03T07:47:01.147Z {sentence('PGRMC,A,,,')}\r\n2025-05-03T07:47:01.147Z {sentence('HEHDT,1.0,T')}\r\n"
    )
    notes = Screen("nmea").part(decode((line * 2 + good).encode())).notes
    assert notes == ("Sentences without a channel: AIVDM, PGRMC; of them 1 proprietary, 2 AIS or encapsulated.",)


MAGNETIC = ("HCHDG,10.0,1.0,W,,", "HCHDM,20.0,M", "HCHDG,30.0,,,,")


def test_magnetic_headings_take_the_variation_of_the_profile_where_no_sentence_gives_it():
    log = "".join(f"2025-05-03T07:47:0{k}.000Z {sentence(body)}\n" for k, body in enumerate(MAGNETIC)).encode()
    readings = read_log("a.nmea", log, parse({"variation_deg": -14.5}, "p"))
    assert np.degrees(column(readings, "heading_rad")) == pytest.approx([354.5, 5.5, 15.5])
    assert sum("by the profile's variation of -14.5 deg" in note for note in readings.notes) == 2
    # what the log says comes first
    own = log + f"2025-05-03T07:47:05.000Z {sentence('HCHDG,40.0,,,3.0,E')}\n".encode()
    readings = read_log("a.nmea", own, parse({"variation_deg": -14.5}, "p"))
    assert np.degrees(column(readings, "heading_rad")) == pytest.approx([12.0, 23.0, 33.0, 43.0])
    assert not any("profile's variation" in note for note in readings.notes)


def test_magnetic_headings_without_any_variation_are_counted_with_what_to_write():
    fix = "GPRMC,074701.15,A,5954.0003,N,02435.9999,E,17.64,13.43,030525,,,A"
    readings = read(fix, *MAGNETIC)
    assert readings.tally.by_reason == {"no_channel": 3}
    notes = " ".join(readings.notes)
    assert "2 magnetic headings of HDG" in notes and "1 magnetic headings of HDM" in notes
    assert "variation_deg: 7.5" in notes
