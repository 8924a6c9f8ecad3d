"""Every variant of the format's conformance suite gives the messages that the format's library reads, or a refusal."""

import io
import json
import struct

import pytest
from mcap.stream_reader import StreamReader

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container.stream import McapStream
from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile
from tests.ingest.mcap_variants import CONTENTS, channel, message, variants, write
from tests.reading import read_log

START = 1_755_497_274_000_000_000
PROFILE = VesselProfile.model_validate(
    {"sources": [{"match": "*", "channels": {"example.heading": {"channel": "heading", "unit": "deg"}}}]}
)
#: CRCs of data section and summary that the expectations state, tests/conformance/data of the format's repository.
STATED = {
    "TenMessages-ch-chx-mx-pad-rch-rsh-st-sum": (3282868494, 829723996),
    "TenMessages-ch-chx-mx-rch-rsh-st-sum": (2749581515, 2261599816),
    "OneMetadata-mdx-pad-st-sum": (None, 1149090039),
    "OneAttachment-ax-sum": (None, 4117354065),
}


def by_library(data):
    """Channel, times and payload of every message, and topics, by the format's own reader."""
    records = list(StreamReader(io.BytesIO(data), validate_crcs=True).records)
    messages = [r for r in records if type(r).__name__ == "Message"]
    topics = {r.id: r.topic for r in records if type(r).__name__ == "Channel"}
    return [(m.channel_id, m.log_time, m.publish_time, m.data) for m in messages], topics


def by_us(data):
    stream = McapStream("a.mcap", LogFile(data))
    found = []
    for batch in stream.batches():
        rows = zip(batch.channel, batch.log_time, batch.publish_time, batch.first, batch.end, strict=True)
        found += [(c, t, p, batch.content[a:b].tobytes()) for c, t, p, a, b in rows]
        again = [piece.read(stream._log).tobytes() for piece in batch.pieces]
        assert b"".join(again) == batch.content.tobytes()
    assert not stream.partial and not stream.notes
    return found, {number: one.topic for number, one in stream.channels.items()}


def test_what_is_written_here_is_what_the_suite_has():
    written = {name: write(records, features) for name, records, features in variants()}
    for name, (data_crc, summary_crc) in STATED.items():
        data = written[name]
        assert struct.unpack_from("<I", data, len(data) - 12)[0] == summary_crc
        (start,) = struct.unpack_from("<Q", data, len(data) - 28)
        if data_crc is not None:
            assert data_crc in (struct.unpack_from("<I", data, start - pad - 4)[0] for pad in (0, 3))


@pytest.mark.parametrize("base", CONTENTS)
def test_every_variant_gives_the_messages_that_the_library_reads(base):
    count = 0
    for name, records, features in variants():
        if name.split("-")[0] == base:
            data = write(records, features)
            assert by_us(data) == by_library(data), name
            count += 1
    assert count >= 6


@pytest.mark.parametrize("base", CONTENTS)
def test_every_variant_is_refused_with_the_reason_for_what_its_messages_are(base):
    for name, records, features in variants():
        if name.split("-")[0] == base and len(features) % 3 == 0:
            with pytest.raises(KempfError) as refused:
                read_log("a.mcap", write(records, features), PROFILE)
            if "Message" in base:
                assert refused.value.code == "no_valid_reading"
                assert "Topic example is encoded as a; JSON, CDR and protobuf are read." in refused.value.message
            else:
                assert refused.value.code == "topics_missing"


def test_every_variant_with_messages_that_say_something_is_read():
    records = [channel(schema_id=0, encoding=b"json")]
    records += [message(START + k, START, k, json.dumps({"heading": k}).encode()) for k in range(5)]
    read = 0
    for name, like, features in variants():
        if name.startswith("OneSchemalessMessage") and like:
            readings = read_log("a.mcap", write(records, features), PROFILE)
            assert readings.tally.records_kept == readings.tally.records_read == 5
            assert not readings.partial
            read += 1
    assert read >= 74
