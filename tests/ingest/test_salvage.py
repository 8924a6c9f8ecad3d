"""Damaged MCAP files: messages of whole chunks are kept, none of a chunk whose CRC fails, and losses are reported."""

import json
import struct
import time
import zlib

import lz4.frame
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from kempf.pipeline.ingest import unpack
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container import records as mcap_records
from kempf.pipeline.ingest.mcap.container.stream import McapStream
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.profile import VesselProfile
from tests.ingest.mcap_variants import MAGIC, channel, chunk_record, index_records, message, record, text
from tests.ingest.mcap_variants import summary as summary_of
from tests.reading import read_log

START = 1_755_497_274_000_000_000
STEP = 10_000_000
PROFILE = VesselProfile.model_validate(
    {"sources": [{"match": "*", "channels": {"example.heading": {"channel": "heading", "unit": "deg"}}}]}
)
PACK = {b"": bytes, b"zstd": zstandard.ZstdCompressor().compress, b"lz4": lz4.frame.compress}
CHUNKS, EACH = 12, 30
#: The beginning of a file of one channel.
OPENED = MAGIC + record(1, text(b"") + text(b"")) + record(*channel(schema_id=0, encoding=b"json"))
#: The end of a file without a summary and without a CRC.
END = record(15, bytes(4)) + record(2, bytes(20)) + MAGIC


def messages(chunk):
    numbers = range(chunk * EACH, (chunk + 1) * EACH)
    return [message(START + k * STEP, START + k * STEP, k, json.dumps({"heading": k / 8}).encode()) for k in numbers]


def log(
    compression=b"zstd",
    *,
    crc=None,
    index=True,
    closed=True,
    data_crc=True,
    mend=None,
    counted=0,
    unlisted=None,
    statistics=True,
):
    """A log of chunks of which the first holds the channel, and where its chunks begin and end."""
    out, places = MAGIC + record(1, text(b"") + text(b"")), []
    for k in range(CHUNKS):
        records = [channel(schema_id=0, encoding=b"json")] * (k == 0) + messages(k)
        chunk, _, _ = chunk_record(records, compression, PACK[compression], crc)
        places.append((len(out), len(out) + len(chunk)))
        out += chunk
        if index:
            out += b"".join(index_records(records).values())
    if mend is not None:
        out = mend(bytearray(out), places)
    if not closed:
        return bytes(out), places
    out += record(15, struct.pack("<I", zlib.crc32(out) if data_crc else 0))
    index_of_chunks = b"".join(
        record(8, struct.pack("<QQQQ", 0, 0, at, to - at) + text(b"") + struct.pack("<Q", 0) + text(b"") + bytes(16))
        for k, (at, to) in enumerate(places)
        if k != unlisted
    )
    records = [channel(schema_id=0, encoding=b"json"), *(m for k in range(CHUNKS) for m in messages(k))]
    records += messages(CHUNKS)[:counted]
    groups = {8: index_of_chunks, 10: b"", 13: b""}
    return bytes(out) + summary_of(records, {"rch", "st"} if statistics else {"rch"}, len(out), groups, CHUNKS), places


def kept(data):
    readings = read_log("a.mcap", data, PROFILE)
    tally = readings.tally
    assert tally.records_read == tally.records_kept + tally.records_rejected
    numbers = [round(t - START) // STEP for t in readings.frame["time_utc_ns"]]
    return readings, {n // EACH for n in numbers}, numbers


def whole(chunks):
    return [n for chunk in sorted(chunks) for n in range(chunk * EACH, (chunk + 1) * EACH)]


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("index", [True, False])
@pytest.mark.parametrize("crc", [None, 0])
def test_a_whole_file(compression, index, crc):
    readings, _, numbers = kept(log(compression, crc=crc, index=index)[0])
    assert numbers == whole(range(CHUNKS)) and not readings.partial and readings.notes == ()


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("share", [0.2, 0.6, 0.9])
def test_cut_short(compression, share):
    data, places = log(compression)
    cut = int(places[-1][1] * share)
    readings, chunks, numbers = kept(data[:cut])
    assert chunks == {k for k, (_, to) in enumerate(places) if to <= cut}
    assert numbers == whole(chunks)
    assert [(one.since_ns, one.until_ns) for one in readings.lost] == [(START + numbers[-1] * STEP, None)]


def test_without_a_footer_nothing_is_lost_where_the_data_section_is_whole():
    data, _ = log()
    end = len(data) - 37
    for cut in (end, end + 20, len(data) - 8, len(data) - 1):
        readings, _, numbers = kept(data[:cut])
        assert numbers == whole(range(CHUNKS)) and not readings.partial
        assert readings.notes == ("The end of the file is missing; its data section is whole.",)
    readings, _, numbers = kept(log(closed=False)[0])
    assert numbers == whole(range(CHUNKS)) and readings.partial


@pytest.mark.parametrize("rotten", [3, CHUNKS - 1])
def test_messages_of_a_chunk_that_says_it_is_shorter_are_not_taken_for_loose_ones(rotten):
    data, places = log(b"", index=False, closed=False)
    damaged = bytearray(data)
    # its record ends between two of its messages, so that the others seem to stand behind it
    inside = 40 + sum(len(record(*one)) for one in messages(rotten)[:10])
    damaged[places[rotten][0] + 1 : places[rotten][0] + 9] = struct.pack("<Q", inside)
    readings, chunks, numbers = kept(bytes(damaged))
    assert chunks == set(range(CHUNKS)) - {rotten} and numbers == whole(chunks)
    assert readings.partial


@pytest.mark.parametrize("hidden", [1, 7])
@pytest.mark.parametrize("closed", [True, False])
def test_messages_of_a_chunk_that_a_record_before_it_hides_are_not_taken_for_loose_ones(hidden, closed):
    def wrong(out, places):
        # the attachment before it says that it ends between two messages of the chunk
        note = record(9, bytes(50))
        at, to = places[hidden]
        chunk = bytearray(out[at:to])
        inside = len(note) - 9 + 9 + 40 + sum(len(record(*one)) for one in messages(hidden)[:10])
        chunk[-20] ^= 0x10
        out[at:to] = note[:1] + struct.pack("<Q", inside) + note[9:] + bytes(chunk)
        return out

    data, _ = log(b"", index=False, closed=False, mend=wrong)
    readings, chunks, numbers = kept(bytes(data) + (END if closed else b""))
    assert chunks == set(range(CHUNKS)) - {hidden} and numbers == whole(chunks)
    assert readings.partial


def loose():
    return b"".join(record(*one) for one in messages(CHUNKS))


def loose_behind_chunks(**how):
    return log(b"", mend=lambda out, _: bytes(out) + loose(), **how)[0]


@pytest.mark.parametrize("vouched", [True, False])
def test_messages_beside_chunks_are_believed_where_the_crc_of_the_data_is_right(vouched):
    data = loose_behind_chunks(index=False, closed=False)
    readings, _, numbers = kept(data + record(15, struct.pack("<I", zlib.crc32(data) if vouched else 0)) + END[13:])
    assert numbers == whole(range(CHUNKS + vouched))
    assert readings.partial is not vouched


def test_messages_beside_chunks_are_believed_where_the_summary_lists_them():
    readings, _, numbers = kept(loose_behind_chunks(data_crc=False, counted=EACH))
    assert numbers == whole(range(CHUNKS + 1)) and not readings.partial


def test_a_summary_whose_crc_fails_takes_nothing_from_the_crc_of_the_data():
    data = bytearray(loose_behind_chunks(counted=EACH))
    data[-80] ^= 1
    readings, _, numbers = kept(bytes(data))
    assert numbers == whole(range(CHUNKS + 1)) and not readings.partial


def test_a_summary_that_leaves_a_chunk_out_does_not_vouch_for_what_seems_to_stand_outside():
    def short(out, places):
        # the fifth chunk says that it ends between two of its messages, and fails its CRC
        struct.pack_into("<Q", out, places[4][0] + 1, 40 + sum(len(record(*one)) for one in messages(4)[:10]))
        return out

    readings, chunks, numbers = kept(log(b"", index=False, data_crc=False, mend=short, unlisted=4)[0])
    assert chunks == set(range(CHUNKS)) - {4} and numbers == whole(chunks)
    assert readings.partial


def test_damage_behind_the_last_chunk_is_reported_where_nothing_counts_the_messages():
    data = bytearray(loose_behind_chunks(data_crc=False, statistics=False))
    first = data.index(loose()[:40])
    data[first + sum(len(record(*one)) for one in messages(CHUNKS)[:5])] = 0
    readings, _, numbers = kept(bytes(data))
    assert numbers == whole(range(CHUNKS)) and readings.partial


def attachment(data):
    body = bytes(16) + text(b"a.mcap") + text(b"") + struct.pack("<Q", len(data)) + data
    return record(9, body + struct.pack("<I", zlib.crc32(body)))


@pytest.mark.parametrize("end", [b"", END])
@pytest.mark.parametrize("place", ["none", "before", "behind"])
def test_a_file_without_chunks_is_read_whatever_is_attached_to_it(place, end):
    other = attachment(log(b"")[0]) if place != "none" else b""
    data = OPENED + (other if place == "before" else b"") + loose() + (other if place == "behind" else b"")
    readings, _, numbers = kept(data + end)
    assert numbers == whole([CHUNKS]) and readings.partial is not bool(end)


def test_a_record_that_says_too_much_hides_the_first_chunk_from_nobody():
    data, places = log(b"", index=False, closed=False)
    at, to = places[0]
    inside = 9 + 40 + len(record(*channel(schema_id=0, encoding=b"json")))
    inside += sum(len(record(*one)) for one in messages(0)[:10])
    rotten = bytearray(data[at:to])
    rotten[-20] ^= 0x10
    note = record(12, b"")[:1] + struct.pack("<Q", inside)
    head = record(*channel(schema_id=0, encoding=b"json"))
    readings, chunks, numbers = kept(data[:at] + head + note + bytes(rotten) + data[to:])
    assert chunks == set(range(1, CHUNKS)) and numbers == whole(chunks) and readings.partial


@pytest.mark.parametrize("compression", PACK)
@pytest.mark.parametrize("rotten", [0, 5, CHUNKS - 1])
@pytest.mark.parametrize("closed", [True, False])
def test_one_rotten_chunk(compression, rotten, closed):
    data, places = log(compression, closed=closed)
    at, to = places[rotten]
    damaged = bytearray(data)
    damaged[to - 20] ^= 0x10
    if rotten == 0 and not closed:
        # the channel stood in the rotten chunk and nowhere else
        with pytest.raises(DataRejected, match="The chunk at byte"):
            kept(bytes(damaged))
        return
    readings, chunks, numbers = kept(bytes(damaged))
    assert chunks == set(range(CHUNKS)) - {rotten} and numbers == whole(chunks)
    first, last = rotten * EACH, (rotten + 1) * EACH - 1
    assert (readings.lost[0].since_ns, readings.lost[0].until_ns) == (START + first * STEP, START + last * STEP)
    assert readings.lost[0].messages == EACH == readings.tally.by_reason["malformed"]
    assert f"The chunk at byte {at} is lost, {EACH} messages by its index" in readings.notes[0]


def test_a_wrong_crc_is_enough():
    def wrong(out, places):
        struct.pack_into("<I", out, places[3][0] + 9 + 24, 12345)
        return out

    readings, chunks, _ = kept(log(mend=wrong)[0])
    assert chunks == set(range(CHUNKS)) - {3}
    assert readings.lost[0].why == "its CRC does not match"


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("length", [0, 1, 77, 400, 2**63, 2**64 - 1])
def test_a_damaged_length_costs_at_most_its_own_chunk(closed, length):
    def wrong(out, places):
        struct.pack_into("<Q", out, places[4][0] + 1, length)
        return out

    readings, chunks, numbers = kept(log(closed=closed, mend=wrong)[0])
    assert chunks >= set(range(CHUNKS)) - {4} and numbers == whole(chunks)
    assert closed or readings.partial


def test_a_summary_whose_crc_fails_is_not_used():
    data = bytearray(log()[0])
    data[-80] ^= 1
    readings, _, numbers = kept(bytes(data))
    assert numbers == whole(range(CHUNKS)) and not readings.partial
    assert readings.notes == ("The CRC of the file's summary does not match: its summary was not used.",)


def test_a_data_section_whose_crc_fails_is_reported_even_where_no_chunk_is_damaged():
    def wrong(out, places):
        return out[: places[2][1] + 20] + bytes([out[places[2][1] + 20] ^ 1]) + out[places[2][1] + 21 :]

    data, places = log(crc=0)
    damaged = bytearray(data)
    damaged[places[2][1] + 20] ^= 1  # in a message index
    readings, _, numbers = kept(bytes(damaged))
    assert readings.partial and numbers == whole(range(CHUNKS))
    assert "CRC of the data section does not match" in readings.notes[0]
    assert kept(log(mend=wrong)[0])[0].partial is False  # the CRC was written over the change


def test_a_summary_that_counts_more_messages_than_there_are():
    readings, _, numbers = kept(log(counted=7)[0])
    assert numbers == whole(range(CHUNKS))
    assert [(one.messages, one.since_ns) for one in readings.lost] == [(7, None)]


@settings(max_examples=120, deadline=None)
@given(st.data())
def test_no_flipped_byte_is_taken_for_data(draw):
    """Wherever a byte is changed, what is kept was written so, or the log is marked or refused."""
    compression = draw.draw(st.sampled_from(list(PACK)))
    data, _ = log(compression, closed=draw.draw(st.booleans()))
    damaged = bytearray(data)
    for _ in range(draw.draw(st.integers(1, 3))):
        place = draw.draw(st.integers(8, len(data) - 1))
        damaged[place] ^= draw.draw(st.integers(1, 255))
    try:
        readings = read_log("a.mcap", bytes(damaged), PROFILE)
    except KempfError:
        return
    values = [round(v * 180 / 3.141592653589793 * 8, 6) for v in readings.frame["heading_rad"]]
    assert values == [(t - START) // STEP for t in readings.frame["time_utc_ns"]] or readings.partial
    assert len(values) == CHUNKS * EACH or readings.partial or readings.tally.records_rejected


def bomb(size, compression, pack, claim=None):
    packed = pack(size)
    head = struct.pack("<QQQI", START, START, size if claim is None else claim, 0) + text(compression)
    return record(6, head + struct.pack("<Q", len(packed)) + packed)


@pytest.mark.parametrize("compression", [b"zstd", b"lz4"])
@pytest.mark.parametrize("claim", [None, 1000])
def test_a_chunk_that_is_a_bomb_is_refused_and_the_rest_is_read(compression, claim, monkeypatch):
    monkeypatch.setattr(mcap_records, "CHUNK_LIMIT", 1 << 22)
    pack = {b"zstd": zstandard.ZstdCompressor().compress, b"lz4": lz4.frame.compress}[compression]
    evil = bomb(1 << 24, compression, lambda size: pack(bytes(size)), claim)
    begin = time.process_time()
    readings, chunks, _ = kept(log(mend=lambda out, places: bytes(out) + evil)[0])
    assert chunks == set(range(CHUNKS)) and readings.partial
    assert time.process_time() - begin < 1.0


def test_many_chunks_that_unpack_to_too_much_are_refused(monkeypatch):
    monkeypatch.setattr(unpack, "_BASE", 1 << 20)
    records = [message(START, START, 0, bytes(1 << 18))]
    chunk = chunk_record(records, b"zstd", PACK[b"zstd"])[0]
    data = OPENED + chunk * 100
    with pytest.raises(DataRejected) as refused:
        read_log("a.mcap", data, PROFILE)
    assert refused.value.code == "log_too_large"


def test_a_chunk_of_too_many_messages_is_refused(monkeypatch):
    monkeypatch.setattr(unpack, "_RECORDS", 1000)
    chunk = chunk_record([message(START, START, 0, b"{}")] * 100_000, b"zstd", PACK[b"zstd"])[0]
    data = OPENED + chunk
    with pytest.raises(DataRejected) as refused:
        read_log("a.mcap", data, PROFILE)
    assert refused.value.code == "too_many_records"


def test_a_file_of_nothing_but_beginnings_of_chunks_takes_no_time_and_no_space():
    head = struct.pack("<BQQQQI", 6, 40, START, START, 0, 1) + text(b"") + struct.pack("<Q", 0)
    data = OPENED
    data += chunk_record([message(START, START, 0, b'{"heading": 1}')], b"", bytes)[0] + (head + b"\xff" * 12) * 3_000
    begin = time.process_time()
    readings, _, numbers = kept(data)
    assert numbers == [0] and len(readings.lost) <= 1_000 and len(readings.notes) <= 1_001
    assert time.process_time() - begin < 3.0


def test_a_large_record_of_another_kind_is_stepped_over_and_a_garbled_one_is_not():
    data, places = log()
    at = places[6][0]
    attachment = record(9, bytes(9 << 20))
    readings, _, numbers = kept(log(mend=lambda out, _: bytes(out) + attachment)[0])
    assert numbers == whole(range(CHUNKS)) and not readings.partial
    garbled = data[:at] + b"\x00" + struct.pack("<Q", len(data) - at - 100) + data[at + 9 :]
    readings, chunks, _ = kept(garbled)
    assert chunks == set(range(CHUNKS))


@pytest.mark.parametrize("instant", [0, 2**63, 2**64 - 1])
def test_times_that_damage_made_are_not_reported(instant):
    def wrong(out, places):
        at, to = places[4]
        struct.pack_into("<QQ", out, at + 9, instant, instant)
        out[to - 20] ^= 1
        return out

    readings, chunks, _ = kept(log(index=False, closed=False, mend=wrong)[0])
    assert chunks == set(range(CHUNKS)) - {4}
    assert (readings.lost[0].since_ns, readings.lost[0].until_ns) == (None, None)


def test_lost_chunks_that_follow_each_other_are_handed_on_together():
    rotten = chunk_record(messages(1)[:1], b"", bytes, crc=12345)[0]
    data, _ = log(index=False, closed=False, mend=lambda out, _: bytes(out) + rotten * 3_000)
    stream = McapStream("a.mcap", LogFile(data))
    batches = list(stream.batches())
    assert [batch.lost for batch in batches] == [False, True]
    assert [batch.first.size for batch in batches] == [CHUNKS * EACH, 3_000]
    assert len(stream.lost) == 1_000 and stream.partial


def test_a_quiet_day_at_berth_packs_very_well_and_is_no_bomb():
    start = "2025-05-03T00:00:00Z"
    profile = VesselProfile.model_validate(
        {
            "sources": [
                {
                    "match": "*",
                    "time": {"column": "t", "unit": "s", "start": start},
                    "channels": {"h": {"channel": "heading", "unit": "deg"}},
                }
            ]
        }
    )
    day = b"t,h\n" + b"".join(b"%d.%d,90.0\n" % divmod(k, 10) for k in range(864_000))
    packed = zstandard.ZstdCompressor().compress(day)
    assert read_log("a.csv.zst", packed, profile).tally.records_kept == 864_000
