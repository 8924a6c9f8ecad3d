"""``kempf profile draft``: a profile to complete from the columns of a log, refused until it is."""

from __future__ import annotations

from pathlib import Path

import yaml

from kempf.pipeline.ingest.draft_profile import draft_profile
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


def test_what_describes_itself_needs_no_draft(logs: Path, tmp_path: Path) -> None:
    refused(kempf("profile", "draft", logs / "mariner.nmea.gz", "--json"), 2, "no_draft")
    refused(kempf("profile", "draft", logs / "none.csv", "--json"), 4, "no_such_file")
    bad = (("empty.csv", b"", 3, "empty_log"), ("noise.csv", bytes(range(256)), 2, "no_draft"))
    for name, content, code, error in bad:
        (tmp_path / name).write_bytes(content)
        output = refused(kempf("profile", "draft", tmp_path / name, "--json"), code, error)
        assert "Ingest it as it is" not in output["next_step"]
    assert "sources:" in kempf("profile", "draft", logs / "mariner.csv.gz", "--json").json["profile"]
