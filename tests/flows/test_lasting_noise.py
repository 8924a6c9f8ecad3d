"""A ship with instruments as they are sold, from raw log to stored sets of single manoeuvres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.write import logs_of
from benchmarks.identify.intervals_as_sold import hull_of, in_std
from kempf.flows.jobs.identify import errors_of_fit
from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.diagnose.screening import instrument_noise
from kempf.pipeline.diagnose.screening.unsure_instants import WithInstants
from kempf.schemas.instrument_noise import NAMES
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet
from tests.workbench.driving import kempf

FRESH = Case(
    "shearwater", "none", "none", "mariner", 1.0, "calm", strength=0, sold=False, formats=("mcap", "mcap"), seed=5
)


def identified(case: Case, place: Path) -> tuple[Warehouse, list[ParameterSet], np.ndarray]:
    """Her first day: warehouse, sets of the zigzags, and what the hull truly is, shape (6,)."""
    files, answer = logs_of(case)
    for name, content in files.items():
        (place / name).write_bytes(content)
    warehouse = Warehouse(str(place / "w"))
    first = min(name for name in files if name != "profile.yaml")
    ingest(warehouse, [place / first], None, read_profiles([place / "profile.yaml"]))
    sets = [outcome.parameter_set for outcome in identify_vessel(warehouse, case.case_id)]
    return warehouse, [one for one in sets if one is not None], hull_of(case, answer)


def lasting(one: ParameterSet) -> set[str]:
    return {p.name.partition(".")[0] for p in one.noise} & set(NAMES)


def test_each_manoeuvre_states_errors_that_hold_the_truth(tmp_path: Path) -> None:
    warehouse, sets, true = identified(replace(FRESH, sold=True), tmp_path)
    assert len(sets) == 4
    for one in sets:
        assert lasting(one) >= {"heading_noise", "yaw_rate_noise"}, one.parameter_set_id
        assert one.convergence["converged"] and one.fit["channels"]["yaw_rate"]["n"] > 100
    z = np.array([in_std(one, true) for one in sets])
    assert np.all(np.sqrt(np.mean(z**2, axis=0)) < 2.0), z
    assert rerun(warehouse, sets[0].parameter_set_id).verdict == "bit-identical"
    for words in (("compare",), ("predict", "zigzag", "--angles", "10/10")):
        of = ("--vessel", FRESH.case_id, "--set", sets[0].parameter_set_id, "--warehouse", tmp_path / "w", "--json")
        assert kempf(*words, *of).code == 0, words


def test_a_set_holds_what_is_not_known_of_a_lateness_also_where_no_noise_lasts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boat = replace(FRESH, case_id="tern", hull="usv", sold=True)
    monkeypatch.setattr(instrument_noise, "_LEAST_SCORE", np.inf)
    stds = []
    for name in ("with", "without"):
        place = tmp_path / name
        place.mkdir()
        _, sets, _ = identified(boat, place)
        assert all(any("late beside the fixes" in said for said in one.warnings) for one in sets)
        assert [lasting(one) for one in sets] == [set()] * 4
        stds.append([next(p.std for p in one.parameters if p.name == "a21") for one in sets])
        monkeypatch.setattr(errors_of_fit, "with_instants", lambda fit, *_: WithInstants(fit, 0.0 * fit.covariance))
    # sway, and by drift the yaw
    assert np.all(np.array(stds[0]) > 1.02 * np.array(stds[1])), stds


def test_fresh_noise_is_fitted_as_fresh_noise(tmp_path: Path) -> None:
    _, sets, true = identified(FRESH, tmp_path)
    assert [lasting(one) for one in sets] == [set()] * 4
    assert np.all(np.abs([in_std(one, true) for one in sets]) < 4.0)
