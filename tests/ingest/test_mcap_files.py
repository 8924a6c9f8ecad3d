"""Several MCAP files behind each other in one log, and how much a log may unpack to."""

from __future__ import annotations

import io
import json
import math
import struct
import zlib

import pytest
import zstandard
from mcap.writer import CompressionType, IndexType, Writer

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.container import budget, seams
from kempf.pipeline.ingest.mcap.topics.fields import fields_of
from kempf.schemas.errors import DataRejected
from tests.ingest.mcap_variants import chunk_record
from tests.ingest.test_mcap import START, plain, profile, read, write
from tests.ingest.test_salvage import OPENED

BEHIND = "The log is 2 MCAP files behind each other, which were read one after the other."


def halves(n: int = 60, **options: object) -> tuple[bytes, bytes]:
    messages = plain(n)
    return write(messages[:n], **options), write(messages[n:], **options)


@pytest.mark.parametrize(
    "options", [{}, {"use_chunking": False}, {"index_types": IndexType.NONE}, {"enable_crcs": False}]
)
def test_files_behind_each_other_are_read_like_the_file_they_were_cut_from(options: dict[str, object]) -> None:
    first, second = halves(**options)
    both, whole = read(first + second), read(write(plain(), **options))
    assert both.frame.equals(whole.frame) and both.tally == whole.tally
    assert both.lost == () and both.notes == (BEHIND,)


def test_files_in_another_order_than_that_of_their_times_are_put_in_order() -> None:
    first, second = halves()
    both, whole = read(second + first), read(write(plain()))
    assert both.frame.equals(whole.frame) and both.tally == whole.tally
    assert both.notes == (BEHIND.replace("one after the other", "in the order of their times"),)
    # raw bytes are those of their own file
    odd = read(second + write([*plain()[:59], ("/gyro", 5.9 / 2, b"no message")]))
    assert odd.rejected["raw"].to_list() == ["no message"]


def test_a_file_behind_its_copy_counts_its_messages_as_duplicates() -> None:
    data = write(plain())
    readings = read(data + data)
    assert readings.tally.records_read == 240 and readings.tally.records_kept == 120


def test_each_file_has_its_own_numbers_of_channels_and_its_own_bytes() -> None:
    first = write([("/gyro", k / 10, {"heading": k}) for k in range(9)])
    # the first channel of the second file is another one
    second = write(
        [(("/nav", "/gyro")[k % 2], 1 + k / 10, {"heading": k, "pose": {"speed": 3, "cog": 4}}) for k in range(8)]
        + [("/aft", 2, {"wave": 1}), ("/gyro", 3, b"no message")]
    )
    readings = read(first + second)
    by_source = dict(readings.frame.group_by("source").len().iter_rows())
    assert by_source == {"/gyro": 13, "/nav": 4}
    assert readings.frame["heading_rad"].max() == math.radians(8)
    refused = dict(readings.rejected.select("reason", "raw").iter_rows())
    assert refused == {"no_channel": '{"wave": 1}', "malformed": "no message"}
    assert set(fields_of("log.mcap", LogFile(first + second))) == {"/gyro", "/nav", "/aft"}


@pytest.mark.parametrize("index", [IndexType.ALL, IndexType.NONE])
def test_a_second_file_that_is_damaged_is_read_as_far_as_it_is_whole(index: IndexType) -> None:
    first, second = halves(compression=CompressionType.NONE, index_types=index)
    readings = read(first + second[: len(second) // 2])
    assert 60 < readings.tally.records_kept < 120 and readings.partial
    (note,) = [note for note in readings.notes if "cut short" in note]
    assert note.startswith(f"In the file from byte {len(first)} on: ")


@pytest.mark.parametrize("options", [{}, {"compression": CompressionType.NONE}, {"use_chunking": False}])
def test_a_file_behind_one_that_was_cut_is_not_taken_for_its_end(options: dict[str, object]) -> None:
    first = write(plain()[:60], **options)
    # its first channel is another one
    second = write([("/nav", 100.0, {"pose": {"speed": 1, "cog": 2}, "heading": 77}), *plain()[60:]], **options)
    readings = read(first[: len(first) * 2 // 3] + second)
    assert readings.tally.by_reason.keys() <= {"malformed", "clock_back"} and readings.partial
    late = readings.frame.filter(readings.frame["source"] == "/gyro")["heading_rad"]
    assert late[-30:].to_list() == [math.radians(k / 4) for k in range(30, 60)]


def attaching(content: bytes, crc: int | None) -> bytes:
    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    writer.register_channel("/aft", "json", 0)
    writer.add_attachment(0, 0, "before.mcap", "application/mcap", content)
    writer.finish()
    data = out.getvalue()
    stored = struct.pack("<I", zlib.crc32(data[data.index(b"\x09", 20) + 9 : data.index(content) + len(content)]))
    assert stored in data
    return data if crc is None else data.replace(stored, struct.pack("<I", crc))


@pytest.mark.parametrize("crc", [None, 0])
def test_a_file_that_is_attached_to_one_without_an_end_is_no_file_of_the_log(crc: int | None) -> None:
    inner = write(plain())
    # cut behind its attachment
    outer = attaching(inner, crc)
    outer = outer[: outer.index(inner) + len(inner) + 4]
    assert seams.places_of_files(LogFile(outer)) == [(0, len(outer))]
    assert len(seams.places_of_files(LogFile(outer + inner))) == 2


def test_what_stands_behind_the_end_and_is_no_file_is_lost_and_counted() -> None:
    data = write(plain())
    readings = read(data + b"\x00\x01" * 50)
    assert readings.tally.records_kept == 120
    (lost,) = readings.lost
    assert lost.since_ns == START + 5_910_000_000
    assert lost.why == "100 bytes stand behind the end of the MCAP file, which are no MCAP file"
    zeros = read(data + bytes(4096))
    assert zeros.tally.records_kept == 120 and not zeros.partial
    assert zeros.notes == ("4096 bytes behind the end of the MCAP file are zero and were left out.",)


def test_of_very_many_files_those_beyond_a_bound_are_lost_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seams, "_MOST_FILES", 2)
    parts = [write([("/gyro", k, {"heading": k}), ("/nav", k, {"pose": {}})]) for k in range(3)]
    readings = read(b"".join(parts))
    assert readings.tally.records_read == 4
    assert [lost.why.split()[0] for lost in readings.lost] == [str(len(parts[2]))]


def dark(seconds: int, pixels: int) -> list[tuple[str, float, object]]:
    return [("/camera", float(k), bytes(pixels)) for k in range(seconds)]


def test_a_camera_that_sees_nothing_does_not_refuse_the_log() -> None:
    data = write(plain() + dark(120, 640 * 480), compression=CompressionType.ZSTD, chunk_size=1 << 20)
    assert len(data) < 60_000
    readings = read(data)
    assert readings.tally.records_kept == 120 and readings.tally.by_reason == {"no_channel": 120}


def test_what_nobody_asks_for_has_a_bound_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "_BASE", 1 << 20)
    monkeypatch.setattr(budget, "_RATIO", 1)
    monkeypatch.setattr(budget, "allowance", lambda delivered: (1 << 20, 1000))
    data = write(plain() + dark(30, 100_000), compression=CompressionType.ZSTD)
    with pytest.raises(DataRejected, match="unpacks to more than") as refused:
        read(data)
    assert refused.value.code == "log_too_large" and "mcap filter" in refused.value.next_step


@pytest.mark.parametrize("crc", [None, 1])
def test_chunks_that_hold_no_message_have_a_bound_as_well(crc: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "_BASE", 1 << 20)
    monkeypatch.setattr(budget, "_RATIO", 1)
    monkeypatch.setattr(budget, "allowance", lambda delivered: (1 << 20, 1000))
    # of an application's own records, and with a wrong CRC
    stuffed = chunk_record([(0x90, bytes(1 << 18))], b"zstd", zstandard.ZstdCompressor().compress, crc)[0]
    with pytest.raises(DataRejected) as refused:
        read(OPENED + stuffed * 8)
    assert refused.value.code == "log_too_large"


def test_files_behind_each_other_share_one_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "allowance", lambda delivered: (1 << 20, 150))
    data = write(plain())
    read(data)
    with pytest.raises(DataRejected) as refused:
        read(data + data)
    assert refused.value.code == "too_many_records"


def test_a_bound_holds_for_what_is_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budget, "allowance", lambda delivered: (1 << 18, 1000))
    stuffed = [("/gyro", float(k), json.dumps({"heading": 1, "x": " " * 10_000}).encode()) for k in range(40)]
    with pytest.raises(DataRejected) as refused:
        read(write(stuffed), profile({"/gyro.heading": {"channel": "heading", "unit": "deg"}}))
    assert refused.value.code == "log_too_large"
