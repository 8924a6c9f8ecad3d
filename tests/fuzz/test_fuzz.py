"""A hundred damaged inputs a reader; a campaign of minutes is `benchmarks.ingest.fuzz`."""

import pytest
from mcap.writer import CompressionType

from benchmarks.ingest.fuzzing.campaign import run
from benchmarks.ingest.fuzzing.corpus import READERS, START_NS, mcap_log
from benchmarks.ingest.fuzzing.whole_chunks import vouched_times


@pytest.mark.parametrize("reader", READERS)
def test_damaged_inputs_crash_nothing_and_no_failed_checksum_is_accepted(reader):
    found = run(reader, 1, iterations=100)
    assert [(one.what, one.name, one.data[:500]) for one in found.findings] == []
    assert found.iterations == 100
    assert len(found.outcomes) > 3


def test_a_reader_that_accepts_any_checksum_is_found_out(monkeypatch):
    from kempf.pipeline.ingest.nmea import frames as nmea_frames

    monkeypatch.setattr(nmea_frames, "checksum_right", lambda buffer, prefix, first, star: star > first)
    with pytest.raises(AssertionError, match="kept under a wrong checksum"):
        run("nmea", 1, iterations=0)


def test_a_chunk_that_fails_its_checksum_vouches_for_none_of_its_messages():
    data = mcap_log(compression=CompressionType.NONE)
    whole = vouched_times(data)
    assert len(whole) == 80
    damaged = bytearray(data)
    damaged[data.index(b'"heading": 90')] ^= 1
    lost = whole - vouched_times(bytes(damaged))
    assert START_NS + 10 * 100_000_000 in lost
    assert 1 < len(lost) < 20
