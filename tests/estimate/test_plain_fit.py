"""The plain model of several manoeuvres: what one hull gains, when the runs do not share one, and who stays out."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.agreement import LEVEL
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.level_bounds import next_to_nothing, to_intensities
from kempf.pipeline.estimate.maximum_likelihood import STANDARD, identify
from kempf.pipeline.estimate.plain_fit import PlainFit, fit_plain, off_in_std
from kempf.pipeline.estimate.pooled_fit import CommonLikelihood, linearise, swiftness
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.estimate.record.average import step_of
from kempf.pipeline.estimate.record.grid_run import GridRun, ShipConstants, make_run
from kempf.pipeline.estimate.search.climb import free
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import instruments_of, record_of, sailed, truth_of

SPEC = ModelSpec(moment="none")
#: log-likelihood of three runs, by which two ways to put a measurement off the grid may differ
MOST_APART = 10.0


@lru_cache(maxsize=8)
def run(seed: int, hull: str = "ferry", duration_s: float = 500.0) -> GridRun:
    trial = sailed(hull, seed=seed, heading_deg=80.0 * seed, duration_s=duration_s)
    record = record_of(trial)
    ship = ShipConstants(90.0, 5.0, trial.truth.wind_arm_per_m)
    return make_run(f"{hull} {seed}", record, instruments_of(trial), SPEC, ship, step_of([record], 90.0))


def fitted(*runs: GridRun, workers: int = 2) -> PlainFit:
    with ThreadPoolExecutor(workers) as executor:
        return fit_plain(runs, SPEC, executor)


@pytest.fixture(scope="module")
def three() -> PlainFit:
    return fitted(*(run(seed) for seed in (21, 22, 23)))


def test_one_hull_from_three_zigzags(three: PlainFit) -> None:
    truth = truth_of(sailed("ferry", seed=21, heading_deg=80.0 * 21, duration_s=500.0))
    assert three.fit.converged and not three.left_out
    assert np.max(np.abs(three.fit.hull - truth) / three.fit.std) < 3.0
    assert three.agreement.p_value > LEVEL and three.agreement.widened < 1.5
    assert three.agreement.degrees_of_freedom == 12 and 0.0 < three.agreement.statistic < 30.0
    assert [one.run.name for one in three.alone] == ["ferry 21", "ferry 22", "ferry 23"]


def test_a_filter_that_runs_away_beside_its_point_shows_no_slope_there(
    three: PlainFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its square is no number, and one eigenvalue that is none ended a diagnosis."""
    fit, with_columns = three.fit, sensitivity.with_columns

    def astray(*given: Any) -> tuple[Passed, list[Float]]:
        base, found = with_columns(*given)
        found[0] = found[0].copy()
        found[0][:3] = np.inf, 1e200, np.nan
        return base, found

    monkeypatch.setattr(sensitivity, "with_columns", astray)
    with ThreadPoolExecutor(2) as workers:
        lines = linearise(fit.runs, [fit.point(k) for k in range(3)], workers)
    for line, before in zip(lines, fit.linearised, strict=True):
        assert not np.any(line.J[:3, 0])
        np.testing.assert_array_equal(line.J[3:], before.J[3:])
        assert np.all(np.isfinite(line.J.T @ line.J))


def test_information_of_the_runs_adds_up(three: PlainFit) -> None:
    trial = sailed("ferry", seed=21, heading_deg=80.0 * 21, duration_s=500.0)
    alone = identify(record_of(trial), SPEC, trial.truth.wind_arm_per_m, STANDARD, 90.0)
    for std, one in zip(three.fit.std, alone.parameters, strict=True):
        # three records alike: a third of the variance, by and large
        assert 0.45 < std / one.std < 0.75, one.name


def test_one_run_by_itself_is_the_estimate_of_that_run() -> None:
    trial = sailed("ferry", seed=21, heading_deg=80.0 * 21, duration_s=500.0)
    alone = identify(record_of(trial), SPEC, trial.truth.wind_arm_per_m, STANDARD, 90.0)
    common = fitted(run(21))
    assert common.agreement.statistic == pytest.approx(0.0, abs=1e-3) and common.agreement.p_value == 1.0
    assert np.max(np.abs(common.fit.hull - alone.hull.array()) / common.fit.std) < 0.05


def test_the_workers_do_not_matter_to_the_bits() -> None:
    first, second = fitted(run(21), run(22), workers=1), fitted(run(21), run(22))
    assert first.agreement == second.agreement and first.fit.log_likelihood == second.fit.log_likelihood
    np.testing.assert_array_equal(first.fit.hull, second.fit.hull)
    np.testing.assert_array_equal(first.fit.covariance, second.fit.covariance)


def test_linear_and_extended_filter_have_one_maximum(three: PlainFit) -> None:
    """Of single runs the linear filter finds it, of several the extended one."""
    fit = three.fit
    theta = np.concatenate([fit.hull, fit.levels.ravel()])
    with ThreadPoolExecutor(2) as workers:
        extended = CommonLikelihood(fit.runs, workers)
        value, _, information = extended.full(theta)
    score, linear_value = np.zeros(theta.size), 0.0
    for number, one in enumerate(fit.runs):
        linear, own = one.linear(), slice(6 + 6 * number, 12 + 6 * number)
        there = np.concatenate([fit.hull, fit.levels[number] - to_intensities(one.spec)])
        run_value, run_score, _ = linear.full(np.clip(there, linear.low, linear.high))
        linear_value += run_value
        score[:6] += run_score[:6]
        score[own] = run_score[6:]
    assert value == pytest.approx(linear_value, abs=MOST_APART)
    movable = free(extended, theta, score)
    # where the linear filter's maximum lies, in standard errors from that of the extended one
    step = information.masked(movable).solve(np.where(movable, score, 0.0))[:6]
    assert np.max(np.abs(step) / fit.std) < 0.05


def test_a_level_that_has_sunk_to_nothing_keeps_its_derivative(three: PlainFit) -> None:
    """By its square: there innovations are linear in it, however small it is."""
    filtered, point = three.fit.runs[0], three.fit.point(0)
    by_square = []
    for below in (0.5, 2.0, 4.0):
        levels = point.levels.copy()
        levels[0] = next_to_nothing(filtered.spec)[0] - below
        at = replace(point, levels=levels)
        base = sensitivity.passed(filtered, at)
        (column,) = sensitivity.columns(filtered, at, base, [sensitivity.N_HULL])
        by_square.append(column / np.exp(2.0 * levels[0]))
    assert np.max(np.abs(by_square[0])) > 0.0
    for other in by_square[1:]:
        np.testing.assert_allclose(other, by_square[0], atol=1e-2 * float(np.max(np.abs(by_square[0]))))


def test_a_climb_does_not_leave_for_hulls_that_no_vessel_has(three: PlainFit) -> None:
    length_m, hull = run(21).ship.length_m, three.fit.hull
    assert 1.0 < swiftness(hull, length_m) < 8.0
    poles = np.linalg.eigvals(hull[:4].reshape(2, 2) * length_m)
    assert np.max(np.abs(poles)) <= swiftness(hull, length_m)
    with ThreadPoolExecutor(2) as workers:
        common = CommonLikelihood(three.fit.runs, workers)
        quick = np.concatenate([hull * np.array([40.0, 1.0, 1.0, 40.0, 1.0, 1.0]), three.fit.levels.ravel()])
        value, score, _ = common.full(quick)
        assert value == -np.inf and not score.any()
        # a hull that is held is the caller's
        common.active[: common.shared] = False
        assert np.isfinite(common.full(quick)[0])


def test_standard_errors_grow_where_prediction_errors_are_not_white(three: PlainFit) -> None:
    assert uncertainty_of(three.fit).kind == "information"
    np.testing.assert_array_equal(uncertainty_of(three.fit).covariance, three.fit.covariance)
    wave = 0.004 * np.sin(0.15 * run(21).time_s)
    measured = run(21).measured.copy()
    measured[:, 1] += wave
    measured[:, 2] -= 0.004 / 0.15 * np.cos(0.15 * run(21).time_s)
    shaken = uncertainty_of(fitted(replace(run(21), measured=measured), run(22)).fit)
    assert shaken.kind in {"information", "sandwich"} and np.all(np.diag(shaken.covariance) > 0.0)


@pytest.mark.parametrize(("hull", "first"), [("ferry", 31), ("mariner", 36)])
def test_a_pool_of_short_zigzags_converges(hull: str, first: int) -> None:
    """In five minutes without a heading wind and current of single runs trade places and sink to nothing."""
    short = [run(seed, hull, 300.0) for seed in range(first, first + 5)]
    for i, one in enumerate(short):
        measured = one.measured.copy()
        measured[:, 2] = np.nan
        short[i] = replace(one, measured=measured)
    pool = fitted(*short)
    assert min(float(np.min(one.search.theta[[6, 8]])) for one in pool.alone) < np.log(0.01)
    assert pool.fit.converged and pool.fit.iterations <= 12


def with_rudder(run: GridRun, factor: float, offset_rad: float = 0.0) -> GridRun:
    """A run of a log that shows another rudder."""
    inputs = run.inputs.copy()
    inputs[:, 1] = factor * inputs[:, 1] + offset_rad
    line = replace(run.rudder_line, angle_rad=factor * run.rudder_line.angle_rad + offset_rad)
    return replace(run, inputs=inputs, rudder_line=line)


def test_two_ships_are_no_pool() -> None:
    # a rudder that does a tenth less: b1 and b2 of this ship are smaller
    found = fitted(run(21), run(22), replace(with_rudder(run(23), 1.0 / 0.9), name="changed"))
    assert found.agreement.p_value < 1e-6 and found.agreement.widened > 1.5
    off = {one.run.name: float(np.abs(off_in_std(one, found.fit)).max()) for one in found.alone}
    assert max(off, key=lambda name: off[name]) == "changed"


def test_what_cannot_be_identified_by_itself_stays_out_and_is_named() -> None:
    other = run(23)
    inputs = other.inputs.copy()
    inputs[:, 0] = 1e5
    rocket = replace(other, name="rocket", inputs=inputs)
    found = fitted(run(21), run(22), rocket)
    assert list(found.left_out) == ["rocket"] and len(found.alone) == 2
    with pytest.raises(DataRejected) as caught:
        fitted(rocket)
    assert caught.value.code == "no_ship_explains_it" and "rocket" in caught.value.details["left_out"]


def test_gross_errors_are_taken_out_of_the_run_that_is_pooled() -> None:
    measured = run(21).measured.copy()
    rows = np.flatnonzero(np.isfinite(measured[:, 0]))[7::29]
    measured[rows, 0] += 3.0
    found = fitted(replace(run(21), measured=measured), run(22))
    assert found.gross_errors == rows.size
    assert not np.isfinite(found.fit.runs[0].run.measured[rows, 0]).any()
    assert RunFilter(found.fit.runs[0].run, EffectModel(), SPEC).linear().active.sum() == 11
