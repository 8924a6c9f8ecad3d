"""The doctor on the command line, at ingest, and wherever the log is used."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from kempf.flows.jobs.identify.parameter_set_of import channel_warnings
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, logs
from tests.doctor import closed_form_ship
from tests.workbench.driving import kempf


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    names = ("heading", "yaw_rate", "rudder_angle", "speed_over_ground", "course_over_ground")
    (tmp_path / "made.csv").write_bytes(closed_form_ship.text(closed_form_ship.channels(*names)))
    for name, spoilt in (("wrong", {"rudder": {"positive": "port"}}), ("right", {})):
        content = closed_form_ship.profile(*names, **spoilt).model_dump(mode="json", exclude_defaults=True)
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return tmp_path


LINE = "rudder: {channel: rudder_angle, unit: deg}"


def test_a_file_and_its_figure(folder: Path) -> None:
    output = kempf("doctor", folder / "made.csv", "--profile", folder / "wrong.yaml", "--figure", folder / "a.png")
    assert output.code == 0
    assert "rudder_angle has the wrong sign" in output.out
    assert LINE in output.out
    assert (folder / "a.png").stat().st_size > 10_000
    again = kempf("doctor", folder / "made.csv", "--profile", folder / "wrong.yaml", "--figure", folder / "a.png")
    assert again.code == 2
    clean = kempf("doctor", folder / "made.csv", "--profile", folder / "right.yaml", "--json").json
    assert (clean["verdict"], clean["findings"]) == ("clean", [])
    assert {c["state"] for c in clean["checks"]} == {"agree"}


def test_every_ingest_and_every_list(folder: Path) -> None:
    place = folder / "warehouse"
    output = kempf("ingest", folder / "made.csv", "--profile", folder / "wrong.yaml", "--warehouse", place)
    assert "channels: rudder_angle has the wrong sign" in output.out
    (log,) = kempf("logs", "list", "--warehouse", place, "--json").json
    assert log["channels"] == {"verdict": "faults", "findings": ["rudder_angle has the wrong sign"]}
    shown = kempf("logs", "show", log["log_id"][:10], "--warehouse", place)
    assert LINE in shown.out
    assert LINE in kempf("doctor", log["log_id"][:10], "--warehouse", place).out
    again = kempf("ingest", folder / "made.csv", "--vessel", "made", "--warehouse", place, "--json").json
    assert (again[0]["outcome"], again[0]["channels"]["verdict"]) == ("unchanged", "faults")
    mended = kempf("ingest", folder / "made.csv", "--profile", folder / "right.yaml", "--warehouse", place)
    assert "channels:" not in mended.out
    assert kempf("logs", "list", "--warehouse", place, "--json").json[0]["channels"]["verdict"] == "clean"


def test_segments_show_it(folder: Path) -> None:
    place = folder / "warehouse"
    kempf("ingest", folder / "made.csv", "--profile", folder / "wrong.yaml", "--warehouse", place)
    for segment in kempf("segments", "--warehouse", place, "--json").json:
        assert segment["channels"] == ["rudder_angle has the wrong sign"]


def test_a_set_warns_of_its_logs() -> None:
    assert channel_warnings({"channels": {"a" * 64: ["rudder_angle has the wrong sign"]}}) == (
        f"channels of log {'a' * 12}: rudder_angle has the wrong sign; see `kempf doctor {'a' * 12}`",
    )
    assert channel_warnings({}) == ()


def test_a_doctor_who_fails_costs_no_log(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("nothing to divide by")

    monkeypatch.setattr("kempf.flows.jobs.ingest.search_log.examine_instruments", broken)
    place = Warehouse(str(folder / "warehouse"))
    from kempf.flows.jobs.ingest.files import read_profiles

    (outcome,) = ingest(place, [folder / "made.csv"], "made", read_profiles([folder / "right.yaml"]))
    assert outcome.error is None
    (row,) = logs.current(place)
    seen = examinations.of_ingests(place, [row.ingest_id])[row.ingest_id]
    assert seen.verdict == "failed"
    assert "nothing to divide by" in seen.content["why"]


def test_an_examination_is_kept_once(folder: Path) -> None:
    place = Warehouse(str(folder / "w"))
    one = examinations.StoredExamination("made", "i" * 16, "l" * 64, "c" * 16, "clean", (), {"checks": []})
    assert examinations.replace(place, [one])
    assert not examinations.replace(place, [one])
    assert examinations.of_ingests(place, ["i" * 16, "none"]) == {"i" * 16: one}


def test_a_dropout_of_the_rate_of_turn_is_left_out_and_accuses_nothing(folder: Path) -> None:
    lines = (folder / "made.csv").read_text(encoding="utf-8").splitlines()
    column = lines[0].split(",").index("rot")
    cells = lines[len(lines) // 2].split(",")
    lines[len(lines) // 2] = ",".join([*cells[:column], "-999", *cells[column + 1 :]])
    (folder / "made.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    asked = ("doctor", folder / "made.csv", "--profile", folder / "right.yaml")
    said = "1 reading of yaw_rate left out: it leaps away and back as no ship turns"
    content = kempf(*asked, "--json").json
    assert (content["verdict"], content["left_out"]) == ("clean", [said])
    assert said in kempf(*asked).out
