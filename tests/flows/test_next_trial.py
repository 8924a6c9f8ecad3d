"""Which zigzag parts two models of a ship, held against how far apart the zigzags that were sailed put them."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import pytest

from benchmarks.diagnose.late_rudder import VESSEL
from kempf.flows.jobs.diagnose.rival_models import Rivals
from kempf.flows.jobs.predict import predict_vessel
from kempf.flows.jobs.predict.next_trial import next_trial
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet


@pytest.fixture(scope="module")
def warehouse(late_added: Path, tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    return Warehouse(str(copytree(late_added, tmp_path_factory.mktemp("next_trial") / "added") / "w"))


def sets(warehouse: Warehouse) -> dict[tuple[str, ...], ParameterSet]:
    """By effects."""
    names = parameter_sets.summaries(warehouse, VESSEL)["parameter_set_id"].to_list()
    every = parameter_sets.get_all(warehouse, VESSEL, sorted(names))
    return {tuple(one.model_spec.get("effects", ())): one for one in every if len(one.segment_ids) > 1}


def test_two_models_that_a_sailed_zigzag_parts_are_parted_by_one_more(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = sets(warehouse)
    lag, plain = found["rudder_lag",], found[()]
    monkeypatch.setattr(predict_vessel, "rivals_of", lambda *_: Rivals((plain,), ()))
    made = next_trial(warehouse, VESSEL, lag.parameter_set_id)
    content = made.as_json()
    assert content["aim"] == "part" and [one["effects"] for one in content["models"]] == [["rudder_lag"], []]
    assert "(rudder_lag or none beside)" in content["sentences"][0]
    surest = [one["probability"] for one in content["trials"]]
    assert surest == sorted(surest, reverse=True)
    for one in content["trials"]:
        assert one["probability"] == min(pair["probability"] for pair in one["parts"])
        assert {(pair["true"], pair["other"]) for pair in one["parts"]} == {
            (lag.parameter_set_id, plain.parameter_set_id),
            (plain.parameter_set_id, lag.parameter_set_id),
        }
    # each of the zigzags that were sailed put the lag ahead by dozens of log-likelihood: so will one more
    ahead = lag.convergence["log_likelihood"] - plain.convergence["log_likelihood"]
    assert ahead > 20.0 * len(lag.segment_ids) and surest[0] > 0.999


def test_the_same_model_twice_is_never_parted(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    lag = sets(warehouse)["rudder_lag",]
    monkeypatch.setattr(predict_vessel, "rivals_of", lambda *_: Rivals((lag,), ()))
    made = next_trial(warehouse, VESSEL, lag.parameter_set_id)
    assert max(p for one in made.trials for p in one.parts.values()) < 1e-6
