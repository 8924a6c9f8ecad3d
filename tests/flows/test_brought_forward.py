"""A pooled set brought forward by a further log, stored with what it adds, built again, superseding the last one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from kempf.flows.jobs.corrections.remove_logs import remove
from kempf.flows.jobs.identify import errors_of_fit, update_model
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, POOLED
from kempf.flows.jobs.identify.vessel_model import POSTERIOR, store_model
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_all import verify_all
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.diagnose.screening.unsure_instants import WithInstants
from kempf.pipeline.estimate.posterior import from_json
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.errors import KempfError
from kempf.warehouse.queries.comparable import comparable_sets
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet
from tests.flows.content import fresh

DAY_NS = 86_400_000_000_000
FIRST = 6


def take_in(warehouse: Warehouse, day: int) -> None:
    settings = zigzag_settings("ferry", duration_s=300.0, steady_s=40.0, seed=300 + day)
    settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * DAY_NS)
    data = to_csv(simulate_trial(settings), rate_hz=2.0)
    outcome = ingest_log(warehouse, "ferry", f"day{day}.csv.gz", LogFile(data), logger_profile(settings), "ferry")
    assert len(outcome.segments) == 1


def current(warehouse: Warehouse) -> ParameterSet:
    return parameter_sets.get(warehouse, aliases.of_vessel(warehouse, "ferry")["current"])


def pooled(warehouse: Warehouse) -> list[str]:
    """Her pooled sets that stand."""
    names = standing_ids(warehouse, "ferry")
    return [
        one.parameter_set_id for one in parameter_sets.get_all(warehouse, "ferry", names) if one.estimator == POOLED
    ]


@pytest.fixture(autouse=True)
def few() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(update_model, "FEWEST", FIRST)
        yield


@pytest.fixture(scope="module")
def grown(tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    """Six days that were fitted at once, and two more that came one after the other."""
    warehouse = fresh(tmp_path_factory.mktemp("grown") / "w")
    for day in range(FIRST):
        take_in(warehouse, day)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(update_model, "FEWEST", FIRST)
        reprocess_vessel(warehouse, "ferry")
        for day in (FIRST, FIRST + 1):
            take_in(warehouse, day)
            report = reprocess_vessel(warehouse, "ferry")
            assert report.new_sets == 2 and not report.failures
    return warehouse


@pytest.fixture
def own(grown: Warehouse, tmp_path: Path) -> Warehouse:
    assert grown.folder is not None
    return Warehouse(str(copytree(grown.folder, tmp_path / "w")))


def test_it_is_stored_with_what_it_adds_and_read_with_all(grown: Warehouse) -> None:
    whole = current(grown)
    stored = parameter_sets.as_stored(grown, whole.parameter_set_id)
    assert whole.updates is not None
    assert (whole.updates.manoeuvres, whole.updates.fitted_at_once) == (FIRST + 1, FIRST)
    assert len(stored.segment_ids) == len(stored.log_ids) == len(stored.convergence["levels"]) == 1
    assert set(whole.segment_ids) == {segment.segment_id for segment in choose(grown, "ferry").segments}
    assert len(whole.log_ids) == len(whole.provenance["inputs"]["segments"]) == FIRST + 2
    # held out are those of the fit at once; of each that came since its free run was foreseen before it was fitted
    fitted, held = whole.convergence["levels"], whole.convergence["held_out"]
    assert len(held) == 2 and set(fitted) == set(whole.segment_ids) - set(held)
    assert len(whole.fit["rung"]["foreseen"]) == 2 and max(whole.fit["rung"]["foreseen"].values()) < 0.2
    assert set(whole.fit["rung"]["in_sample"]) == set(fitted) and whole.fit["rung"]["one_leg_ahead"]
    assert whole.convergence["pooling"]["segments"] == len(whole.convergence["pooling"]["members"]) == len(fitted)


def test_it_says_what_a_fit_of_all_says(own: Warehouse) -> None:
    one = current(own)
    at_once, _ = store_model(own, choose(own, "ferry"), default_model_of(own, "ferry"), NONE_OF_ONES_OWN)
    assert at_once.updates is None and len(at_once.segment_ids) == FIRST + 2
    # other manoeuvres are held out, so that they share most of their data and not all
    for ours, theirs in zip(one.parameters, at_once.parameters, strict=True):
        assert ours.std and theirs.std and abs(ours.value - theirs.value) < 2.5 * theirs.std, ours.name
        assert 0.7 < ours.std / theirs.std < 1.3


def test_the_last_one_stands_alone_and_is_not_made_twice(own: Warehouse) -> None:
    assert pooled(own) == [current(own).parameter_set_id]
    assert len(standing_ids(own, "ferry")) == FIRST + 3
    report = reprocess_vessel(own, "ferry")
    assert report.status == "unchanged" and report.new_sets == 0
    # parameters over time are those of single zigzags
    assert all(
        "made of several segments" in kind.left_out or kind.parameter_set_ids for kind in comparable_sets(own, "ferry")
    )


def test_it_is_built_again_bit_for_bit_with_all_that_it_rests_on(own: Warehouse) -> None:
    again = rerun(own, "current")
    assert again.verdict == "bit-identical" and list(again.rests_on.values()) == ["bit-identical"] * 2
    found = verify_all(own, ["ferry"])
    assert found.counts()["bit-identical"] == len(found.verdicts) == FIRST + 2 + 3


def test_removing_a_log_it_rests_on_lets_all_be_fitted_at_once(own: Warehouse) -> None:
    before = current(own).parameter_set_id
    first = logs.current(own, "ferry")[1]
    remove(own, [first], "wrong ship")
    assert before not in pooled(own)
    reprocess_vessel(own, "ferry")
    now = current(own)
    assert now.updates is None and len(now.segment_ids) == FIRST + 1 and first.log_id not in now.log_ids
    assert pooled(own) == [now.parameter_set_id]


def test_grown_by_half_all_are_fitted_at_once(own: Warehouse) -> None:
    take_in(own, FIRST + 2)
    reprocess_vessel(own, "ferry")
    assert current(own).updates is None and len(current(own).segment_ids) == FIRST + 3
    assert pooled(own) == [current(own).parameter_set_id]


def test_a_lost_set_that_others_rest_on_is_named(own: Warehouse) -> None:
    one = current(own)
    assert one.updates is not None
    with delta.ensured(own, "parameter_sets") as table:
        delta.replace(table, "parameter_sets", [], f"parameter_set_id = '{one.updates.set}'")
    with pytest.raises(KempfError) as caught:
        parameter_sets.get(own, one.parameter_set_id)
    assert caught.value.code == "set_lost" and one.updates.set in caught.value.message
    # nothing rests on it any more, and the next run makes a set of all
    assert pooled(own) == [] or one.parameter_set_id not in pooled(own)
    reprocess_vessel(own, "ferry")
    assert set(current(own).segment_ids) == {segment.segment_id for segment in choose(own, "ferry").segments}


def test_a_model_with_effects_is_brought_forward_with_its_parents(own: Warehouse) -> None:
    spec = default_model_of(own, "ferry").model_copy(update={"effects": ("yaw_quadratic",)})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(update_model, "FEWEST", FIRST + 2)
        # the receiver of the first days was late by what nobody knows
        patch.setattr(
            errors_of_fit,
            "with_instants",
            lambda fit, *_: WithInstants(fit, fit.covariance * (len(fit.runs) > 1)),
        )
        made, new = store_model(own, choose(own, "ferry"), spec, NONE_OF_ONES_OWN)
        assert new
        aliases.point(own, "ferry", made.parameter_set_id)
        take_in(own, FIRST + 2)
        report = reprocess_vessel(own, "ferry")
        assert rerun(own, "current").verdict == "bit-identical"
    assert not report.failures
    now = current(own)
    assert now.model_spec["effects"] == ["yaw_quadratic"] and now.updates is not None
    assert now.updates.set == made.parameter_set_id and now.parent is not None
    parent = parameter_sets.get(own, now.parent)
    assert set(parent.segment_ids) == set(now.segment_ids) and not parent.model_spec["effects"]
    lag = {p.name: p for p in now.parameters}["yaw_quadratic.c"]
    before = {p.name: p for p in made.parameters}["yaw_quadratic.c"]
    assert lag.std and before.std and lag.std < before.std and np.isfinite(lag.value)
    first, left = (from_json(one.convergence[POSTERIOR]) for one in (made, now))
    # what is not known of the instants of the first runs counts against them, and the new one adds what it says
    assert np.all(np.diag(left.covariance) < np.diag(first.covariance))
    np.testing.assert_allclose(first.stated, first.covariance, rtol=1e-12)
