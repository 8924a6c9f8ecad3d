"""``kempf profile draft``: a profile to complete from the columns of a log, refused until it is."""

from __future__ import annotations

from pathlib import Path

import yaml

from kempf.pipeline.ingest.delimited import titled
from kempf.pipeline.ingest.draft_profile import draft_profile
from kempf.pipeline.ingest.mcap.container.records import McapChannel, Schema
from kempf.pipeline.ingest.mcap.topics.fields import numbers_of
from kempf.schemas.profile import Source
from tests.workbench.driving import kempf, refused


def test_a_log_without_a_profile_says_how_to_draft_one(logs: Path, tmp_path: Path) -> None:
    log, place = logs / "mariner.csv.gz", tmp_path / "w"
    asked = ("ingest", log, "--vessel", "mariner", "--warehouse", place, "--json")
    assert "kempf profile draft mariner.csv.gz" in refused(kempf(*asked), 2, "no_source_for_log")["next_step"]
    profile = tmp_path / "mariner.yaml"
    assert kempf("profile", "draft", log, "--output", profile).code == 0
    error = refused(kempf(*asked, "--profile", profile), 2, "profile_draft")
    lines = profile.read_text(encoding="utf-8").splitlines()
    assert error["details"]["lines"] == [k for k, line in enumerate(lines, 1) if "?" in line and line[0] != "#"]
    content = yaml.safe_load("\n".join(lines))
    (source,) = content["sources"]
    assert source["match"] == "mariner.csv.gz" and source["time"] == {"column": "utc?"}
    assert source["channels"]["heading"] == {"channel": "heading?", "unit": "deg?"}
    known = yaml.safe_load((logs / "profile.yaml").read_text(encoding="utf-8"))
    (right,) = (s for s in known["sources"] if "utc" in str(s.get("time")))
    guessed = {name: one["channel"].rstrip("?") for name, one in source["channels"].items()}
    assert guessed == {name: one["channel"] for name, one in right["channels"].items()}
    # completed, it is taken
    source["time"], source["channels"], content["vessel"] = right["time"], right["channels"], "mariner"
    profile.write_text(yaml.safe_dump(content), encoding="utf-8")
    assert kempf(*asked, "--profile", profile).code == 0


def test_units_behind_a_name_and_columns_of_no_known_name() -> None:
    text = draft_profile("day.csv", ["time", "SOG (kn)", "heading_deg", "rot [deg/s]", "rudder order", "x: 1"])
    channels = yaml.safe_load(text)["sources"][0]["channels"]
    assert channels["SOG (kn)"] == {"channel": "speed_over_ground?", "unit": "kn?"}
    assert channels["heading_deg"]["unit"] == "deg?"
    assert channels["rot [deg/s]"] == {"channel": "yaw_rate?", "unit": "deg/s?"}
    assert channels["rudder order"]["channel"] == "rudder_order?"
    assert channels["x: 1"] == {"channel": "?", "unit": "?"}


def test_a_date_beside_a_time_of_day_is_recognised() -> None:
    for day, clock in (("Date", "Time"), ("UTC date", "UTC time"), ("date_utc", "time_utc")):
        (source,) = yaml.safe_load(draft_profile("day.csv", [day, clock, "heading"]))["sources"]
        assert source["time"] == {"date": f"{day}?", "time": f"{clock}?"}
        assert list(source["channels"]) == ["heading"]
    (source,) = yaml.safe_load(draft_profile("day.csv", ["date", "heading"]))["sources"]
    assert source["time"] == {"column": "date?"}


def test_what_describes_itself_needs_no_draft(logs: Path, tmp_path: Path) -> None:
    refused(kempf("profile", "draft", logs / "mariner.nmea.gz", "--json"), 2, "no_draft")
    refused(kempf("profile", "draft", logs / "none.csv", "--json"), 4, "no_such_file")
    bad = (("empty.csv", b"", 3, "empty_log"), ("noise.csv", bytes(range(256)), 2, "no_draft"))
    for name, content, code, error in bad:
        (tmp_path / name).write_bytes(content)
        output = refused(kempf("profile", "draft", tmp_path / name, "--json"), code, error)
        assert "Ingest it as it is" not in output["next_step"]
    (tmp_path / "set.json").write_text('{"a": [1, 2]}\n', encoding="utf-8")
    assert "JSON text" in refused(kempf("profile", "draft", tmp_path / "set.json", "--json"), 2, "no_draft")["message"]
    ingest = kempf("ingest", tmp_path / "set.json", "--vessel", "x", "--warehouse", tmp_path / "w", "--json")
    assert "is JSON text" in refused(ingest, 3, "unknown_format")["message"]
    assert "sources:" in kempf("profile", "draft", logs / "mariner.csv.gz", "--json").json["profile"]


def test_an_mcap_log_is_drafted_topic_by_topic_and_read_once_completed(logs: Path, tmp_path: Path) -> None:
    log = tmp_path / "day.mcap"
    log.write_bytes((logs / "mariner.mcap").read_bytes())
    asked = ("ingest", log, "--vessel", "mariner", "--warehouse", tmp_path / "w", "--json")
    assert "kempf profile draft day.mcap" in refused(kempf(*asked), 2, "no_source_for_log")["next_step"]
    draft = yaml.safe_load(kempf("profile", "draft", log, "--json").json["profile"])
    (source,) = draft["sources"]
    known = yaml.safe_load((logs / "profile.yaml").read_text(encoding="utf-8"))
    (right,) = (s for s in known["sources"] if "mcap" in s["match"])
    guessed = {name: one["channel"].rstrip("?") for name, one in source["channels"].items()}
    assert guessed.items() >= {name: one["channel"] for name, one in right["channels"].items()}.items()
    profile = tmp_path / "mariner.yaml"
    profile.write_text(yaml.safe_dump(draft), encoding="utf-8")
    refused(kempf(*asked, "--profile", profile), 2, "profile_draft")
    source["channels"] = {name: source["channels"][name] | right["channels"][name] for name in right["channels"]}
    profile.write_text(yaml.safe_dump({**draft, "vessel": "mariner"}), encoding="utf-8")
    assert kempf(*asked, "--profile", profile).code == 0


def test_a_definition_fills_the_draft_where_it_says_what_a_field_is() -> None:
    header = "std_msgs/Header header\nfloat64 heave\nstring name\ngeometry_msgs/Quaternion orientation"
    parts = (
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
        "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    )
    schema = Schema("mine_msgs/msg/Motion", "ros2msg", f"\n{'=' * 80}\n".join((header, *parts)).encode())
    channel = McapChannel("/mru", "cdr", 1)
    assert list(numbers_of(channel, schema, None)) == ["heave", "orientation.yaw"]
    assert list(numbers_of(McapChannel("/mru", "json", 0), None, b'{"a": {"b": 1, "ok": true}, "stamp": 2}')) == ["a.b"]


def test_a_table_below_a_title_is_drafted_with_its_header_lines() -> None:
    rows = "\n".join(f"  {k / 20:.3f}   {k}.5  -3" for k in range(9))
    below = titled(f"HSVA, experimental data\nZ20/10\n{rows}\n".encode())
    assert below is not None and (below.header_lines, below.separator, below.names, below.count) == (
        *(2, "whitespace", (), 3),
    )
    (source,) = yaml.safe_load(draft_profile("x.dat", ["HSVA", "experimental data"], below))["sources"]
    assert source["header_lines"] == 2 and source["columns"] == ["column 1", "column 2", "column 3"]
    assert Source.model_validate({k: v for k, v in source.items() if k not in ("time", "channels")})
    named = titled(("Trial of May\nt;heading\n" + "1.5;2\n" * 9).encode())
    assert named is not None and (named.header_lines, named.names) == (1, ("t", "heading"))
    assert titled(("time,heading\n" + "2025-05-03 06:00,2\n" * 9 + "2025-05-03 06:01\n").encode()) is None
