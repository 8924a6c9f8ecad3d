"""The bytes of the loggers: readable by plain means, the same for a seed, shaped like the shared trials."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS, Instrument
from kempf.pipeline.simulate.logger_fields import LOGGER_FIELDS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import SteadyCourse
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.nmea_log import damage, to_nmea
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.schemas.errors import UsageError

SHARED = Path(__file__).parents[2].parent / "shared" / "trials"
WRITERS = (to_nmea, to_csv, to_mcap)


@pytest.fixture(scope="module")
def trial() -> Trial:
    return simulate_trial(zigzag_settings("ferry", duration_s=400.0, steady_s=60.0, seed=3))


def whole(line: bytes) -> bool:
    """Return whether a stamped sentence has a right checksum, by the plainest means."""
    _, _, sentence = line.partition(b" ")
    body, star, digits = sentence[1:].partition(b"*")
    if not sentence.startswith(b"$") or not star or len(digits) != 2:
        return False
    total = 0
    for byte in body:
        total ^= byte
    return digits == b"%02X" % total


@pytest.mark.parametrize("write", WRITERS)
def test_a_seed_gives_the_same_bytes_and_another_seed_others(write: object, trial: Trial) -> None:
    assert callable(write)
    again = simulate_trial(trial.settings)
    other = simulate_trial(replace(trial.settings, seed=4))
    assert write(trial) == write(again)
    assert write(trial) != write(other)


@pytest.mark.parametrize("write", [to_nmea, to_csv])
def test_gzip_holds_no_time_and_no_name(write: object, trial: Trial) -> None:
    assert callable(write)
    assert write(trial)[3:8] == bytes(5)


def test_every_undamaged_sentence_has_its_checksum(trial: Trial) -> None:
    lines = gzip.decompress(to_nmea(trial, damaged_share=0.0)).split(b"\r\n")
    assert lines.pop() == b""
    assert all(whole(line) for line in lines)
    expected = sum(r.measured_utc_ns.size * (2 if r.instrument.name == "gnss" else 1) for r in trial.instruments)
    assert len(lines) == expected
    assert all(a[:24] <= b[:24] for a, b in pairwise(lines)), "sorted by arrival"


def test_damaged_lines_fail_their_checksum(trial: Trial) -> None:
    good = gzip.decompress(to_nmea(trial, damaged_share=0.0)).split(b"\r\n")
    bad = gzip.decompress(to_nmea(trial, damaged_share=0.05)).split(b"\r\n")
    assert len(good) == len(bad)
    changed = [b for a, b in zip(good, bad, strict=True) if a != b]
    assert 0.03 < len(changed) / len(good) < 0.07
    assert not any(whole(line) for line in changed)
    assert {line[:20] for line in changed} <= {line[:20] for line in good}, "the stamp is the logger's own and survives"
    random = np.random.default_rng(0)
    line = b"2025-05-03T07:47:01.148Z $HEHDT,11.37,T*2B"
    assert not any(whole(damage(line, random)) for _ in range(2000))


def test_sentences_carry_what_was_measured(trial: Trial) -> None:
    lines = gzip.decompress(to_nmea(trial, damaged_share=0.0)).decode("ascii").split("\r\n")[:-1]
    gnss = trial.record("gnss")
    rmc = [line.split(" ", 1)[1].split("*")[0].split(",") for line in lines if "$GPRMC" in line]
    assert len(rmc) == gnss.measured_utc_ns.size
    for k in (0, 17, len(rmc) - 1):
        fields = rmc[k]
        clock, day = fields[1], fields[9]
        stamp = np.datetime64(f"20{day[4:]}-{day[2:4]}-{day[:2]}T{clock[:2]}:{clock[2:4]}:{clock[4:]}", "ms")
        assert int(stamp.astype("datetime64[ns]").astype(np.int64)) == gnss.measured_utc_ns[k]
        latitude = int(fields[3][:2]) + float(fields[3][2:]) / 60.0
        longitude = int(fields[5][:3]) + float(fields[5][3:]) / 60.0
        assert latitude == pytest.approx(np.rad2deg(gnss.values["latitude_rad"][k]), abs=2e-7)
        assert longitude == pytest.approx(np.rad2deg(gnss.values["longitude_rad"][k]), abs=2e-7)
        assert float(fields[7]) * 1852 / 3600 == pytest.approx(gnss.values["speed_over_ground_m_s"][k], abs=0.003)
        assert float(fields[8]) == pytest.approx(np.rad2deg(gnss.values["course_over_ground_rad"][k]), abs=0.0051)
    rates = [float(line.split(",")[1]) for line in lines if "$TIROT" in line]
    expected = np.rad2deg(trial.record("yaw_rate").values["yaw_rate_rad_s"]) * 60.0
    np.testing.assert_allclose(rates, expected, atol=0.0501)


def test_south_and_west_are_written_with_their_letters(trial: Trial) -> None:
    far = simulate_trial(replace(trial.settings, latitude_deg=-33.0, longitude_deg=-70.9999999))
    line = next(x for x in gzip.decompress(to_nmea(far, 0.0)).split(b"\r\n") if b"$GPRMC" in x)
    fields = line.split(b",")
    assert fields[4] == b"S" and fields[6] == b"W"
    assert float(fields[3][2:]) < 60.0 and float(fields[5][3:]) < 60.0


def test_delimited_rows_hold_the_last_value_that_had_arrived(trial: Trial) -> None:
    lines = gzip.decompress(to_csv(trial)).decode("ascii").split("\n")
    names = lines[0].split(",")
    record = trial.record("heading")
    arrival, values = record.arrival_utc_ns.tolist(), record.values["heading_rad"].tolist()
    for line in (lines[1], lines[777], lines[-2]):
        cells = dict(zip(names, line.split(","), strict=True))
        now = int(np.datetime64(cells["utc"].rstrip("Z"), "ns").astype(np.int64))
        heard = [v for t, v in zip(arrival, values, strict=True) if t <= now][-1]
        assert float(cells["heading"]) == pytest.approx(np.rad2deg(heard), abs=1e-5)
    stamps = np.array([line[:23] for line in lines[1:-1]], dtype="datetime64[ms]")
    assert np.all(np.diff(stamps).astype(int) == 100)


def test_mcap_messages_are_what_was_measured(trial: Trial) -> None:
    reader = make_reader(BytesIO(to_mcap(trial, chunk_bytes=20_000)), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    assert all(c.compression == "zstd" for c in summary.chunk_indexes) and len(summary.chunk_indexes) > 3
    rows: dict[str, list[tuple[int, dict[str, float]]]] = {}
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        assert schema is not None and set(json.loads(schema.data)["properties"]) == set(json.loads(message.data))
        rows.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    for field in LOGGER_FIELDS:
        if field.instrument == "rudder_order":
            assert field.topic not in rows
            continue
        record = trial.record(field.instrument)
        np.testing.assert_array_equal([t for t, _ in rows[field.topic]], record.arrival_utc_ns)
        written = [m[field.name] for _, m in rows[field.topic]]
        np.testing.assert_array_equal(written, field.written(record.values[field.column]))


def test_the_logs_look_like_the_shared_trials(trial: Trial) -> None:
    if not SHARED.is_dir():
        pytest.skip(f"the shared trials are not at {SHARED}")
    with gzip.open(sorted(SHARED.glob("*/*.csv.gz"))[0], "rt") as file:
        assert gzip.decompress(to_csv(trial)).decode().split("\n")[0] == file.readline().strip()
    with sorted(SHARED.glob("*/*.mcap"))[0].open("rb") as log:
        theirs = make_reader(log).get_summary()
    ours = make_reader(BytesIO(to_mcap(trial))).get_summary()
    assert theirs is not None and ours is not None
    assert [c.topic for c in ours.channels.values()] == [c.topic for c in theirs.channels.values()]
    for a, b in zip(ours.schemas.values(), theirs.schemas.values(), strict=True):
        assert (a.name, a.encoding, json.loads(a.data)) == (b.name, b.encoding, json.loads(b.data))
    with gzip.open(sorted(SHARED.glob("*/*.nmea.gz"))[0], "rb") as file:
        kinds = {line[25:31] for line in (file.readline() for _ in range(200)) if whole(line.rstrip())}
    own = {line[25:31] for line in gzip.decompress(to_nmea(trial, 0.0)).split(b"\r\n")[:-1]}
    assert own == kinds


def test_few_instruments_make_small_logs() -> None:
    settings = replace(
        zigzag_settings("usv", duration_s=30.0, steady_s=5.0), instruments=(Instrument("rudder_order", 2.0),)
    )
    trial = simulate_trial(settings)
    assert gzip.decompress(to_nmea(trial)) == b""
    assert gzip.decompress(to_csv(trial)).startswith(b"utc,rudder_order\n")
    assert b"/steering/order" in to_mcap(trial)
    nothing = simulate_trial(replace(settings, instruments=()))
    with pytest.raises(UsageError, match="no instrument"):
        to_csv(nothing)
    late = replace(settings, programme=(SteadyCourse(1.0),), instruments=(Instrument("log", 1.0, 5.0),))
    with pytest.raises(UsageError, match="never spoke"):
        to_csv(simulate_trial(late))


def test_the_profile_maps_every_column_and_topic(trial: Trial) -> None:
    profile = logger_profile(trial.settings)
    names = gzip.decompress(to_csv(trial)).decode().split("\n")[0].split(",")[1:]
    table = profile.source_for("a.csv.gz")
    topics = profile.source_for("a.mcap")
    assert table is not None and topics is not None
    assert list(table.channels) == names
    assert topics.channels["/gyro/rate_of_turn.rot"].unit == "deg/min"
    assert profile.wind_arm_per_m == trial.truth.wind_arm_per_m
    assert len(DEFAULT_INSTRUMENTS) == len(trial.instruments)
