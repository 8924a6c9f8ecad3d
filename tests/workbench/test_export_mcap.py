"""``kempf export mcap``: what the reader of the format's makers reads back is what was measured and predicted."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from tests.workbench.driving import kempf, refused

HORIZONS = ("one_step", "free_run")
CHANNELS = {"lateral_speed": "m_s", "yaw_rate": "deg_s", "heading": "deg"}


@pytest.fixture(scope="module")
def written(_filled: Path, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("mcap") / "ship.mcap"
    done = kempf("export", "mcap", "--vessel", "mariner", "--output", path, "--warehouse", _filled, "--json")
    assert done.code == 0, done
    assert done.json["format"] == "mcap" and done.json["runs"] == 1
    return path.read_bytes()


@pytest.fixture(scope="module")
def topics(written: bytes) -> dict[str, tuple[np.ndarray, list[dict]]]:
    """Times and messages by topic, each checked against its schema's properties."""
    found: dict[str, tuple[list[int], list[dict]]] = {}
    for schema, channel, message in make_reader(BytesIO(written), validate_crcs=True).iter_messages():
        assert schema is not None and schema.encoding == "jsonschema" and channel.message_encoding == "json"
        content = json.loads(message.data)
        described = json.loads(schema.data)["properties"]
        assert set(content) <= set(described)
        assert all(d["description"] for d in described.values())
        assert message.log_time == message.publish_time
        times, contents = found.setdefault(channel.topic, ([], []))
        times.append(message.log_time)
        contents.append(content)
    return {topic: (np.array(times), contents) for topic, (times, contents) in found.items()}


def test_topics_stand_side_by_side(topics: dict):
    wanted = {"/run", "/input/rudder", "/input/speed", "/measured/position"}
    for name in CHANNELS:
        wanted.add(f"/measured/{name}")
        wanted |= {f"/{kind}/{horizon}/{name}" for kind in ("predicted", "residual") for horizon in HORIZONS}
    assert set(topics) == wanted
    for name in CHANNELS:
        times = topics[f"/measured/{name}"][0]
        assert np.all(np.diff(times) > 0) and times[0] > 1_000_000_000_000_000_000
        # a prediction stands at the instant of its measurement
        assert set(times.tolist()) <= set(topics[f"/predicted/one_step/{name}"][0].tolist())


def test_predictions_are_those_of_compare(topics: dict, _filled: Path):
    for horizon, topic in (("1", "one_step"), ("free", "free_run")):
        output = kempf("compare", "--vessel", "mariner", "--horizon", horizon, "--warehouse", _filled, "--json").json
        run = output["runs"][0]
        for name, unit in CHANNELS.items():
            field = f"{name}_{unit}"
            measured = dict(zip(topics[f"/measured/{name}"][0].tolist(), topics[f"/measured/{name}"][1], strict=True))
            times, messages = topics[f"/predicted/{topic}/{name}"]
            # at one step the first predictions only carry the initial state and have no interval
            kept = [
                (measured[t][field], m[field])
                for t, m in zip(times.tolist(), messages, strict=True)
                if t in measured and (horizon == "free" or "low_95" in m)
            ]
            error = np.array([a - b for a, b in kept])
            left = [m[field] for m in topics[f"/residual/{topic}/{name}"][1]]
            if name == "heading":
                error = (error + 180.0) % 360.0 - 180.0
            assert np.sort(left) == pytest.approx(np.sort(error), abs=1e-9)
            assert len(kept) == run["n"][name]
            assert np.sqrt(np.mean(error**2)) == pytest.approx(run["rms_display"][name]["value"], rel=1e-9)


def test_intervals_hold_what_they_promise(topics: dict):
    inside = []
    for name, unit in CHANNELS.items():
        times, messages = topics[f"/predicted/one_step/{name}"]
        at = {t: m for t, m in zip(times.tolist(), messages, strict=True) if "low_95" in m}
        for t, content in zip(*topics[f"/measured/{name}"], strict=True):
            if int(t) in at:
                low, high = at[int(t)]["low_95"], at[int(t)]["high_95"]
                assert low < high
                turns = (0.0, -360.0, 360.0) if name == "heading" else (0.0,)
                inside.append(any(low <= content[f"{name}_{unit}"] + turn <= high for turn in turns))
        assert "low_95" not in topics[f"/predicted/free_run/{name}"][1][0], "no model of its error: no interval"
    assert 0.91 < np.mean(inside) < 0.985


def test_heading_is_the_true_one(topics: dict, _filled: Path):
    segment = kempf("segments", "--vessel", "mariner", "--warehouse", _filled, "--json").json[0]
    for topic in ("/measured/heading", *(f"/predicted/{horizon}/heading" for horizon in HORIZONS)):
        assert all(0.0 <= one["heading_deg"] < 360.0 for one in topics[topic][1])
    first = topics["/measured/heading"][1][0]["heading_deg"]
    assert (first - segment["base_heading_deg"] + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1.5)


def test_the_position_is_that_of_the_log_for_the_maps_of_viewers(written: bytes, topics: dict):
    times, fixes = topics["/measured/position"]
    begin, end = topics["/run"][0]
    # the grid of the run begins and ends within a second or two of the segment
    assert np.all((begin - 2e9 <= times) & (times <= end + 2e9)) and len(fixes) > 100
    assert all(-90.0 <= one["latitude"] <= 90.0 and -180.0 <= one["longitude"] < 180.0 for one in fixes)
    schemas = {c.topic: s.name for s, c, _ in make_reader(BytesIO(written)).iter_messages() if s is not None}
    assert schemas["/measured/position"] == "foxglove.LocationFix"


def test_one_manoeuvre_alone(written: bytes, _filled: Path, tmp_path: Path):
    (record,) = make_reader(BytesIO(written)).iter_metadata()
    name = next(key for key in record.metadata if key.startswith("seg-"))
    asked = ("export", "mcap", "--vessel", "mariner", "--warehouse", _filled, "--json")
    path = tmp_path / "one.mcap"
    assert kempf(*asked, "--output", path, "--segment", name[:8]).json["runs"] == 1
    assert path.read_bytes() == written, "the ship has no other"
    error = refused(kempf(*asked, "--output", tmp_path / "none.mcap", "--segment", "seg-none"), 4, "no_segment")
    assert error["details"]["known"] == [name]


def test_runs_and_provenance_are_named(written: bytes, topics: dict, _filled: Path):
    reader = make_reader(BytesIO(written))
    (record,) = reader.iter_metadata()
    assert record.name == "kempf" and record.metadata["vessel"] == "mariner"
    events = topics["/run"][1]
    assert [event["event"] for event in events] == ["begin", "end"] and events[0]["held_out"] is False
    assert record.metadata[events[0]["segment_id"]].startswith("fitted")
    known = {s["parameter_set_id"] for s in kempf("params", "list", "--warehouse", _filled, "--json").json}
    assert record.metadata["parameter_set_id"] in known


def test_file_is_chunked_compressed_and_repeats(written: bytes, _filled: Path, tmp_path: Path):
    summary = make_reader(BytesIO(written)).get_summary()
    assert summary is not None and summary.chunk_indexes and summary.statistics is not None
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    assert summary.statistics.message_count > 2000
    again = tmp_path / "again.mcap"
    assert kempf("export", "mcap", "--vessel", "mariner", "--output", again, "--warehouse", _filled).code == 0
    assert again.read_bytes() == written


def test_wrong_requests_are_refused(filled: Path, tmp_path: Path):
    path = tmp_path / "x.mcap"
    asked = ("export", "mcap", "--output", path, "--warehouse", filled, "--json")
    refused(kempf(*asked, "--vessel", "nobody"), 4, "no_vessel")
    refused(kempf(*asked, "--vessel", "mariner", "--set", "ps-zzz"), 4, "no_parameter_set")
    assert not path.exists()
    path.write_bytes(b"")
    refused(kempf(*asked, "--vessel", "mariner"), 2, "cannot_write")
    refused(kempf("export", "mcap", "--vessel", "mariner", "--warehouse", filled, "--json"), 2, "usage")
