"""The Monte Carlo at the information limit in small: one ship, few runs, her errors beside both bounds."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from benchmarks.identify.information_limit import record_of, run, settings_of, true_theta, wanted
from benchmarks.identify.information_result import Case, Cell, bound_of, gather
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.simulate.trial import simulate_trial
from kempf.schemas.model_spec import ModelSpec

RUNS = 6


@lru_cache(maxsize=4)
def cell(case: Case) -> Cell:
    return gather([run(case, number) for number in range(RUNS)])


def test_errors_lie_at_the_bound_where_the_disturbances_are_those_of_the_model() -> None:
    found = cell(Case("mariner", 1.0, environment="drawn"))
    assert found.failures == 0
    # 36 correlated numbers: a ratio of the rms error to the bound is good to a fifth or so
    assert 0.6 < np.sqrt(np.mean((found.rms / found.bound) ** 2)) < 1.4
    assert np.max(np.abs(found.z)) < 4.0
    # what is reported is the bound at the estimate, not at the truth: alike where the levels are found
    np.testing.assert_allclose(found.own / found.bound, 1.0, atol=0.35)
    assert found.levels["sigma_r"] == pytest.approx(np.deg2rad(0.03), rel=0.05)


def test_the_papers_errors_are_beaten_three_times_in_its_own_wind_and_stream() -> None:
    found = cell(Case("mariner", 1.0))
    assert found.failures == 0
    assert np.all(found.rms < np.array([0.10, 0.10, 0.25, 0.20, 0.20, 0.05]) / 3.0)
    assert np.max(np.abs(found.z)) < 4.0


def test_the_heading_is_worth_most_to_the_yaw_parameters() -> None:
    bounds = []
    for with_heading in (True, False):
        case = Case("mariner", 1.0, with_heading=with_heading)
        trial = simulate_trial(settings_of(case, 0))
        record = record_of(trial, case)
        objective = MaximumLikelihoodSettings().bind(record, ModelSpec(moment="none"), trial.truth.wind_arm_per_m)
        theta = true_theta(case)
        assert record.used == (True, True, with_heading)
        bounds.append(bound_of(objective.full(theta)[2], objective.active & (theta > objective.low + 1e-9)))
    gain = bounds[1] / bounds[0]
    assert np.all(gain > 1.0)
    assert gain[5] > 2.0


def test_the_bound_is_that_of_a_known_information() -> None:
    # two blocks: a noise level that is known costs nothing, one that is free costs what it shares with a parameter
    information = np.diag(np.arange(1.0, 13.0))
    information[0, 6] = information[6, 0] = 1.0
    free = np.array([True] * 7 + [False] * 5)
    bound = bound_of(information, free)
    assert bound[0] == pytest.approx(1.0 / np.sqrt(1.0 - 1.0 / 7.0))
    np.testing.assert_allclose(bound[1:], 1.0 / np.sqrt(np.arange(2.0, 7.0)))
    free[6] = False
    assert bound_of(information, free)[0] == pytest.approx(1.0)


def test_cells_take_turns_and_the_grid_gets_most_runs() -> None:
    tasks = wanted(8)
    counts = {case: sum(one == case for one, _ in tasks) for case, _ in tasks}
    grid = [case for case in counts if case.on_grid]
    assert len(grid) == 15
    assert all(counts[case] == 8 for case in grid)
    assert all(counts[case] in (1, 2) for case in counts if not case.on_grid)
    assert [number for _, number in tasks] == sorted(number for _, number in tasks)


def test_runs_of_one_cell_differ_and_repeat() -> None:
    case = Case("mariner", 1.0)
    assert len({settings_of(case, number).seed for number in range(5)}) == 5
    assert settings_of(case, 3) == settings_of(case, 3)
    assert settings_of(case, 3).seed != settings_of(Case("ferry", 1.0), 3).seed
    # what is compared with a cell shares its draws
    assert settings_of(case, 3).seed == settings_of(Case("mariner", 1.0, environment="drawn"), 3).seed
