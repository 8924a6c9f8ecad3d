"""The score of an effect that is absent is chi-squared over many noises; of one that is there it finds the size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from kempf.pipeline.diagnose.screening.screen import Candidate, score
from kempf.pipeline.estimate import pooled_fit
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.pooled_fit import PooledFit, linearise
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from tests.diagnose.sailing import WORKERS, sailed

#: no disturbance: then a free run and white noise are all there is, and the model is true
STILL = ModelSpec(wind="none", moment="none", current="none", rate_bias=False)
NOISE = np.array([0.05, 6e-4, 2e-3])
LEVELS = np.log(np.array([1e-4, 1e-6, 1e-3, *NOISE]))
EFFECTS = ("sway_quadratic", "rudder_lag", "gyro_scale")
_START = np.zeros(8)


@pytest.fixture(scope="module")
def quiet() -> GridRun:
    run = sailed("none").runs[0]
    return replace(run, rudder_noise=np.zeros_like(run.rudder_noise), offset_s=np.zeros_like(run.offset_s))


def scored(run: GridRun, truth: np.ndarray, seed: int, name: str) -> Candidate:
    """Score an effect at the true parameters of a run that is ``truth`` and white noise."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, truth.shape) * NOISE
    filtered = RunFilter(replace(run, measured=truth + noise), EffectModel(), STILL)
    hull = mariner_like(run.ship.length_m).array()
    point = Point(hull, np.zeros(0), LEVELS)
    (line,) = linearise((filtered,), (point,), WORKERS)
    base = PooledFit(
        *(EffectModel(), (filtered,), hull, np.zeros(0), LEVELS[None, :], line.passed.log_likelihood),
        *(np.full((6, 6), np.nan), (line,), True, "", 0),
    )
    return score(base, catalogue()[name], WORKERS)


def test_the_score_of_what_is_not_there_is_chi_squared(quiet: GridRun) -> None:
    hull = mariner_like(quiet.ship.length_m).array()
    truth = RunFilter(quiet, EffectModel(), STILL).free(hull, np.zeros(0), _START)
    for name in EFFECTS:
        found = [scored(quiet, truth, seed, name) for seed in range(60)]
        assert kstest([one.score for one in found], "chi2", args=(1,)).pvalue > 0.01, name
        # the expected change scatters as its standard error says
        assert np.std([one.change[0] / one.std[0] for one in found]) == pytest.approx(1.0, abs=0.3)
        assert all(0.0 <= one.absorption < 1.0 for one in found)


@pytest.mark.parametrize(("name", "size"), [("sway_quadratic", 0.3), ("gyro_scale", 0.02)])
def test_the_expected_change_beside_a_fitted_hull_is_the_effect(quiet: GridRun, name: str, size: float) -> None:
    hull = mariner_like(quiet.ship.length_m).array()
    model = EffectModel((catalogue()[name],))
    truth = RunFilter(quiet, model, STILL).free(hull, np.array([size]), _START)
    noise = np.random.default_rng(1).normal(0.0, 1.0, truth.shape) * NOISE
    run = replace(quiet, measured=truth + noise)
    base = pooled_fit.fit([RunFilter(run, EffectModel(), STILL)], hull, LEVELS[None, :], np.zeros(0), WORKERS)
    one = score(base, catalogue()[name], WORKERS)
    assert base.converged and one.score > 20.0 and one.p_value < 1e-4
    assert one.change[0] == pytest.approx(size, abs=3.0 * one.std[0] + 0.1 * size)
