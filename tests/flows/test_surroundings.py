"""One word of the profile, tank, pond or sea, chooses the model where none is named; it is recorded, and run again."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from kempf.flows.jobs.identify.standing_model import standing_model
from kempf.flows.jobs.ingest.files import read_model, read_profiles
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile, parse
from kempf.schemas.surroundings import default_model
from kempf.warehouse.tables import parameter_sets
from tests.flows.test_shared_start import elapsed, ingested, profile, trial
from tests.workbench.driving import kempf

DOCS = Path(__file__).parents[2] / "docs"


def test_a_tank_is_the_documented_model_for_the_ship_that_it_is_of() -> None:
    ship = read_profiles([DOCS / "profiles" / "hsva_kvlcc2.yaml"])
    assert default_model(ship) == read_model(DOCS / "models" / "tank.yaml")
    assert default_model(ship.model_copy(update={"surroundings": "sea"})) == ModelSpec()
    assert default_model(ship.model_copy(update={"surroundings": None})) == ModelSpec()


def test_the_rates_go_with_speed_over_length() -> None:
    def rate(**keys: float) -> float:
        return default_model(VesselProfile(surroundings="tank", **keys)).wind_correlation_rate_per_s

    assert rate(length_m=3.5, trial_speed_m_s=1.179) == pytest.approx(2 * 0.333, rel=2e-3)
    assert rate(length_m=7.0, trial_speed_m_s=1.179 / 3) == pytest.approx(0.111, rel=2e-3)
    # without a speed by Froude's law, without a length as the documented model
    assert rate(length_m=7.0) == rate() == 0.333
    assert rate(length_m=1.75) == pytest.approx(2 * 0.333, rel=2e-3)
    pond = default_model(VesselProfile(surroundings="pond", length_m=3.0, trial_speed_m_s=0.4))
    assert (pond.name, pond.wind, pond.current) == ("pond", "force", "none")
    assert pond.moment_correlation_rate_per_s == pytest.approx(1 / 30 * (0.4 / 3.0) / (7.72 / 160.93), rel=5e-3)


def test_another_word_is_refused_and_none_changes_no_hash() -> None:
    with pytest.raises(UsageError, match="surroundings"):
        parse({"surroundings": "lake"}, "profile.yaml")
    assert "surroundings" not in VesselProfile(vessel="a").canonical_json()
    assert VesselProfile(surroundings="sea").sha256 != VesselProfile().sha256


def test_on_a_pond_zigzags_without_a_log_are_pooled_by_its_model(tmp_path: Path) -> None:
    trials = [trial(seed) for seed in (21, 22)]
    content = yaml.safe_load(profile(trials[0], {"column": "utc", "unit": "s", "start": "2025-05-03T06:00:00Z"}))
    del content["sources"][0]["channels"]["stw"]
    del content["wind_arm_per_m"]
    logs = {f"run_{k}.csv": elapsed(one) for k, one in enumerate(trials)}
    content["surroundings"] = "pond"
    warehouse, _ = ingested(tmp_path, logs, yaml.safe_dump(content))
    asked = ("--vessel", "mariner", "--warehouse", Path(warehouse.uri))
    expected = default_model(VesselProfile.model_validate(content))
    assert standing_model(warehouse, "mariner")[0] == expected
    *single, pooled = kempf("identify", *asked, "--json").json
    assert pooled["estimator"] == "ml-pooled" and len(pooled["segments"]) == 2
    for one in (*single, pooled):
        stored = parameter_sets.get(warehouse, one["parameter_set_id"])
        assert stored.model_spec == expected.model_dump(mode="json") and stored.model_name == "pond"
        assert "not_pooled" not in one
        assert not any("trial speed" in warning for warning in stored.warnings)
    # the model is recorded: another word in the profile changes no set that is there
    (tmp_path / "sea.yaml").write_text(yaml.safe_dump({**content, "surroundings": "sea"}), encoding="utf-8")
    assert kempf("vessels", "set", "mariner", "--profile", tmp_path / "sea.yaml", *asked[2:]).code == 0
    for one in (*single, pooled):
        assert rerun(warehouse, one["parameter_set_id"]).verdict == "bit-identical"
