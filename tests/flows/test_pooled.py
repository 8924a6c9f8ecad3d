"""The job that pools: one set of a vessel from several days, stored, built again bit for bit, not computed twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.identify.loads_of_logs import loads_beside
from kempf.flows.jobs.identify.pool_vessel import pool_vessel, poolable
from kempf.flows.jobs.identify.ship_model import ship_of_set
from kempf.flows.jobs.identify.standing_model import POOLED
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.predict import as_sailed as as_sailed_job
from kempf.flows.jobs.predict.as_sailed import as_sailed
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.flows.jobs.predict.predict_vessel import models_of_set, predict_with
from kempf.flows.jobs.predict.prediction_basis import basis_of, identified
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, segments
from kempf.warehouse.tables.parameter_set import Bounds
from tests.conftest import Ship
from tests.flows.content import fresh
from tests.workbench.driving import kempf

DAY_NS = 86_400_000_000_000


@pytest.fixture(scope="module")
def days(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    """Two days of the ship; the second one was logged twice."""
    folder = mariner.write(tmp_path_factory.mktemp("days"))
    settings = zigzag_settings("mariner", duration_s=400.0, seed=2)
    second = simulate_trial(replace(settings, start_utc_ns=settings.start_utc_ns + DAY_NS, heading_deg=100.0))
    (folder / "second.csv.gz").write_bytes(to_csv(second))
    (folder / "second.nmea.gz").write_bytes(to_nmea(second))
    warehouse = fresh(folder / "w")
    paths = [folder / name for name in ("mariner.csv.gz", "second.csv.gz", "second.nmea.gz")]
    done = ingest(warehouse, paths, given=read_profiles([folder / "profile.yaml"]))
    assert [len(o.segments) for o in done] == [1, 1, 1]
    return warehouse


def test_two_days_make_one_set_which_is_built_again_and_not_twice(days: Warehouse) -> None:
    outcomes = identify_vessel(days, "mariner", Request())
    found = pool_vessel(days, "mariner", Request(), outcomes)
    assert found is not None
    pooled, new = found
    assert new and pooled.estimator == POOLED
    # the day that two loggers wrote counts once
    assert len(outcomes) == 3 and len(pooled.segment_ids) == 2
    starts = {o.segment.segment_id: o.segment.start_utc_ns for o in outcomes}
    assert abs(starts[pooled.segment_ids[0]] - starts[pooled.segment_ids[1]]) > DAY_NS / 2
    assert pooled.convergence["pooling"]["may_be_pooled"]
    single = [o.parameter_set for o in outcomes if o.parameter_set]
    # two days know more than one; what they disagree about widens the errors again
    widened = pooled.convergence["pooling"]["widened"]
    assert 1.0 <= widened < 1.5
    assert all(pooled.parameters[5].std < 0.95 * widened * one.parameters[5].std for one in single)
    assert aliases.of_vessel(days, "mariner")["current"] == pooled.parameter_set_id
    assert rerun(days, pooled.parameter_set_id).verdict == "bit-identical"
    # errors that are wider already by what the days disagree about are not widened once more by what legs do
    basis = basis_of(days, pooled)
    wide = 9.0 * np.array(pooled.covariance)
    pooling = {**pooled.convergence["pooling"], "widened": 3.0}
    other = replace(
        pooled,
        covariance=tuple(tuple(float(x) for x in row) for row in wide),
        convergence={**pooled.convergence, "pooling": pooling},
    )
    np.testing.assert_allclose(identified(ship_of_set(days, other), basis).covariance, wide, rtol=1e-12)
    again = pool_vessel(days, "mariner", Request(), outcomes)
    assert again is not None and not again[1] and again[0].parameter_set_id == pooled.parameter_set_id
    assert pool_vessel(days, "mariner", Request(estimator="least-squares"), outcomes) is None
    assert pool_vessel(days, "mariner", Request(), outcomes[:1]) is None


def test_reprocessing_keeps_the_pool_and_the_command_lists_it_last(days: Warehouse) -> None:
    report = reprocess_vessel(days, "mariner")
    assert report.status == "unchanged" and report.kept_sets == 4
    listed = kempf("identify", "--vessel", "mariner", "--warehouse", Path(days.uri), "--json").json
    assert [one["estimator"] for one in listed] == ["ml", "ml", "ml", POOLED]
    output = kempf("identify", "--vessel", "mariner", "--warehouse", Path(days.uri))
    assert "2 manoeuvres pooled" in output.out and "not in it: 1 manoeuvre" in output.out
    assert len(parameter_sets.summaries(days, "mariner")) == 4


def test_why_zigzags_are_not_pooled_is_said(days: Warehouse) -> None:
    outcomes = identify_vessel(days, "mariner")
    reasons = [
        poolable(days, "mariner", Request(estimator="least-squares"), outcomes),
        poolable(days, "mariner", Request(), []),
        poolable(days, "mariner", Request(), outcomes[:1]),
    ]
    expected = (
        "takes one manoeuvre at a time",
        "no manoeuvre could be identified",
        "there is one manoeuvre that counts",
    )
    assert all(words in str(reason) for words, reason in zip(expected, reasons, strict=True)), reasons


def test_the_current_set_is_named(days: Warehouse) -> None:
    stored = parameter_sets.summaries(days, "mariner").rows(named=True)
    (pooled,) = (s["parameter_set_id"] for s in stored if s["estimator"] == POOLED)
    printed = kempf("identify", "--vessel", "mariner", "--warehouse", Path(days.uri)).out
    assert f"current of mariner: {pooled}, plain, pooled" in printed
    assert printed.index("manoeuvres pooled") < printed.index("20/20 zigzag")


def test_a_prediction_lays_out_the_manoeuvres_of_its_set_once_and_others_alike(
    days: Warehouse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind the others: it takes a third day in."""
    settings = zigzag_settings("mariner", duration_s=400.0, seed=3)
    third = simulate_trial(replace(settings, start_utc_ns=settings.start_utc_ns + 2 * DAY_NS, heading_deg=200.0))
    (tmp_path / "third.csv.gz").write_bytes(to_csv(third))
    (taken,) = ingest(days, [tmp_path / "third.csv.gz"], "mariner")
    (beside,) = taken.segments
    every = [s for s in segments.current(days, "mariner") if s.kind == "zigzag"]
    pooled = parameter_sets.get(days, aliases.of_vessel(days, "mariner")["current"])
    single = next(
        row["parameter_set_id"]
        for row in parameter_sets.summaries(days, "mariner").rows(named=True)
        if row["estimator"] != POOLED
    )
    for set_id in (pooled.parameter_set_id, single):
        asked = PredictRequest("zigzag", set_id=set_id)
        made = predict_with(models_of_set(days, "mariner", asked), asked, count=8)
        own = set(made.parameter_set.segment_ids)
        laid: list[Chosen] = []
        runs: dict[str, GridRun] = {}

        def laid_out(warehouse, chosen, *rest, laid=laid):
            laid.append(chosen)
            return assembled(warehouse, chosen, *rest)

        def filtered(run, *rest, runs=runs):
            # those of the set, by their own names, say how large the wind is where a zigzag has no run
            if run.name.startswith("seg-"):
                runs[run.name] = run
            return RunFilter(run, *rest)

        monkeypatch.setattr(as_sailed_job, "assembled", laid_out)
        monkeypatch.setattr(as_sailed_job, "RunFilter", filtered)
        pairs = [(s, PredictedZigzag(np.radians(20.0), np.radians(20.0), overshoots=2)) for s in every]
        sailed = as_sailed(days, made, pairs)
        monkeypatch.undo()
        assert {one.segment.segment_id for one in sailed if one.sample == "fitted"} == own
        # what is asked of the log that two loggers wrote is asked once
        assert own | {beside.segment_id} <= set(runs) <= {s.segment_id for s in every}
        (chosen,) = laid
        assert {s.segment_id for s in chosen.segments} == set(runs) - own
        first = made.basis.runs.runs[0]
        assert {run.step_s for run in runs.values()} == {first.step_s}
        assert chosen.profile_sha256 == made.parameter_set.provenance["inputs"]["profile_sha256"]


def test_logs_beside_a_set_are_laden_on_its_scale() -> None:
    def log(name: str, day: int) -> tuple[str, Bounds]:
        return name, Bounds(name, day * DAY_NS, day * DAY_NS + 1)

    own, others = [log("b", 1), log("d", 3)], [log("a", 0), log("c", 2), log("e", 4)]
    # by their numbers: those beside the set as in the last log before them
    assert loads_beside(own, {}, others, {"e": 9.0}) == {"b": 0.0, "d": 1.0, "a": 0.0, "c": 0.0, "e": 1.0}
    # by draughts, where they are known
    found = loads_beside(own, {"b": 8.0, "d": 10.0}, others, {"a": 7.2, "e": 9.6})
    assert found == pytest.approx({"b": 0.0, "d": 2.5, "a": -1.0, "c": 0.0, "e": 2.0})
