"""Requests that cannot be met: vessels, profiles, models, times and warehouses. One error, and nothing written."""

from __future__ import annotations

import os
from pathlib import Path

import click
import pytest

from kempf.workbench.cli.entry import cli
from kempf.workbench.cli.given_once import GivenOnce
from tests.workbench.driving import kempf, refused, tree

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{new}: &{new} [{', '.join(['*' + old] * 9)}]\n" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGE_BOMB = "a: &a {k: v}\n" + "".join(
    f"{new}: &{new} {{<<: [{', '.join(['*' + old] * 9)}]}}\n" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    "arguments",
    [
        ("segments", "--vessel", "nobody"),
        ("identify", "--vessel", "nobody"),
        ("history", "--vessel", "nobody"),
        ("history", "--vessel", "nobody", "--as-of", "2001-01-01"),
        ("params", "list", "--vessel", "nobody"),
        ("logs", "list", "--vessel", "nobody"),
        ("vessels", "show", "nobody"),
        ("reprocess", "--vessel", "nobody"),
        ("reprocess", "--vessel", "mariner", "--vessel", "nobody"),
    ],
)
def test_a_vessel_that_does_not_exist(filled: Path, arguments: tuple[str, ...]):
    error = refused(kempf(*arguments, "--warehouse", filled, "--json"), 4, "no_vessel")
    assert error["details"] == {"vessel": "nobody", "known": ["mariner"]}
    human = kempf(*arguments, "--warehouse", filled)
    assert (human.code, human.out) == (4, "")
    assert human.err.startswith("error [no_vessel] There is no vessel 'nobody'; known: mariner.\n  ")


@pytest.mark.parametrize(
    "arguments",
    [
        ("diagnose", "--vessel", "mariner", "--set", "ps-1", "--set", "ps-2"),
        ("export", "mcap", "--vessel", "mariner", "--out", "x.mcap", "--set", "ps-1", "--set", "ps-2"),
        ("steer", "--vessel", "mariner", "--set=ps-1", "--set=ps-2"),
        ("effects", "undo", "--vessel", "mariner", "--vessel", "other"),
    ],
)
def test_an_option_given_twice_is_refused_and_not_dropped(filled: Path, arguments: tuple[str, ...]):
    error = refused(kempf(*arguments, "--warehouse", filled, "--json"), 2, "usage")
    assert error["message"].endswith("is given 2 times; this command takes one.")


def test_every_command_refuses_an_option_given_twice():
    def walk(command: click.Command) -> None:
        if not isinstance(command, click.Group):
            assert isinstance(command, GivenOnce), command.name
            return
        with click.Context(command) as context:
            for name in command.list_commands(context):
                inner = command.get_command(context, name)
                assert inner is not None
                walk(inner)

    walk(cli)


@pytest.mark.parametrize(
    "arguments",
    [
        ("segments",),
        ("segments", "--vessel", "x"),
        ("identify", "--vessel", "x"),
        ("history", "--vessel", "x"),
        ("params", "list"),
        ("params", "show", "ps-1"),
        ("params", "diff", "ps-1", "ps-2"),
        ("params", "export", "ps-1"),
        ("rerun", "ps-1"),
        ("reprocess",),
        ("reprocess", "--vessel", "x"),
        ("vessels", "list"),
        ("vessels", "show", "x"),
        ("logs", "list"),
        ("logs", "rejected", "x"),
    ],
)
@pytest.mark.parametrize("kind", ["nothing", "a folder of other things", "a file"])
def test_no_warehouse(tmp_path: Path, arguments: tuple[str, ...], kind: str):
    place = tmp_path / "place"
    if kind == "a file":
        place.write_text("letter")
    elif kind != "nothing":
        place.mkdir()
        (place / "letter.txt").write_text("dear")
    before = tree(tmp_path)
    refused(kempf(*arguments, "--warehouse", place, "--json"), 4, "no_warehouse")
    assert tree(tmp_path) == before


@pytest.mark.parametrize("kind", ["a folder of other things", "a file"])
def test_what_is_no_warehouse_is_not_made_one(logs: Path, tmp_path: Path, kind: str):
    place = tmp_path / "place"
    if kind == "a file":
        place.write_text("letter")
    else:
        place.mkdir()
        (place / "letter.txt").write_text("dear")
    before = tree(tmp_path)
    asked = ("--profile", logs / "profile.yaml", "--warehouse", place, "--json")
    refused(kempf("ingest", logs / "mariner.csv.gz", *asked), 2, "not_a_warehouse")
    refused(kempf("vessels", "set", "mariner", *asked), 2, "not_a_warehouse")
    assert tree(tmp_path) == before


@pytest.mark.parametrize(
    ("marker", "code"),
    [
        (b"{", "warehouse_marker_damaged"),
        (b'{"layout": 99}', "warehouse_layout"),
        (b'{"layout": 2}', "warehouse_layout_old"),
    ],
)
def test_a_warehouse_of_another_time(tmp_path: Path, marker: bytes, code: str):
    (tmp_path / "kempf-warehouse.json").write_bytes(marker)
    refused(kempf("segments", "--warehouse", tmp_path, "--json"), 1, code)
    assert len(tree(tmp_path)) == 1


@pytest.mark.parametrize("uri", ["", " ", "a%20b", "runs[1]", "a=b"])
def test_an_address_that_cannot_be_one(logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, uri: str):
    monkeypatch.chdir(tmp_path)
    asked = ("--profile", logs / "profile.yaml", "--warehouse", uri, "--json")
    refused(kempf("ingest", logs / "mariner.csv.gz", *asked), 2, "warehouse_path")
    assert tree(tmp_path) == {}


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_warehouse_that_cannot_be_written(logs: Path, tmp_path: Path):
    tmp_path.chmod(0o500)
    try:
        asked = ("--profile", logs / "profile.yaml", "--warehouse", tmp_path / "w", "--json")
        refused(kempf("ingest", logs / "mariner.csv.gz", *asked), 1, "warehouse_not_writable")
        assert tree(tmp_path) == {}
    finally:
        tmp_path.chmod(0o700)


def test_a_disk_that_is_full(logs: Path, tmp_path: Path):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    (tmp_path / "w").symlink_to("/dev/full")  # opens, and takes not one byte
    asked = ("--profile", logs / "profile.yaml", "--warehouse", tmp_path / "w", "--json")
    output = kempf("ingest", logs / "mariner.csv.gz", *asked)
    assert output.code in (1, 2)
    assert set(output.json) == {"error"}


@pytest.mark.parametrize("time", ["yesterday", "2025-13-01", "12:00", "", "0001-01-01T00:00:00+23:00", "nan"])
def test_a_time_that_is_none(filled: Path, time: str):
    asked = ("--vessel", "mariner", "--as-of", time, "--warehouse", filled, "--json")
    assert "2025-05-03T12:00:00Z" in refused(kempf("history", *asked), 2, "not_a_time")["next_step"]


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("vessel: [unclosed", "not_yaml", "line 1"),
        ("\tvessel: x", "not_yaml", "line 1"),
        ("vessel: x\n---\nvessel: y\n", "not_yaml", "single document"),
        ("a: \x00", "not_yaml", ""),
        ("length_m: " + "1" * 5000, "not_yaml", ""),
        ("[" * 5000, "not_yaml", "nested"),
        ("vessel: !!python/object/apply:os.system ['touch gotcha']", "not_yaml", "python/object"),
        ("vessel: !!python/name:os.system", "not_yaml", "python/name"),
        ("!!python/object/new:os.system [touch gotcha]", "not_yaml", "python/object"),
        ("vessel: x\nlength_m: 5\nvessel: y\n", "not_yaml", "'vessel' is written twice, in lines 1 and 3"),
        ("antenna:\n  up_m: 1\n  up_m: 2\n", "not_yaml", "'up_m' is written twice, in lines 2 and 3"),
        (BOMB, "yaml_too_large", "100000"),
        (MERGE_BOMB, "yaml_too_large", "100000"),
        ("a: &a [*a]", "yaml_too_large", "100000"),
        ("a: &a {<<: *a}", "yaml_too_large", "100000"),
        ("", "profile_not_a_mapping", "NoneType"),
        ("just a sentence", "profile_not_a_mapping", "str"),
        ("- vessel: x", "profile_not_a_mapping", "list"),
        ("vessel: x\nlenght_m: 3\n", "profile_invalid", "lenght_m"),
        ("1: x\n", "profile_invalid", "1"),
        ("length_m: -3", "profile_invalid", "length_m"),
        ("length_m: long", "profile_invalid", "length_m"),
        ("block_coefficient: 1.5", "profile_invalid", "block_coefficient"),
        ("sources: [{match: '*.csv', channels: {a: {channel: heading, unit: furlong}}}]", "", "furlong"),
        ("sources: [{match: '*.csv', channels: {a: {channel: heading, unit: kn}}}]", "", "kn"),
        ("sources: [{match: '*.csv', channels: {a: {channel: mood, unit: deg}}}]", "profile_invalid", "mood"),
        ("sources: [{channels: {}}]", "profile_invalid", "match"),
        ("sources: [{match: '*', time: {column: t, start: 2025-05-03T06:00:00}}]", "profile_invalid", "start"),
    ],
)
def test_a_profile_that_is_none(logs: Path, own: Path, tmp_path: Path, text: str, code: str, message: str):
    profile = tmp_path / "profile.yaml"
    profile.write_text(text, encoding="utf-8")
    before = tree(own)
    for arguments in (("ingest", logs / "mariner.mcap", "--vessel", "mariner"), ("vessels", "set", "mariner")):
        ran = kempf(*arguments, "--profile", profile, "--warehouse", own, "--json")
        error = refused(ran, 2, code or ran.json["error"]["code"])
        assert message in error["message"]
        assert "profile.yaml" in error["message"] or not code
        assert len(error["message"]) < 2000
    assert tree(own) == before
    assert not Path("gotcha").exists()


def test_aliases_that_a_person_writes_are_fine(tmp_path: Path):
    profile = tmp_path / "p.yaml"
    profile.write_text(
        "vessel: x\nsources:\n  - match: '*.csv'\n    time: {column: t}\n    channels: &all\n"
        "      h: {channel: heading, unit: deg}\n  - match: '*.txt'\n    channels: *all\n"
    )
    output = kempf("vessels", "set", "x", "--profile", profile, "--warehouse", tmp_path / "w", "--json")
    assert output.json == {"vessel": "x", "changed": True}


def test_profiles_that_disagree(logs: Path, own: Path, tmp_path: Path):
    one, other = tmp_path / "one.yaml", tmp_path / "other.yaml"
    one.write_text("vessel: mariner\nlength_m: 160.0\n")
    other.write_text("length_m: 161.0\n")
    before, log = tree(own), logs / "mariner.mcap"
    asked = ("--warehouse", own, "--json")
    both = ("--profile", one, "--profile", other)
    error = refused(kempf("ingest", log, *both, *asked), 2, "profiles_disagree")
    assert "160.0" in error["message"] and "161.0" in error["message"] and "other.yaml" in error["message"]
    refused(kempf("vessels", "set", "mariner", *both, *asked), 2, "profiles_disagree")
    error = refused(kempf("ingest", log, "--vessel", "aurora", "--profile", one, *asked), 2, "profiles_disagree")
    assert error["details"] == {"option": "aurora", "profile": "mariner"}
    refused(kempf("vessels", "set", "aurora", "--profile", one, *asked), 2, "profiles_disagree")
    for name, column in ((one, "a"), (other, "b")):
        name.write_text(f"vessel: mariner\nsources: [{{match: '*.csv', time: {{column: {column}}}}}]\n")
    assert "'*.csv'" in refused(kempf("ingest", log, *both, *asked), 2, "profiles_disagree")["message"]
    assert tree(own) == before


def test_nobody_says_whose_the_log_is(logs: Path, tmp_path: Path):
    refused(kempf("ingest", logs / "mariner.nmea.gz", "--warehouse", tmp_path / "w", "--json"), 2, "no_vessel_named")
    refused(kempf("vessels", "set", "x", "--warehouse", tmp_path / "w", "--json"), 2, "no_profile_given")
    assert tree(tmp_path) == {}


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("nmae: x", "model_invalid", "nmae"),
        ("- name: x", "model_invalid", "model"),
        ("", "model_invalid", "model"),
        ("current: sideways", "model_invalid", "found 'sideways', expected 'earth', 'lateral' or 'none'"),
        ("effects: 3", "model_invalid", "effects: found 3, expected a list"),
        ("wind_correlation_rate_per_s: 0", "model_invalid", "wind_correlation_rate_per_s"),
        ("effects: [sails]", "model_unknown", "sails"),
        ("base: guesswork", "model_unknown", "guesswork"),
        ("name: [", "not_yaml", "did not find expected node content"),
        ("name: x\nname: y\n", "not_yaml", "'name' is written twice, in lines 1 and 2"),
        (BOMB, "yaml_too_large", "100000"),
    ],
)
def test_a_model_that_is_none(filled: Path, tmp_path: Path, text: str, code: str, message: str):
    model = tmp_path / "model.yaml"
    model.write_text(text)
    asked = ("--vessel", "mariner", "--model", model, "--warehouse", filled, "--json")
    assert message in refused(kempf("identify", *asked), 2, code)["message"]


def test_files_that_are_not_there(filled: Path, logs: Path):
    gone = logs / "gone"
    asked = ("--vessel", "mariner", "--warehouse", filled, "--json")
    error = refused(kempf("ingest", logs / "marine.csv.gz", *asked), 4, "no_such_file")
    assert "mariner.csv.gz" in error["next_step"]
    assert refused(kempf("ingest", gone, *asked), 4, "no_such_file")["next_step"] == "Check the path."
    refused(kempf("identify", "--model", gone, *asked), 4, "no_such_file")
    refused(kempf("ingest", logs / "mariner.mcap", "--profile", gone, *asked), 4, "no_such_file")
    refused(kempf("identify", "--model", logs, *asked), 2, "path_is_directory")
    refused(kempf("ingest", logs / "mariner.mcap" / "inside", *asked), 1, "file_unreadable")
    refused(kempf("ingest", "a" * 5000, *asked), 1, "file_unreadable")
    refused(kempf("ingest", "", *asked), 2, "path_is_directory")


def test_the_demonstration_where_nothing_can_be_written(tmp_path: Path):
    refused(kempf("demo", "--folder", tmp_path / "a=b", "--json"), 2, "warehouse_path")
    assert tree(tmp_path) == {}
