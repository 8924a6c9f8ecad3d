"""Names that would like to be paths, commands or queries: none of them leaves a trace outside its row."""

from __future__ import annotations

import gzip
import json
import re
from io import BytesIO
from pathlib import Path

import pytest
import yaml
from mcap.writer import Writer

from tests.conftest import Ship
from tests.workbench.driving import kempf, refused, tree

HOSTILE = [
    "../../x",
    "a\x00/../../b",
    "/etc/passwd",
    "a/b",
    "..",
    ".",
    "~",
    "C:\\ship",
    "a=b",
    "vessel_key=1",
    "%2e%2e%2f",
    "O'Brien",
    "x' OR '1'='1",
    '"; rm -rf /',
    "$(touch gotcha)",
    "-v",
    "--json",
    "Ærøskøbing 船 🚢",
    "two\nlines",
    "\x1b[31mred",
    " blank ",
    "NUL",
    "*",
    "v" * 5000,
]


def outside(folder: Path) -> set[str]:
    """What stands in a folder beside the warehouse ``w``."""
    return {name for name in tree(folder) if name.split("/")[0] != "w"}


def check_names(place: Path) -> None:
    """Every folder of a warehouse is named by the house alone; of a vessel's name only letters and digits are left."""
    parts = {part for name in tree(place) for part in Path(name).parts}
    allowed = {"kempf-warehouse.json", "written", "raw", "_delta_log", "_seals", "log", "data"}
    tables = {"vessels", "logs", "readings", "rejected", "segments", "examinations"} | {
        "parameter_sets",
        "aliases",
        "runs",
        "run_history",
    }
    for part in parts - allowed - tables:
        hexadecimal = set(part.split("=")[-1].removesuffix(".json")) <= set("0123456789abcdef")
        of_vessel = re.fullmatch(r"vessel_key=[a-z0-9]+(-[a-z0-9]+)*-[0-9a-f]{8}", part)
        assert hexadecimal or of_vessel or part.startswith(("part-", "month=")) or part[:20].isdigit(), part


@pytest.mark.parametrize("name", HOSTILE, ids=range(len(HOSTILE)))
def test_a_vessel_may_be_called_anything(mariner: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str):
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "day.nmea"
    log.write_bytes(b"".join(mariner.lines[:400]))
    place = tmp_path / "w"
    output = kempf("ingest", log, f"--vessel={name}", "--warehouse", place, "--json")
    assert output.code == 0, output
    assert outside(tmp_path) == {"day.nmea"}
    check_names(place)
    assert [v["vessel"] for v in kempf("vessels", "list", "--warehouse", place, "--json").json] == [name]
    assert kempf("segments", f"--vessel={name}", "--warehouse", place, "--json").json == []
    (row,) = kempf("logs", "list", f"--vessel={name}", "--warehouse", place, "--json").json
    assert row["vessel"] == name
    assert kempf("vessels", "show", "--warehouse", place, "--json", "--", name).json["profile"]["vessel"] == name
    refused(kempf("history", f"--vessel={name}!", "--warehouse", place, "--json"), 4, "no_vessel")
    human = kempf("vessels", "list", "--warehouse", place)
    # the vessel is in one line, below a head that a long name folds into two
    *head, row = human.out.splitlines()
    assert len(head) <= 2 and head[0].split()[0] == "vessel" and row.split()[-3:] == ["1", "0", "0"]
    assert "\x1b" not in human.out


@pytest.mark.parametrize("name", ["", " ", "\t\n", "\ud800"])
def test_a_vessel_must_be_called_something(mariner: Ship, logs: Path, tmp_path: Path, name: str):
    place = tmp_path / "w"
    asked = ("--vessel", name, "--warehouse", place, "--json")
    refused(kempf("ingest", logs / "mariner.nmea.gz", *asked), 2, "vessel_name")
    refused(kempf("ingest", logs / "mariner.nmea.gz", logs / "gone", *asked), 2, "vessel_name")
    profile = tmp_path / "p.yaml"
    profile.write_text("length_m: 3.0\n")
    refused(kempf("vessels", "set", name, "--profile", profile, "--warehouse", place, "--json"), 2, "vessel_name")
    assert not place.exists()


def test_names_that_differ_in_case_alone_are_two_vessels(mariner: Ship, tmp_path: Path):
    for k, name in enumerate(("Aurora", "aurora")):
        log = tmp_path / f"{k}.nmea"
        log.write_bytes(b"".join(mariner.lines[: 400 + k]))
        assert kempf("ingest", log, "--vessel", name, "--new-vessel", "--warehouse", tmp_path / "w").code == 0
    listed = kempf("vessels", "list", "--warehouse", tmp_path / "w", "--json").json
    assert [(v["vessel"], v["logs"]) for v in listed] == [("Aurora", 1), ("aurora", 1)]


@pytest.mark.parametrize(
    "name", ["a b.nmea", "-rf.nmea", "день.nmea", "%2e%2e.nmea", "a=b.nmea", "'; --.nmea", "*.nmea", "a\nb.nmea", "=.x"]
)
def test_a_file_may_be_called_anything(mariner: Ship, tmp_path: Path, name: str):
    folder = tmp_path / "logs"
    folder.mkdir()
    (folder / name).write_bytes(b"".join(mariner.lines[:400]))
    output = kempf("ingest", folder / name, "--vessel", "x", "--warehouse", tmp_path / "w", "--json")
    assert output.code == 0
    check_names(tmp_path / "w")
    (row,) = kempf("logs", "list", "--warehouse", tmp_path / "w", "--json").json
    assert row["file_name"] == name
    assert kempf("logs", "rejected", "--warehouse", tmp_path / "w", "--json", "--", name).code == 0
    human = kempf("ingest", folder / name, "--vessel", "x", "--warehouse", tmp_path / "w")
    assert human.code == 0 and len(human.out.splitlines()) == 1 + human.out.count("  note: ")


def test_columns_that_are_called_like_paths(mariner: Ship, tmp_path: Path):
    rows = gzip.decompress(mariner.csv).split(b"\n")
    names = rows[0].decode().split(",")
    hostile = {name: f"../../{name}" for name in names} | {"utc": "/etc/passwd", "heading": "$(touch gotcha)"}
    rows[0] = ",".join(hostile[name] for name in names).encode()
    (tmp_path / "day.csv").write_bytes(b"\n".join(rows))
    source = next(s for s in mariner.profile["sources"] if s["match"] == "*.csv*")
    channels = {hostile[name]: mapped for name, mapped in source["channels"].items()}
    profile = {"vessel": "x", "sources": [{"match": "*.csv", "time": {"column": hostile["utc"]}, "channels": channels}]}
    (tmp_path / "p.yaml").write_text(yaml.safe_dump(profile))
    asked = ("--profile", tmp_path / "p.yaml", "--warehouse", tmp_path / "w", "--json")
    output = kempf("ingest", tmp_path / "day.csv", *asked)
    assert output.code == 0 and len(output.json[0]["segments"]) == 1
    check_names(tmp_path / "w")
    assert outside(tmp_path) == {"day.csv", "p.yaml"}


def test_topics_that_are_called_like_paths(tmp_path: Path):
    out = BytesIO()
    writer = Writer(out)
    writer.start()
    schema = writer.register_schema("../../schema", "jsonschema", b'{"type": "object"}')
    channel = writer.register_channel("../../x", "json", schema)
    writer.register_channel("nul\x00/../../../etc", "json", schema, {"../../x": "/etc/passwd"})
    writer.add_attachment(0, 0, "../../attached", "text/plain", b"not to be written anywhere")
    writer.add_metadata("../../metadata", {"../../key": "/etc/passwd"})
    for k in range(100):
        stamp = 1_746_252_000_000_000_000 + k * 100_000_000
        writer.add_message(channel, stamp, json.dumps({"/etc/passwd": float(k)}).encode(), stamp)
    writer.finish()
    (tmp_path / "day.mcap").write_bytes(out.getvalue())
    mapped = {"../../x./etc/passwd": {"channel": "heading", "unit": "deg"}}
    (tmp_path / "p.yaml").write_text(
        yaml.safe_dump({"vessel": "x", "sources": [{"match": "*.mcap", "channels": mapped}]})
    )
    asked = ("--profile", tmp_path / "p.yaml", "--warehouse", tmp_path / "w", "--json")
    output = kempf("ingest", tmp_path / "day.mcap", *asked)
    assert output.code == 0, output
    assert output.json[0]["records"]["kept"] == 100
    check_names(tmp_path / "w")
    assert outside(tmp_path) == {"day.mcap", "p.yaml"}
