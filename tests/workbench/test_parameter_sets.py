"""The commands about parameter sets: made, listed, shown, compared, exported, followed over time, built again."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from kempf.workbench.parameter_set_table import print_parameter_set
from tests.conftest import Ship
from tests.workbench.driving import HULL, kempf, one_of, refused, sets

#: Keys that people script against: DESIGN's, which may be joined by more but never lost.
PARAMETER_SET = {"parameter_set_id", "vessel", "model", "estimator", "parameters", "noise", "fit", "provenance"}


def test_identify_gives_the_sets_of_params_show(filled: Path):
    found = kempf("identify", "--vessel", "mariner", "--warehouse", filled, "--json").json
    assert len(found) == 2
    for one in found:
        assert set(one) >= PARAMETER_SET
        assert list(one["parameters"]) == HULL
        assert all(set(p) == {"value", "std", "unit"} for p in (*one["parameters"].values(), *one["noise"].values()))
        assert kempf("params", "show", one["parameter_set_id"], "--warehouse", filled, "--json").json == {
            key: value for key, value in one.items() if key != "not_pooled"
        }
        provenance = one["provenance"]
        assert provenance["inputs"]["log_ids"] and provenance["packages"] and provenance["table_versions"]


def test_identify_for_a_person(own: Path):
    output = kempf("identify", "--vessel", "mariner", "--estimator", "least-squares", "--warehouse", own)
    assert output.code == 0
    assert all(f"\n{name} " in output.out for name in HULL)
    assert "converged" in output.out and "next: kempf history" in output.out


def test_what_predictions_take_is_shown_beside_what_the_likelihood_says(
    filled: Path, capsys: pytest.CaptureFixture[str]
):
    stored = parameter_sets.get(Warehouse(str(filled)), one_of(filled, "ml"))
    print_parameter_set(stored, "a set", legs_too=True)
    assert "by legs" not in capsys.readouterr().out
    ahead = {
        "parameters": {name: {"value": 1.25 + k} for k, name in enumerate(HULL)},
        "covariance": np.diag(np.arange(1.0, 7.0) ** 2).tolist(),
        "better_than_one_step": {"falls_by": 0.5},
        **{"fitted_misfit": 1.0, "left_out_misfit": 4.0},  # errors are twice as wide
    }
    print_parameter_set(replace(stored, fit={"rung": {"one_leg_ahead": ahead}}), "a set", legs_too=True)
    shown = capsys.readouterr().out
    assert re.search(r"^a12 +\S+ +\S+ +2\.25 +4 ", shown, re.MULTILINE), shown
    assert "predictions of manoeuvres take these" in shown


def test_identify_with_a_model_of_its_own(own: Path, tmp_path: Path):
    model = tmp_path / "model.yaml"
    model.write_text("name: stream\ncurrent: lateral\n")
    asked = ("--vessel", "mariner", "--model", model, "--estimator", "least-squares", "--warehouse", own, "--json")
    found = kempf("identify", *asked).json
    assert [one["model"]["name"] for one in found] == ["stream", "stream"]
    assert len(sets(own)) == 6


def test_params_list(filled: Path):
    listed = sets(filled)
    assert [one["estimator"] for one in listed].count("ml") == 2
    assert sum("current" in one["aliases"] for one in listed) == 1
    output = kempf("params", "list", "--vessel", "mariner", "--warehouse", filled)
    assert output.code == 0 and output.out.count("\nps-") == 4


def test_params_show_by_a_beginning(filled: Path):
    whole = one_of(filled, "ml")
    output = kempf("params", "show", whole[:9], "--warehouse", filled)
    assert output.code == 0
    assert output.out.startswith(f"{whole}: mariner, model plain, estimator ml")
    assert "Discrete, eq. (17)" in output.out
    refused(kempf("params", "show", "ps-", "--warehouse", filled, "--json"), 2, "ambiguous_parameter_set")
    refused(kempf("params", "show", "ps-zzz", "--warehouse", filled, "--json"), 4, "no_parameter_set")
    refused(kempf("params", "show", "", "--warehouse", filled, "--json"), 4, "no_parameter_set")


def test_params_diff(filled: Path):
    first, second = one_of(filled, "ml"), one_of(filled, "least-squares")
    output = kempf("params", "diff", first, second, "--warehouse", filled, "--json").json
    assert list(output["parameters"]) == HULL
    b2 = output["parameters"]["b2"]
    assert b2["difference"] == b2["second"] - b2["first"]
    same = kempf("params", "diff", first, first, "--warehouse", filled, "--json").json
    assert {p["in_std"] for p in same["parameters"].values()} == {0.0}
    assert kempf("params", "diff", first, second, "--warehouse", filled).out.count("\n") == 7


@pytest.mark.parametrize("form", ["yaml", "csv", "json"])
def test_params_export(filled: Path, tmp_path: Path, form: str):
    name = one_of(filled, "ml")
    shown = kempf("params", "show", name, "--warehouse", filled, "--json").json
    printed = kempf("params", "export", name, "--format", form, "--warehouse", filled)
    assert printed.code == 0
    if form == "csv":
        rows = {row["name"]: row for row in csv.DictReader(printed.out.splitlines()) if row["group"] == "parameters"}
        assert {n: float(row["value"]) for n, row in rows.items()} == {n: shown["parameters"][n]["value"] for n in HULL}
        assert all(row["unit"] == shown["parameters"][n]["unit"] for n, row in rows.items())
    else:
        content = yaml.safe_load(printed.out) if form == "yaml" else json.loads(printed.out)
        assert content == {key: value for key, value in shown.items() if key != "iterations"}
    output = tmp_path / "set"
    assert kempf("params", "export", name, "--format", form, "--output", output, "--warehouse", filled).code == 0
    assert output.read_text() == printed.out
    again = kempf("params", "export", name, "--output", output, "--warehouse", filled, "--json")
    refused(again, 2, "cannot_write")
    assert output.read_text() == printed.out


def test_history_as_known_now_and_before_anything_was(filled: Path):
    output = kempf("history", "--vessel", "mariner", "--parameter", "b2", "--warehouse", filled, "--json").json
    assert len(output) == 4
    assert set(output[0]) >= {"parameter_set_id", "start", "parameter", "value", "std", "unit", "model", "estimator"}
    assert [one["start"] for one in output] == sorted(one["start"] for one in output)
    long_ago = ("--as-of", "2001-01-01", "--warehouse", filled)
    assert kempf("history", "--vessel", "mariner", *long_ago, "--json").json == []
    assert "No parameter set" in kempf("history", "--vessel", "mariner", *long_ago).out
    later = kempf("history", "--vessel", "mariner", "--as-of", "9999-12-31T23:59:59Z", "--warehouse", filled, "--json")
    assert len(later.json) == 24
    asked = kempf("history", "--vessel", "mariner", "--parameter", "zz", "--warehouse", filled, "--json")
    assert refused(asked, 2, "no_parameter")["details"]["known"] == HULL
    lines = kempf("history", "--vessel", "mariner", "--warehouse", filled).out.splitlines()
    # one table of each estimator: its title and its head, then a row a value
    assert len(lines) == 2 * len({one["estimator"] for one in output}) + 24


def test_history_leaves_out_what_a_newer_profile_superseded(own: Path, logs: Path, tmp_path: Path):
    (tmp_path / "p.yaml").write_text("wind_arm_per_m: 0.001\n")
    asked = ("--vessel", "mariner", "--profile", tmp_path / "p.yaml", "--warehouse", own)
    assert kempf("ingest", logs / "mariner.nmea.gz", *asked).code == 0
    whose = ("--vessel", "mariner", "--parameter", "b2", "--warehouse", own)
    assert len(kempf("history", *whose, "--json").json) == 2
    every = kempf("history", *whose, "--all", "--json").json
    assert [row["superseded"] for row in every].count(True) == 2 and len(every) == 4
    assert kempf("history", *whose, "--all").out.count(" superseded") == 2


def test_rerun_is_bit_identical(filled: Path):
    for name in (one_of(filled, "ml"), one_of(filled, "least-squares")):
        output = kempf("rerun", name, "--warehouse", filled, "--json")
        assert output.code == 0
        assert output.json["verdict"] == "bit-identical"
        assert (output.json["differences"], output.json["code_changed"]) == ([], False)
    assert kempf("rerun", name, "--warehouse", filled).out == f"{name}: bit-identical\n"
    refused(kempf("rerun", "ps-zzz", "--warehouse", filled, "--json"), 4, "no_parameter_set")


def test_rerun_of_a_tampered_set_says_where_it_differs(own: Path):
    name = one_of(own, "least-squares")
    table = delta.ensure_table(Warehouse(str(own)), "parameter_sets")
    (row,) = delta.rows(table, "parameter_sets", {"parameter_set_id": name}).rows(named=True)
    row["parameters"][5]["value"] *= 1 + 1e-6
    delta.replace(table, "parameter_sets", [row], f"parameter_set_id = '{name}'")
    output = kempf("rerun", name, "--warehouse", own, "--json")
    assert output.code == 5
    assert output.json["verdict"] == "different"
    assert [one["field"] for one in output.json["differences"]] == ["parameters.b2.value"]
    assert output.json["differences"][0]["relative"] == pytest.approx(1e-6, rel=0.1)
    human = kempf("rerun", name, "--warehouse", own)
    assert human.code == 5 and "parameters.b2.value" in human.out
    within = kempf("rerun", name, "--tolerance", "1e-5", "--warehouse", own, "--json")
    assert (within.code, within.json["verdict"]) == (0, "equal within tolerance")


def test_a_damaged_raw_log_is_reported_and_repaired_by_the_original(own: Path, logs: Path):
    name = one_of(own, "least-squares")
    for kept in (own / "raw").rglob("*"):
        if kept.is_file():
            kept.write_bytes(kept.read_bytes()[:-1])
    error = refused(kempf("rerun", name, "--warehouse", own, "--json"), 1, "raw_bytes_damaged")
    assert "Ingest the original" in error["next_step"]
    again = kempf("ingest", *logs.glob("*gz"), "--vessel", "mariner", "--warehouse", own)
    assert again.code == 0
    assert kempf("rerun", name, "--warehouse", own, "--json").json["verdict"] == "bit-identical"


def test_identify_where_nothing_can_be_identified(mariner: Ship, tmp_path: Path):
    blind = tmp_path / "blind.nmea"  # a zigzag without GNSS
    blind.write_bytes(b"".join(line for line in mariner.lines if b"$GP" not in line))
    place = tmp_path / "w"
    assert kempf("ingest", blind, "--vessel", "mariner", "--warehouse", place).code == 0
    output = kempf("identify", "--vessel", "mariner", "--warehouse", place, "--json")
    assert output.code == 3
    (one,) = output.json
    assert set(one) == {"segment_id", "error"} and one["error"]["code"] == "channel_missing"
    human = kempf("identify", "--vessel", "mariner", "--warehouse", place)
    assert human.code == 3 and "not identified [channel_missing]" in human.err
    assert sets(place) == []
