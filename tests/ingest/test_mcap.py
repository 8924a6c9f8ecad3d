"""MCAP: whole, without an index, cut, rotten, and with messages that are not what they should be."""

import io
import json
import math

import pytest
from mcap.writer import CompressionType, IndexType, Writer

from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

START = 1_755_497_274_000_000_000
CHANNELS = {
    "/gyro.heading": {"channel": "heading", "unit": "deg"},
    "/nav.pose.speed": {"channel": "speed_over_ground", "unit": "m/s"},
    "/nav.pose.cog": {"channel": "course_over_ground", "unit": "deg"},
}


def profile(channels=None, **source):
    return VesselProfile.model_validate({"sources": [{"match": "*.mcap", "channels": channels or CHANNELS, **source}]})


def write(messages, encoding="json", **options):
    """Write (topic, seconds, payload); a payload of bytes is written as it is."""
    out = io.BytesIO()
    writer = Writer(out, **{"chunk_size": 400, **options})
    writer.start()
    schema = writer.register_schema("any", "jsonschema", b"{}")
    ids = {}
    for topic, seconds, payload in messages:
        if topic not in ids:
            ids[topic] = writer.register_channel(topic, encoding, schema)
        data = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        at = START + round(seconds * 1e9)
        writer.add_message(ids[topic], at, data, at + 7)
    writer.finish()
    return out.getvalue()


def plain(n=60):
    messages = []
    for k in range(n):
        messages.append(("/gyro", k / 10, {"heading": k / 4}))
        messages.append(("/nav", k / 10 + 0.01, {"pose": {"speed": 5.0 + k / 100, "cog": k}, "x": [1, 2]}))
    return messages


def read(data, given=None):
    readings = read_log("log.mcap", data, given or profile())
    tally = readings.tally
    assert readings.format == "mcap"
    assert tally.records_read == tally.records_kept + tally.records_rejected
    assert tally.values_read == tally.values_kept + tally.values_rejected
    return readings


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize(
    "options", [{}, {"use_chunking": False}, {"index_types": IndexType.NONE}, {"enable_crcs": False}]
)
def test_every_way_of_writing_gives_the_same_readings(compression, options):
    readings = read(write(plain(), compression=compression, **options))
    assert readings.tally.records_read == readings.tally.records_kept == 120
    row = readings.frame.row(3, named=True)
    assert (row["source"], row["time_utc_ns"]) == ("/nav", START + 110_000_000)
    assert (row["speed_over_ground_m_s"], row["course_over_ground_rad"]) == (5.01, math.radians(1))
    assert readings.frame["record"].to_list() == list(range(120))


def test_publish_time_on_request():
    given = profile(time={"column": "publish_time"})
    assert read(write(plain(1)), given).frame["time_utc_ns"].to_list() == [START + 7, START + 10_000_007]
    with pytest.raises(UsageError, match="'utc'"):
        read(write(plain(1)), profile(time={"column": "utc"}))


def test_times_coarser_than_the_messages_are_named_with_where_finer_ones_may_be():
    # too few seconds to tell a recorder that writes whole ones from messages that belong to one instant
    readings = read(write([(topic, float(int(seconds)), payload) for topic, seconds, payload in plain(30)]))
    refused = readings.tally.by_reason["same_instant"]
    assert refused > 50 and readings.notes[0].startswith(
        f"{refused} of {readings.tally.records_read} records, most of the log, are refused as same_instant"
    )
    assert "`publish_time`" in readings.notes[0]
    assert read(write(plain())).notes == ()


def test_broken_and_odd_messages_cost_only_themselves():
    payloads = [
        {"heading": 1.0},
        b'{"heading": 2.0',
        b"",
        b"[1]",
        {"heading": None},
        {"other": 1},
        b'{"heading": NaN}',
        {"heading": "north"},
        {"heading": True},
        {"heading": "4.5"},
        b'{\n  "heading":\r\n 5\n}',
        {"heading": [1]},
        b'{"heading": 6}{"heading": 7}',
        b"\xff\xfe",
    ]
    messages = [("/gyro", k, p) for k, p in enumerate(payloads)] + plain(1)[1:]
    readings = read(write(messages))
    assert readings.frame["heading_rad"].drop_nulls().to_list() == [math.radians(v) for v in (1.0, 4.5, 5.0)]
    assert readings.rejected.select("record", "reason").rows() == [
        (1, "malformed"),
        (2, "malformed"),
        (3, "malformed"),
        (4, "void"),
        (5, "void"),
        (6, "not_a_number"),
        (7, "not_a_number"),
        (8, "not_a_number"),
        (11, "not_a_number"),
        (12, "malformed"),
        (13, "malformed"),
    ]
    assert readings.rejected["raw"][0] == '{"heading": 2.0'


def test_topics_and_encodings_without_a_channel():
    readings = read(write([*plain(2), ("/camera", 1, {"a": 1}), ("/camera", 2, {"a": 2})]))
    assert readings.tally.by_reason == {"no_channel": 2}
    assert readings.rejected["source"].to_list() == ["/camera", "/camera"]
    assert readings.notes == ("Topics without a channel: /camera.",)
    with pytest.raises(DataRejected, match="4 no_channel"):
        read(write(plain(2), encoding="cdr"))


def test_topics_that_are_missing_are_named_with_those_that_are_there():
    with pytest.raises(DataRejected, match=r"/nav\.pose\.speed, /nav\.pose\.cog; it has /gyro\.") as error:
        read(write([("/gyro", 1, {"heading": 1})]))
    assert error.value.code == "topics_missing"


def test_without_a_source_the_error_names_the_topics():
    with pytest.raises(UsageError, match="/gyro, /nav"):
        read_log("log.mcap", write(plain(1)), VesselProfile())


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_cut_file_keeps_its_whole_chunks(share):
    data = write(plain())
    readings = read(data[: int(len(data) * share)])
    assert 0 < readings.tally.records_kept < 120
    assert "cut short or damaged" in readings.notes[0]
    assert readings.partial and readings.lost[-1].since_ns == readings.frame["time_utc_ns"].max()
    assert readings.frame["record"].to_list() == list(range(readings.frame.height))


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_rotten_chunk_is_lost_with_its_count_and_time(compression):
    data = bytearray(write(plain(), compression=compression))
    place = _chunk_places(bytes(data))[2]
    data[place + 120] ^= 0x55
    readings = read(bytes(data))
    lost = readings.tally.by_reason["malformed"]
    assert lost > 0
    assert readings.tally.records_read == 120
    assert readings.tally.records_kept == 120 - lost
    assert f"{lost} messages by its index, log times" in readings.notes[0]
    assert readings.rejected["time_utc_ns"].null_count() == 0


def test_a_damaged_record_length_is_bridged_by_the_summary():
    data = bytearray(write(plain()))
    place = _chunk_places(bytes(data))[1]
    data[place + 1 : place + 9] = b"\xff" * 8
    readings = read(bytes(data))
    assert readings.tally.records_kept == 120
    assert "damaged at byte" in readings.notes[0]
    assert not readings.partial


def test_a_file_that_lost_only_its_summary_is_whole():
    data = write(plain())
    readings = read(data[: int(len(data) * 0.95)])
    assert readings.tally.records_kept == 120
    assert not readings.partial
    assert readings.notes == ("The end of the file is missing; its data section is whole.",)


def _chunk_places(data):
    at, places = 8, []
    while at + 9 < len(data) - 8:
        if data[at] == 6:
            places.append(at)
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    return places


def test_a_mapped_field_that_never_comes_is_reported():
    readings = read(write([("/gyro", 1, {"heading": 1}), ("/nav", 1, {"pose": {"speed": 3}})]))
    assert readings.notes == ("No message of /nav has the field pose.cog.",)


def test_messages_of_one_topic_at_one_time():
    messages = [("/gyro", 1, {"heading": 1}), ("/gyro", 1, {"heading": 1}), ("/gyro", 1, {"heading": 2}), *plain(1)[1:]]
    assert read(write(messages)).tally.by_reason == {"duplicate": 1, "same_instant": 1}
