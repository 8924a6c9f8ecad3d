"""The job that pools: one set of a vessel from several days, stored, built again bit for bit, not computed twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kempf.flows.jobs.files import read_profiles
from kempf.flows.jobs.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest_logs import ingest
from kempf.flows.jobs.pool_vessel import pool_vessel, poolable
from kempf.flows.jobs.prediction_basis import basis_of, identified
from kempf.flows.jobs.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.rerun_set import rerun
from kempf.flows.jobs.ship_model import ship_of_set
from kempf.flows.jobs.standing_model import POOLED
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.warehouse import aliases, parameter_sets
from kempf.warehouse.store import Warehouse
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
