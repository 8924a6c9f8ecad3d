"""The file kempf.toml: what it sets, what goes before it, what is wrong with it; the lines that a log level shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from kempf.flows.process.configuration import every, setting
from kempf.schemas.settings import VARIABLES
from kempf.workbench.notebook.warehouse_view import open_warehouse
from tests.conftest import Ship
from tests.workbench.driving import kempf, process, refused


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for variable in (*VARIABLES.values(), "KEMPF_CONFIG"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(place: Path, text: str) -> Path:
    (place / "kempf.toml").write_text(text, encoding="utf-8")
    return place / "kempf.toml"


def shown() -> dict[str, dict[str, str]]:
    return {one["name"]: one for one in kempf("config", "--json").json}


def test_a_variable_goes_before_the_file_and_an_option_before_both(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert {one["value"] for one in shown().values()} == {None}
    assert kempf("vessels", "list").err.count("no warehouse at kempf-data") == 1
    path = write(place, 'warehouse = "of_the_file"\n[metrics]\ntextfile = "/var/lib/metrics"\n')
    found = shown()
    assert found["warehouse"] == {"name": "warehouse", "value": "of_the_file", "source": str(path)}
    assert found["metrics.textfile"]["value"] == "/var/lib/metrics" and found["dask"]["source"] is None
    assert "no warehouse at of_the_file" in kempf("vessels", "list").err
    assert open_warehouse().warehouse.uri == "of_the_file"
    monkeypatch.setenv("KEMPF_WAREHOUSE", "of_the_variable")
    assert shown()["warehouse"] == {"name": "warehouse", "value": "of_the_variable", "source": "KEMPF_WAREHOUSE"}
    assert "no warehouse at of_the_variable" in kempf("vessels", "list").err
    assert "no warehouse at of_the_option" in kempf("vessels", "list", "--warehouse", "of_the_option").err


def test_the_file_is_the_one_that_is_named_or_here_or_at_home(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    home = place / "home"
    (home / "kempf").mkdir(parents=True)
    (home / "kempf" / "kempf.toml").write_text('inbox = "at_home"')
    monkeypatch.setenv("XDG_CONFIG_HOME", str(home))
    assert setting("inbox") == "at_home"
    write(place, 'inbox = "here"')
    assert setting("inbox") == "here"
    (place / "other.toml").write_text('inbox = "named"')
    monkeypatch.setenv("KEMPF_CONFIG", str(place / "other.toml"))
    assert setting("inbox") == "named" and len(every()) == len(VARIABLES)
    monkeypatch.setenv("KEMPF_CONFIG", str(place / "none.toml"))
    error = refused(kempf("config", "--json"), 4, "no_configuration")
    assert "none.toml" in error["message"]


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ('warehuose = "x"', "configuration_invalid", "warehuose"),
        ("warehouse = 3", "configuration_invalid", "warehouse"),
        ('log_level = "loud"', "configuration_invalid", "log_level"),
        ("[metrics]\nport = 9100", "configuration_invalid", "port"),
        ("warehouse = \n", "configuration_invalid", "line 1"),
        ('AWS_SECRET_ACCESS_KEY = "s"', "secret_in_configuration", "AWS_SECRET_ACCESS_KEY"),
    ],
)
def test_what_is_wrong_with_the_file_is_said(place: Path, text: str, code: str, said: str) -> None:
    write(place, text)
    for arguments in (("config", "--json"), ("vessels", "list", "--json")):
        error = refused(kempf(*arguments), 2, code)
        assert said in error["message"] and "kempf.toml" in error["message"]


def test_a_log_level_is_one(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEMPF_LOG_LEVEL", "loud")
    assert "KEMPF_LOG_LEVEL" in refused(kempf("config", "--json"), 2, "log_level_unknown")["message"]
    assert kempf("--log-level", "info", "config").code == 0


def test_lines_say_what_a_command_does_and_leave_its_document_alone(place: Path, ferry: Ship) -> None:
    ferry.write(place)
    asked = ("ingest", "ferry.csv.gz", "--profile", "profile.yaml", "--json")
    quiet = process(*asked, "--warehouse", "quiet", cwd=place)
    assert quiet.code == 0 and "ferry.csv.gz of" not in quiet.err
    spoken = process("--log-level", "info", *asked, "--warehouse", "spoken", cwd=place)
    assert "INFO kempf.jobs: ferry.csv.gz of ferry: " in spoken.err and "version" not in spoken.err
    assert json.loads(spoken.out) == json.loads(quiet.out)
    write(place, 'log_level = "debug"')
    all_of_it = process(*asked, "--warehouse", "all", cwd=place)
    assert "DEBUG kempf.warehouse: table readings: version 1 is committed" in all_of_it.err


def test_an_inbox_that_is_set_needs_no_path(place: Path) -> None:
    error = refused(kempf("inbox", "--json"), 2, "no_inbox")
    assert "KEMPF_INBOX" in error["next_step"]
    (place / "arrivals").mkdir()
    write(place, 'inbox = "arrivals"\nwarehouse = "w"')
    assert kempf("inbox", "--json").json["inbox"].endswith("arrivals")
