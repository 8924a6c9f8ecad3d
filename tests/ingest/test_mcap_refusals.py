"""What is said of MCAP logs, and of what is handed over for one, of which nothing can be read, and what to do."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from mcap.writer import Writer

from kempf.flows.jobs.ingest.draft_profile import draft
from kempf.flows.jobs.ingest.files import logs_in
from kempf.schemas.errors import DataRejected, NotFound, UsageError
from kempf.schemas.profile import VesselProfile
from tests.ingest.test_mcap import START, plain, profile, read, write
from tests.ingest.test_mcap_draft import ros
from tests.reading import read_log

HDT = "$HEHDT,20.00,T*2D"
NOBODY = VesselProfile()


def encoded(encoding: str, schema_encoding: str, definition: bytes = b"x") -> bytes:
    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    schema = writer.register_schema("yard_msgs/msg/Heading", schema_encoding, definition)
    channel = writer.register_channel("/gyro", encoding, schema)
    for k in range(3):
        writer.add_message(channel, START + k, json.dumps({"heading": k}).encode(), START + k)
    writer.finish()
    return out.getvalue()


GYRO = profile({"/gyro.heading": {"channel": "heading", "unit": "deg"}})


@pytest.mark.parametrize(
    ("data", "why", "step"),
    [
        (encoded("ros1", "ros1msg"), "is encoded as ros1", "rosbags-convert"),
        (encoded("cdr", "ros2idl"), "is encoded as cdr with a schema in ros2idl", "messages that .msg files define"),
        (
            encoded("cdr", "ros2msg", b" \n"),
            "the definition of its messages, yard_msgs/msg/Heading, is empty",
            "sourced",
        ),
        (encoded("cdr", "", b""), "is encoded as cdr with no schema", "sourced"),
        (encoded("cbor", ""), "is encoded as cbor", "Let the logger write these topics in JSON"),
    ],
)
def test_an_encoding_that_is_not_read_is_named_with_what_to_do(
    data: bytes, why: str, step: str, tmp_path: Path
) -> None:
    with pytest.raises(DataRejected) as refused:
        read_log("log.mcap", data, GYRO)
    assert refused.value.code == "no_valid_reading"
    assert f"Topic /gyro {why}" in refused.value.message.replace("is encoded as cdr, and the", "the")
    assert step in refused.value.next_step
    (tmp_path / "log.mcap").write_bytes(data)
    with pytest.raises(UsageError) as undrafted:
        draft(tmp_path / "log.mcap")
    assert undrafted.value.code == "no_draft" and step in undrafted.value.next_step


def test_beside_topics_that_can_be_read_a_note_is_enough() -> None:
    given = profile(
        {"/gyro.heading": {"channel": "heading", "unit": "deg"}, "/aft.x": {"channel": "roll", "unit": "deg"}}
    )
    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    for topic, encoding in (("/gyro", "json"), ("/aft", "cbor")):
        writer.add_message(writer.register_channel(topic, encoding, 0), START, b'{"heading": 1}', START)
    writer.finish()
    readings = read(out.getvalue(), given)
    assert readings.tally.records_kept == 1
    assert readings.notes[0] == "Topic /aft is encoded as cbor; JSON, CDR and protobuf are read."


@pytest.mark.parametrize(
    "data",
    [
        ros("/nmea", "std_msgs/msg/String", "string data", [{"data": HDT}] * 3),
        write([("/nmea", k, {"sentence": f"{HDT}\r\n"}) for k in range(3)]),
    ],
)
def test_sentences_inside_messages_are_recognised(data: bytes, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match="Topic /nmea holds NMEA 0183 sentences, which are not read inside MCAP"
    ) as said:
        read_log("log.mcap", data, NOBODY)
    assert said.value.code == "no_source_for_log" and "text file, one a line" in said.value.next_step
    (tmp_path / "log.mcap").write_bytes(data)
    with pytest.raises(UsageError, match="no topic holds a number") as undrafted:
        draft(tmp_path / "log.mcap")
    assert "holds NMEA 0183 sentences, which are not read inside MCAP. Write the" in undrafted.value.next_step


def test_sentences_beside_what_the_profile_maps_are_noted() -> None:
    readings = read(write([*plain(3), ("/nmea", 1, {"data": HDT}), ("/text", 1, {"data": "$HEHDT,20.00,T*2E"})]))
    assert next(note for note in readings.notes if "sentences" in note).startswith("Topic /nmea holds NMEA")


def test_a_name_that_no_pattern_fits_is_said_to_be_so() -> None:
    with pytest.raises(UsageError) as refused:
        read_log("log.mcap.zstd", write(plain(2)), profile())
    assert "its name fits no pattern of the profile's sources, which are '*.mcap'" in refused.value.message
    assert "Correct `match`" in refused.value.next_step
    with pytest.raises(UsageError, match="for which the profile maps no topic"):
        read_log("log.mcap", write(plain(2)), NOBODY)


@pytest.mark.parametrize(
    ("data", "kind", "step"),
    [
        (b"#ROSBAG V2.0\n" + bytes(4096), "a bag of ROS 1", "rosbags-convert"),
        (b"SQLite format 3\0" + bytes(4096), "an SQLite database, as a bag of ROS 2 (.db3) is", "mcap convert"),
        (
            b"rosbag2_bagfile_information:\n  version: 5\n",
            "the description of a bag of ROS 2",
            "the .mcap file beside it",
        ),
    ],
)
def test_other_files_of_a_recorder_are_named(data: bytes, kind: str, step: str, tmp_path: Path) -> None:
    with pytest.raises(DataRejected) as refused:
        read_log("log", data, NOBODY)
    assert refused.value.code == "unknown_format" and kind in refused.value.message and step in refused.value.next_step
    (tmp_path / "log").write_bytes(data)
    with pytest.raises(UsageError) as undrafted:
        draft(tmp_path / "log")
    assert undrafted.value.code == "no_draft" and step in undrafted.value.next_step


def test_of_the_folder_of_a_bag_only_its_logs_are_taken(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 5\n", encoding="utf-8")
    with pytest.raises(NotFound) as empty:
        logs_in([bag])
    assert empty.value.code == "empty_folder"
    (bag / "bag_0.mcap").write_bytes(b"")
    assert logs_in([bag]) == ((bag / "bag_0.mcap",), ())
    # another file of that name is a file like any other
    (bag / "metadata.yaml").write_text("t,heading\n", encoding="utf-8")
    assert logs_in([bag])[0] == (bag / "bag_0.mcap", bag / "metadata.yaml")
