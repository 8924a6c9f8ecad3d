"""A log that comes in parts is read as if it came in one, wherever it is cut."""

from __future__ import annotations

import io
import json
import random
from dataclasses import replace

import numpy as np
import pytest
from mcap.writer import Writer
from polars.testing import assert_frame_equal

from kempf.pipeline.ingest.clock_corrections import OwnClocks
from kempf.pipeline.ingest.decoded import CODE, NO_TIME, Decoded, Reason, Values
from kempf.pipeline.ingest.mcap import decode
from kempf.pipeline.ingest.read import read_parts
from kempf.pipeline.ingest.screen import Screen
from kempf.pipeline.ingest.spans import Spans
from kempf.schemas.profile import Source, VesselProfile
from tests.reading import joined, read_log

START_NS = 1_755_497_274_000_000_000
SECOND = 1_000_000_000


def equal(found, wanted) -> None:
    assert_frame_equal(found.frame, wanted.frame)
    assert_frame_equal(found.rejected, wanted.rejected)
    assert (found.tally, found.notes, found.lost) == (wanted.tally, wanted.notes, wanted.lost)


def untidy(seed: int, n: int) -> Decoded:
    """Records of three sources whose clocks jump, stand still and run back, with repetitions and bad values."""
    draw = random.Random(seed)
    time, latest = [], dict.fromkeys(range(3), START_NS)
    source = [draw.randrange(3) for _ in range(n)]
    for own in source:
        step = draw.choice([0, 0, 1, 1, 2, -1, 40, -40, 11])
        time.append(latest[own] + step * SECOND)
        if draw.random() < 0.8:
            latest[own] = max(latest[own], time[-1]) if step < 11 else latest[own] + draw.choice([0, 1]) * SECOND
        if draw.random() < 0.03:
            time[-1] = draw.choice([int(NO_TIME), 5])
    words = [draw.choice([b"a", b"bb", b"ccc"]) for _ in range(n)]
    stop = np.cumsum([len(word) for word in words], dtype=np.int64)
    spans = Spans(np.frombuffer(b"".join(words), dtype=np.uint8), np.append(0, stop)[:-1].astype(np.int64), stop)
    value = np.array([draw.choice([0.1, 0.2, 900.0, np.nan]) for _ in range(n)])
    there = np.array([draw.random() < 0.7 for _ in range(n)], dtype=np.bool_)
    reason = np.array([CODE[Reason.MALFORMED] if draw.random() < 0.05 else 0 for _ in range(n)], dtype=np.int8)
    return Decoded(
        np.arange(n, dtype=np.int64),
        *(spans, spans, np.array(time, dtype=np.int64), np.array(source, dtype=np.int64), ("a", "b", "c"), reason),
        {"heading": Values(value, there), "yaw_rate": Values(np.full(n, 0.01), ~there)},
        ["one note"],
    )


def cut(whole: Decoded, at: list[int]) -> list[Decoded]:
    parts = [whole.take(np.arange(a, b)) for a, b in zip([0, *at], [*at, len(whole)], strict=True)]
    return [*(replace(part, ends=False, notes=[]) for part in parts[:-1]), parts[-1]]


@pytest.mark.parametrize("seed", range(60))
def test_the_screen_does_not_see_where_a_log_is_cut(seed: int) -> None:
    draw = random.Random(1000 + seed)
    whole = untidy(seed, draw.choice([1, 2, 3, 5, 40, 200]))
    at = sorted(draw.randrange(len(whole) + 1) for _ in range(draw.choice([1, 2, 7, 30])))
    checks = Screen("nmea")
    found = joined([checks.part(part) for part in cut(whole, at)])
    equal(found, Screen("nmea").part(whole))


def test_little_is_held_back() -> None:
    n = 5_000
    whole = replace(untidy(3, n), time_utc_ns=START_NS + np.arange(n) * SECOND)
    checks, first = Screen("nmea"), cut(whole, [4_000])[0]
    assert checks.part(first).tally.records_read == 4_000 - 2 * 3  # the last that is believed and the last, a source


def test_a_log_of_thousands_of_parts_holds_no_more_than_a_link_a_source() -> None:
    n = 1_500
    whole = replace(untidy(3, n), time_utc_ns=START_NS + np.arange(n) * SECOND)
    checks = Screen("nmea")
    # each part holds something back for the next; a chain of all parts would be too deep to be walked
    found = joined([checks.part(part) for part in cut(whole, list(range(1, n)))])
    equal(found, Screen("nmea").part(whole))


def untidy_log(n: int = 300) -> bytes:
    """Two mapped topics and one that nobody asked for; clocks that jump, repetitions, broken payloads."""
    draw, out, at = random.Random(8), io.BytesIO(), dict.fromkeys(("/hdg", "/rot", "/other"), START_NS)
    writer = Writer(out, chunk_size=300)
    writer.start()
    schema = writer.register_schema("any", "jsonschema", b"{}")
    ids = {topic: writer.register_channel(topic, "json", schema) for topic in at}
    for _ in range(n):
        topic = draw.choice(list(at))
        at[topic] += draw.choice([0, 1, 1, 1]) * SECOND // 10
        time = at[topic] + draw.choice([0] * 9 + [-2 * SECOND, 60 * SECOND])
        payload = b"{" if draw.random() < 0.04 else json.dumps({"value": draw.choice([1, 2, 4000])}).encode()
        writer.add_message(ids[topic], time, payload, time)
    writer.finish()
    return out.getvalue()


@pytest.mark.parametrize("together", [1, 2, 7, 50])
def test_mcap_in_parts(monkeypatch: pytest.MonkeyPatch, together: int) -> None:
    data, profile = untidy_log(), VesselProfile(sources=[SOURCE])
    wanted = read_log("a.mcap", data, profile)
    assert wanted.tally.records_rejected > 10 and wanted.notes
    monkeypatch.setattr(decode, "_TOGETHER", together)
    monkeypatch.setattr("kempf.pipeline.ingest.mcap.container.stream.WINDOW", 500)
    parts = list(read_parts("a.mcap", data, profile))
    assert len(parts) > 1 and not any(part.notes for part in parts[:-1])
    equal(joined(parts), wanted)


SOURCE = Source.model_validate(
    {
        "match": "*",
        "channels": {
            "/hdg.value": {"channel": "heading", "unit": "deg", "clock_rate": 1.001},
            "/rot.value": {"channel": "yaw_rate", "unit": "deg/s", "delay_s": 0.5},
        },
    }
)


def test_clocks_of_their_own_begin_with_the_log_and_not_with_the_part() -> None:
    readings = Screen("delimited").part(untidy(5, 300))
    source = Source.model_validate(
        {"match": "*", "channels": {"h": {"channel": "heading", "unit": "deg", "clock_rate": 1.05}}}
    )
    wanted = OwnClocks(source).set_right(readings)
    clocks, middle = OwnClocks(source), readings.frame.height // 2
    halves = [replace(readings, frame=f) for f in (readings.frame[:middle], readings.frame[middle:])]
    found = joined([clocks.set_right(half) for half in halves])
    assert_frame_equal(found.frame, wanted.frame)
