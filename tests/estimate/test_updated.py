"""A common fit brought forward: beside what the runs before left, a further one gives what all of them give."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.estimate.posterior import Posterior, from_json, posterior_of
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.updated import Updated, updated
from kempf.pipeline.model.effect_model import EffectModel
from tests.estimate.test_plain_fit import SPEC, fitted, run, with_rudder


def left_by(*runs: GridRun) -> Posterior:
    fit = fitted(*runs).fit
    return posterior_of(fit, fit, uncertainty_of(fit), agreement_of(fit), fit.log_likelihood)


def brought(before: Posterior, *runs: GridRun, workers: int = 2) -> Updated | None:
    with ThreadPoolExecutor(workers) as executor:
        return updated(before, EffectModel(), runs, SPEC, executor)


@pytest.fixture(scope="module")
def before() -> Posterior:
    return left_by(*(run(seed) for seed in (21, 22, 23, 24)))


def test_a_further_run_gives_what_all_of_them_give_at_once(before: Posterior) -> None:
    made = brought(before, run(25))
    assert made is not None and made.fit.converged
    at_once = left_by(*(run(seed) for seed in (21, 22, 23, 24, 25)))
    after = posterior_of(made.logged, made.fit, made.known, made.agreement, made.log_likelihood)
    std = np.sqrt(np.diag(at_once.stated))
    assert np.max(np.abs(after.point - at_once.point) / std) < 0.1
    np.testing.assert_allclose(np.sqrt(np.diag(after.stated)) / std, 1.0, atol=0.05)
    # in log-likelihood, of which the runs have some ten thousand
    assert abs(after.log_likelihood - at_once.log_likelihood) < 0.2
    assert after.agreement.degrees_of_freedom == at_once.agreement.degrees_of_freedom == 24
    assert abs(after.agreement.statistic - at_once.agreement.statistic) < 2.0


def test_the_workers_and_the_way_through_json_do_not_matter_to_the_bits(before: Posterior) -> None:
    first, second = brought(before, run(25), workers=1), brought(from_json(before.as_json()), run(25), workers=3)
    assert first is not None and second is not None
    np.testing.assert_array_equal(first.fit.hull, second.fit.hull)
    np.testing.assert_array_equal(first.known.covariance, second.known.covariance)
    assert first.log_likelihood == second.log_likelihood


def test_errors_that_are_no_information_still_count_as_far_as_their_runs_do(before: Posterior) -> None:
    late = 0.5 * before.covariance
    plain, made = brought(before, run(25)), brought(replace(before, stated=before.stated + late), run(25))
    assert plain is not None and made is not None
    np.testing.assert_array_equal(made.fit.hull, plain.fit.hull)
    share = np.diag(made.known.covariance - plain.known.covariance) / np.diag(late)
    # four of the five runs: of the weight of a run's errors, each counts with its share twice
    assert np.all((share > 0.4) & (share < 1.0))


def test_what_is_not_known_of_instants_counts_against_what_the_runs_before_say(before: Posterior) -> None:
    plain = brought(before, run(25))
    unsure = replace(before, covariance=4.0 * before.covariance, stated=4.0 * before.stated)
    made = brought(unsure, run(25))
    assert plain is not None and made is not None
    wider = np.diag(made.known.covariance) / np.diag(plain.known.covariance)
    # five runs that count for one and a quarter, and the new one
    assert np.all((wider > 1.5) & (wider < 4.0))


def test_a_hull_that_moved_with_the_instants_of_the_runs_before_is_no_disagreement(before: Posterior) -> None:
    plain = brought(before, run(25))
    std = np.sqrt(np.diag(before.covariance))
    # hundreds of runs know their hull to less than it moves with their instants
    moved = replace(before, point=before.point + 8.0 * std, covariance=1.5 * before.covariance)
    made = brought(moved, run(25))
    assert plain is not None and made is not None
    # the run is fitted, and judged, beside what the others say of their instants as logged
    np.testing.assert_array_equal(made.logged.hull, plain.logged.hull)
    assert made.agreement == plain.agreement and made.log_likelihood == plain.log_likelihood
    # the others count for four runs of five, with the hull that is theirs with instants free
    np.testing.assert_array_equal(made.fit.hull, made.logged.hull)
    assert moved.freed.loss(made.fit.hull + made.step) < 0.1 * moved.freed.loss(plain.fit.hull)
    assert np.all(np.diag(made.fit.covariance) > np.diag(plain.fit.covariance))


def test_nothing_moves_where_all_instants_are_as_logged(before: Posterior) -> None:
    made = brought(before, run(25))
    assert made is not None
    assert np.max(np.abs(made.step) / made.logged.std) < 1e-6
    np.testing.assert_allclose(made.fit.covariance, made.logged.covariance, rtol=1e-6)


def test_a_run_of_another_ship_is_not_brought_in(before: Posterior) -> None:
    other = with_rudder(run(25), 1.0 / 0.8)
    assert brought(before, other) is None
    # not even where the runs before disagree somewhat: then it must be odd among them, too
    apart = replace(before, agreement=replace(before.agreement, statistic=80.0))
    assert apart.agreement.widened > 1.5
    assert brought(apart, other) is None


def test_a_run_that_cannot_be_identified_by_itself_is_not_brought_in(before: Posterior) -> None:
    inputs = run(25).inputs.copy()
    inputs[:, 0] = 1e5
    assert brought(before, replace(run(25), inputs=inputs)) is None


def test_a_parameter_at_a_bound_leaves_nothing_to_build_on(before: Posterior) -> None:
    covariance = before.covariance.copy()
    covariance[2] = covariance[:, 2] = np.nan
    at_bound = replace(before, covariance=covariance)
    assert before.usable and not at_bound.usable and not from_json(at_bound.as_json()).usable
    assert brought(at_bound, run(25)) is None


def test_what_an_earlier_version_left_is_nothing_to_build_on(before: Posterior) -> None:
    stored = before.as_json()
    del stored["logged_point"], stored["logged_covariance"]
    assert not from_json(stored).usable
