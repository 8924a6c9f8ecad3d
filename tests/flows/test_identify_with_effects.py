"""Models with effects through `kempf identify`: each zigzag, all of them, over time; and one error of a model."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from benchmarks.diagnose import late_rudder
from kempf.flows.jobs.identify.vessel_model import _at_bounds
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.estimate.pooled_fit import ShipPart
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.effects import catalogue
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases
from tests.workbench.driving import kempf, refused

VESSEL = late_rudder.VESSEL


@pytest.fixture(scope="module")
def place(late_ingested: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = copytree(late_ingested, tmp_path_factory.mktemp("late") / "ingested")
    (folder / "lag.yaml").write_text("name: as_built\neffects: [rudder_lag]\nrate_bias: false\n", encoding="utf-8")
    return folder


def run(place: Path, *arguments: object) -> Any:
    ran = kempf(*arguments, "--warehouse", place / "w", "--json")
    assert ran.code == 0, ran
    return ran.json


@pytest.fixture(scope="module")
def identified(place: Path) -> list[dict[str, Any]]:
    return list(run(place, "identify", "--vessel", VESSEL, "--model", place / "lag.yaml"))


def test_each_zigzag_and_all_of_them_know_the_lag(place: Path, identified: list[dict[str, Any]]) -> None:
    assert [one["estimator"] for one in identified] == ["ml", "ml", "ml", "ml-pooled"]
    for one in identified:
        lag = one["parameters"]["rudder_lag.tau"]
        assert lag["unit"] == "s" and abs(lag["value"] - late_rudder.LAG_S) < 4.0 * lag["std"], one["parameter_set_id"]
        assert one["fit"] and one["model"]["name"] == "as_built + rudder_lag"
    single = identified[0]
    assert set(single["noise"]) >= {"sigma_F", "sigma_v", "sigma_r", "sigma_psi"}
    assert single["fit"]["channels"]["yaw_rate"]["fit_percent"] > 90.0
    pooled = identified[-1]["parameter_set_id"]
    warehouse = Warehouse(str(place / "w"))
    assert aliases.of_vessel(warehouse, VESSEL) == {"current": pooled}
    assert [r["parameter_set_id"] for r in run(place, "ladder", "--vessel", VESSEL)][-1] == pooled
    for one in (single, identified[-1]):
        assert rerun(warehouse, one["parameter_set_id"]).verdict == "bit-identical"


def test_the_history_follows_a_ship_whose_model_has_effects(place: Path, identified: list[dict[str, Any]]) -> None:
    changes = run(place, "history", "--vessel", VESSEL, "--changes")["changes"]
    followed = {(one["model"], one["estimator"]): one for one in changes}["as_built + rudder_lag", "ml"]
    assert followed["parameter_set_ids"] == [one["parameter_set_id"] for one in identified[:-1]]


def test_a_set_names_its_model_and_plain_identification_leaves_current_where_it_is(
    place: Path, identified: list[dict[str, Any]]
) -> None:
    pooled = identified[-1]["parameter_set_id"]
    again = run(place, "identify", "--vessel", VESSEL, "--model", pooled[:12])
    assert [one["parameter_set_id"] for one in again] == [one["parameter_set_id"] for one in identified]
    output = kempf("identify", "--vessel", VESSEL, "--model", pooled[:12], "--warehouse", place / "w")
    assert f"2 manoeuvres pooled, 1 held out: {pooled}" in output.out
    run(place, "identify", "--vessel", VESSEL)
    warehouse = Warehouse(str(place / "w"))
    assert aliases.of_vessel(warehouse, VESSEL) == {"current": pooled}
    report = reprocess_vessel(warehouse, VESSEL)
    assert (report.status, report.new_sets) == ("unchanged", 0)
    assert aliases.of_vessel(warehouse, VESSEL) == {"current": pooled}


def test_one_error_of_a_model(place: Path, identified: list[dict[str, Any]]) -> None:
    rung = run(place, "ladder", "--vessel", VESSEL)[-1]
    compared = run(place, "compare", "--vessel", VESSEL)
    errors = {sample: one["free_run_error_percent"]["mean"] for sample, one in compared["summary"].items() if one}
    assert errors == {"fitted": 100.0 * rung["in_sample_error"], "held_out": 100.0 * rung["held_out_error"]}
    assert compared["judged"] == {"sample": "held_out", "free_run_error_percent": 100.0 * rung["held_out_error"]}


def test_an_estimator_that_knows_no_effects_refuses_the_model(place: Path) -> None:
    arguments = ("identify", "--vessel", VESSEL, "--model", place / "lag.yaml", "--estimator", "paper")
    refused(kempf(*arguments, "--warehouse", place / "w", "--json"), 2, "effects_need_ml")


def test_an_effect_at_its_bound_is_warned_of() -> None:
    model = EffectModel((catalogue()["backlash"], catalogue()["rudder_lag"]))
    (_, backlash), (_, lag) = model.parameters
    ended = SimpleNamespace(model=model, values=np.array([backlash.low, 0.5 * (lag.low + lag.high)]))
    assert _at_bounds(cast(ShipPart, ended)) == (
        "at a bound, not estimated: backlash.c = 0; the effect as fitted changes nothing",
    )
    ended.values = np.array([backlash.high, lag.high])
    assert [said.split(" = ")[0] for said in _at_bounds(cast(ShipPart, ended))] == [
        f"at a bound, not estimated: {name}" for name in model.names
    ]
