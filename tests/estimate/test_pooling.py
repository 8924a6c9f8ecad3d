"""Several segments, one hull: what is gained, and when it is refused."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from kempf.pipeline.estimate import pooling
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.pooling import Member
from kempf.pipeline.estimate.result import Estimate
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from tests.estimate.simulated import record_of, sailed, truth_of

SETTINGS = MaximumLikelihoodSettings()


@lru_cache(maxsize=8)
def member(hull: str, seed: int) -> Member:
    trial = sailed(hull, seed=seed, heading_deg=80.0 * seed, duration_s=500.0)
    return Member(f"{hull} {seed}", record_of(trial), trial.truth.wind_arm_per_m)


def pooled(*members: Member) -> Estimate:
    with ThreadPoolExecutor(2) as workers:
        return pooling.identify(members, ModelSpec(), SETTINGS, workers)


@pytest.fixture(scope="module")
def three() -> Estimate:
    return pooled(*(member("ferry", seed) for seed in (21, 22, 23)))


def test_one_hull_from_three_zigzags(three: Estimate) -> None:
    truth = truth_of(sailed("ferry", seed=21, heading_deg=80.0 * 21, duration_s=500.0))
    std = np.array([p.std for p in three.parameters])
    assert three.converged and three.estimator == "ml-pooled"
    assert np.max(np.abs(three.hull.array() - truth) / std) < 3.0
    told = three.report["pooling"]
    assert told["may_be_pooled"] and told["widened"] == 1.0
    assert told["degrees_of_freedom"] == 12 and told["segments"] == 3
    assert 0.0 < told["statistic"] < 30.0
    assert [m["segment"] for m in told["members"]] == ["ferry 21", "ferry 22", "ferry 23"]


def test_information_of_the_members_adds_up(three: Estimate) -> None:
    one = member("ferry", 21)
    alone = identify(one.record, ModelSpec(), one.arm_per_m, SETTINGS)
    for p, q in zip(three.parameters, alone.parameters, strict=True):
        # three records alike: a third of the variance, by and large
        assert 0.45 < p.std / q.std < 0.75, p.name


def test_the_order_and_the_workers_do_not_matter_to_the_bits() -> None:
    members = [member("ferry", seed) for seed in (21, 22)]
    with ThreadPoolExecutor(1) as single:
        first = pooling.identify(members, ModelSpec(), SETTINGS, single)
    second = pooled(*members)
    assert first.parameters == second.parameters and first.report == second.report
    np.testing.assert_array_equal(first.covariance, second.covariance)


def test_two_ships_are_no_pool() -> None:
    found = pooled(member("ferry", 21), member("ferry", 22), _slower_rudder(member("ferry", 23)))
    told = found.report["pooling"]
    assert not told["may_be_pooled"] and told["p_value"] < 1e-6
    assert told["widened"] > 1.5
    assert any("do not share one hull" in warning for warning in found.warnings)
    off = {m["segment"]: np.abs([m["off_in_std"][name] for name in HULL_PARAMETERS]).max() for m in told["members"]}
    assert max(off, key=lambda name: off[name]) == "ferry 23 changed"


def _slower_rudder(one: Member) -> Member:
    """A rudder that does a tenth less: b1 and b2 of this ship are smaller."""
    record = replace(one.record, rudder_rad=one.record.rudder_rad / 0.9)
    return Member(f"{one.name} changed", record, one.arm_per_m)


def test_what_cannot_be_identified_by_itself_stays_out_and_is_named() -> None:
    still = replace(member("ferry", 23).record, speed_m_s=np.full_like(member("ferry", 23).record.speed_m_s, 1e5))
    found = pooled(member("ferry", 21), member("ferry", 22), Member("rocket", still, 0.01))
    assert list(found.report["pooling"]["left_out"]) == ["rocket"]
    assert any("left out of the pool: rocket" in warning for warning in found.warnings)
    with pytest.raises(DataRejected) as caught:
        pooled(member("ferry", 21), Member("rocket", still, 0.01))
    assert caught.value.code == "too_few_to_pool" and "rocket" in caught.value.details["left_out"]
