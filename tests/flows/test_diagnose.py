"""The diagnosis through a warehouse: stored once, added to, gone back from, built again bit for bit; its commands."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import copy, copytree
from typing import Any

import pytest
from prefect.logging import disable_run_logger

from benchmarks.diagnose import late_rudder
from kempf.flows.fleet.diagnosis_summary import summary
from kempf.flows.fleet.flows import diagnose_batch
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import code_changed, inputs_of, rerun
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets
from tests.flows.content import fresh
from tests.late import SOME, VESSEL, some_effects
from tests.workbench.driving import kempf, refused


@dataclass(frozen=True, eq=False)
class Late:
    """A warehouse with three zigzags of a ship whose rudder answers late by ``tau_s``."""

    warehouse: Warehouse
    tau_s: float

    def kempf(self, *arguments: object) -> Any:
        return kempf(*arguments, "--warehouse", Path(self.warehouse.uri))

    def json(self, *arguments: object) -> Any:
        ran = self.kempf(*arguments, "--json")
        assert ran.code == 0, ran
        return ran.json


@pytest.fixture(scope="module")
def late(late_diagnosed: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Late]:
    folder = copytree(late_diagnosed, tmp_path_factory.mktemp("late") / "diagnosed")
    with some_effects():
        yield Late(fresh(folder / "w"), late_rudder.LAG_S)


@pytest.fixture(scope="module")
def diagnosed(late_diagnosed: Path) -> dict[str, Any]:
    """What `kempf diagnose` answered."""
    return dict(json.loads((late_diagnosed / "diagnosed.json").read_text(encoding="utf-8")))


def test_the_command_keeps_the_keys_that_people_script_against(late: Late, diagnosed: dict[str, Any]) -> None:
    keys = {"vessel", "parameter_set_id", "verdict", "candidates", "sets", "where", "ladder"}
    assert keys <= set(diagnosed)
    assert diagnosed["vessel"] == VESSEL and diagnosed["verdict"] == "explained"
    wanted = ("effect", "set_id", "score", "p_adjusted", "expected_change", "absorption", "verdict", "why")
    assert {c["effect"] for c in diagnosed["candidates"]} == set(SOME)
    assert all(set(wanted) <= set(c) for c in diagnosed["candidates"])
    lag = next(c for c in diagnosed["candidates"] if c["effect"] == "rudder_lag")
    assert set(lag["expected_change"]["tau"]) == {"value", "std", "unit"} and lag["verdict"] == "present"
    (only,) = diagnosed["sets"]
    assert {"set_id", "effects", "separated_by"} <= set(only) and only["effects"] == ["rudder_lag"]
    assert only["set_id"] == lag["set_id"]
    rungs = diagnosed["ladder"]
    assert [one["added"] for one in rungs] == [None, "rudder_lag"]
    assert {"step", "added", "in_sample_error", "held_out_error", "disturbance_intensity"} <= set(rungs[0])
    assert rungs[1]["held_out_error"] < 0.8 * rungs[0]["held_out_error"]
    found = rungs[1]["effects"]["rudder_lag.tau"]
    assert abs(found["value"] - late.tau_s) < 3.0 * found["std"]
    where = diagnosed["where"]
    assert {"by_phase", "by_side", "by_bin", "by_run", "by_band"} <= set(where)
    assert where["sample"] == "held_out" and where["beside"] == ["rudder_lag"]
    assert set(where["by_run"]) == set(diagnosed["held_out"]) and "execute" in where["by_phase"]
    assert parameter_sets.get(late.warehouse, diagnosed["parameter_set_id"]).model_spec["effects"] == []


def test_what_was_diagnosed_is_not_computed_again(late: Late, diagnosed: dict[str, Any]) -> None:
    found, new = diagnose_vessel(late.warehouse, VESSEL, ModelSpec())
    assert not new and found.diagnosis_id == diagnosed["diagnosis_id"]
    assert found.as_json() == diagnosed
    text = late.kempf("diagnose", "--vessel", VESSEL)
    assert text.code == 0 and f"{VESSEL}: explained" in text.out and "next: kempf effects add rudder_lag" in text.out


def test_the_summary_of_the_fleet_has_a_row_an_effect_and_vessel(diagnosed: dict[str, Any]) -> None:
    failed = {"vessel": "lost", "verdict": "failed", "error": {"code": "no_segments", "message": "No zigzag."}}
    fine = {"vessel": "sound", "verdict": "adequate", "sets": [], "ladder": diagnosed["ladder"][:1]}
    rows = summary([diagnosed, failed, fine])
    assert [(r["vessel"], r["verdict"], r["effects"]) for r in rows] == [
        (VESSEL, "explained", "rudder_lag"),
        ("lost", "failed", ""),
        ("sound", "adequate", ""),
    ]
    assert rows[0]["since"] and rows[0]["held_out_after"] < rows[0]["held_out_before"]
    assert rows[1]["note"] == "No zigzag." and rows[2]["held_out_before"] == rows[2]["held_out_after"]


def test_an_effect_is_added_gone_back_from_and_built_again(late: Late, diagnosed: dict[str, Any]) -> None:
    refused(late.kempf("ladder", "--vessel", VESSEL, "--json"), 4, "no_model")
    added = late.json("effects", "add", "rudder_lag", "--vessel", VESSEL)
    made = added["set"]
    assert added["after"]["held_out_error"] < 0.8 * added["before"]["held_out_error"]
    # the diagnosis and the model by hand end at the same numbers
    for key in ("in_sample_error", "held_out_error", "log_likelihood", "hull", "effects"):
        assert added["after"][key] == diagnosed["ladder"][1][key], key
    stored = parameter_sets.get(late.warehouse, made["parameter_set_id"])
    assert stored.parent == diagnosed["parameter_set_id"] and stored.estimator == "ml-pooled"
    assert len(stored.parameters) == 7 and len(stored.covariance) == 7
    assert aliases.of_vessel(late.warehouse, VESSEL)["current"] == stored.parameter_set_id
    again = rerun(late.warehouse, stored.parameter_set_id)
    assert again.verdict == "bit-identical" and not again.code_changed
    inputs = inputs_of(stored)
    assert code_changed(replace(inputs, settings={**inputs.settings, "effects": {"rudder_lag": "another"}}))
    rungs = late.json("ladder", "--vessel", VESSEL)
    assert [one["parameter_set_id"] for one in rungs] == [stored.parent, stored.parameter_set_id]
    refused(late.kempf("effects", "add", "rudder_lag", "--vessel", VESSEL, "--json"), 2, "effect_there")
    assert late.json("effects", "undo", "--vessel", VESSEL)["parameter_set_id"] == stored.parent
    assert len(late.json("ladder", "--vessel", VESSEL)) == 1
    refused(late.kempf("effects", "undo", "--vessel", VESSEL, "--json"), 4, "no_parent")
    again = late.json("effects", "add", "rudder_lag", "--vessel", VESSEL)
    assert again["set"]["parameter_set_id"] == stored.parameter_set_id
    assert "rudder_lag" in late.kempf("ladder", "--vessel", VESSEL).out


def test_a_model_with_effects_is_a_parameter_set_like_any_other(late: Late, diagnosed: dict[str, Any]) -> None:
    plain_set = diagnosed["parameter_set_id"]
    name = aliases.of_vessel(late.warehouse, VESSEL)["current"]
    listed = {one["parameter_set_id"]: one for one in late.json("params", "list", "--vessel", VESSEL)}
    assert listed[name]["aliases"] == ["current"] and listed[name]["model_name"] == "plain + rudder_lag"
    shown = late.json("params", "show", name)
    assert set(shown["parameters"]) > {"a11", "b2", "rudder_lag.tau"}
    assert shown["parameters"]["rudder_lag.tau"]["unit"] == "s"
    compared = late.json("params", "diff", plain_set, name)["parameters"]
    assert {"a11", "b2"} <= set(compared)
    for form in ("yaml", "csv", "json"):
        assert "rudder_lag.tau" in late.kempf("params", "export", name, "--format", form).out
    assert late.kempf("params", "show", name).code == 0 and late.kempf("params", "diff", plain_set, name).code == 0
    assert late.kempf("params", "steering", name).code == 0
    rows = late.json("history", "--vessel", VESSEL)
    assert {row["model"] for row in rows} == {"plain", "plain + rudder_lag"}
    # sets of all runs at once are no points in time
    changes = late.json("history", "--vessel", VESSEL, "--changes")["changes"]
    assert all(one["parameter_set_ids"] == [] for one in changes)


def test_reprocessing_keeps_the_model_that_she_stands_at(late: Late, diagnosed: dict[str, Any]) -> None:
    before = parameter_sets.summaries(late.warehouse, VESSEL)["parameter_set_id"].to_list()
    report = reprocess_vessel(late.warehouse, VESSEL)
    assert report.status == "unchanged" and report.kept_sets == 1, report
    assert parameter_sets.summaries(late.warehouse, VESSEL)["parameter_set_id"].to_list() == before
    assert aliases.of_vessel(late.warehouse, VESSEL)["current"] in before


def test_a_vessel_that_fails_does_not_stop_the_fleet(late: Late, diagnosed: dict[str, Any]) -> None:
    with disable_run_logger():
        found = diagnose_batch.fn(late.warehouse.uri, ["nobody", VESSEL], ModelSpec().model_dump(mode="json"))
    assert [one["verdict"] for one in found] == ["failed", "explained"]
    assert [row["effects"] for row in summary(found)] == ["", "rudder_lag"]


@pytest.mark.parametrize(
    ("formula", "code"),
    [
        ("yaw: r*abs(r", 2),
        ("yaw: rr*abs(r)", 2),
        ("sideways: r", 2),
        ("yaw: __import__('os').system('true')", 2),
        ("yaw: r.__class__", 2),
        ("yaw: r/0", 2),
    ],
)
def test_a_slip_in_a_formula_is_reported_before_anything_is_read(late: Late, formula: str, code: int) -> None:
    ran = late.kempf("effects", "try", formula, "--vessel", VESSEL, "--json")
    assert ran.code == code, ran
    error = ran.json["error"]
    assert len(error["message"]) > 10 and len(error["next_step"]) > 5 and "Traceback" not in ran.err


def test_a_formula_of_ones_own_is_tried_and_nothing_is_stored(late: Late, diagnosed: dict[str, Any]) -> None:
    before = len(parameter_sets.summaries(late.warehouse, VESSEL))
    tried = late.json("effects", "try", "yaw: c*r*abs(r)", "--vessel", VESSEL)
    assert tried["formula"] == "yaw: c*r*abs(r)" and len(tried["candidates"]) == 1
    assert len(parameter_sets.summaries(late.warehouse, VESSEL)) == before


def test_an_effect_file_that_is_none_is_refused(late: Late, tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: mine\nterms: {yaw: 'r*'}\n", encoding="utf-8")
    error = refused(
        late.kempf("effects", "add", "mine", "--vessel", VESSEL, "--file", bad, "--json"), 2, "effect_file_invalid"
    )
    assert str(bad) in error["message"]
    refused(late.kempf("effects", "add", "x", "--vessel", VESSEL, "--file", tmp_path / "no.yaml", "--json"), 2,
            "effect_file")  # fmt: skip
    refused(late.kempf("effects", "add", "no_such", "--vessel", VESSEL, "--json"), 4, "effect_unknown")


def test_an_effect_of_ones_own_with_a_name_of_the_catalogue_is_refused(late: Late, tmp_path: Path) -> None:
    file = tmp_path / "copied.yaml"
    copy(Path(__file__).parents[2] / "schemas" / "effects" / "yaw_cubic.yaml", file)
    vessel = ("yaw_cubic", "--vessel", VESSEL, "--json")
    refused(late.kempf("effects", "add", *vessel, "--file", file), 2, "effect_name")
    refused(late.kempf("effects", "add", *vessel, "--formula", "yaw: r**3"), 2, "effect_name")
    refused(late.kempf("effects", "try", "yaw: r**3", "--name", *vessel), 2, "effect_name")
    refused(late.kempf("diagnose", "--vessel", VESSEL, "--effect-file", file, "--json"), 2, "effect_name")
