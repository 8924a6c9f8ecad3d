"""Effects that go through the filter together do what each of them does alone."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.diagnose.screening import effect_responses
from kempf.pipeline.diagnose.screening.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.screening.effect_score import grid
from kempf.pipeline.diagnose.screening.ridge_reference import TERMS
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.pooled_fit import PooledFit, linearise
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.batch import MOST
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effect import Effect, Parameter
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from tests.diagnose.sailing import WORKERS, sailed

LEVELS = np.log(np.array([2e-3, 1e-5, 2e-2, 0.05, 6e-4, 2e-3]))


@pytest.fixture(scope="module")
def base() -> PooledFit:
    """A model with one effect already, at parameters near the truth, beside a short run."""
    model, spec = EffectModel((catalogue()["sway_quadratic"],)), ModelSpec()
    runs = tuple(RunFilter(run, model, spec) for run in sailed("none").runs[:2])
    hull, values = mariner_like(runs[0].run.ship.length_m).array(), np.array([-0.01])
    points = [Point(hull, values, LEVELS) for _ in runs]
    lines = linearise(runs, points, WORKERS)
    levels = np.stack([LEVELS, LEVELS])
    stated = (0.0, np.full((7, 7), np.nan), tuple(lines), True, "", 0)
    return PooledFit(model, runs, hull, values, levels, *stated)


def alone(base: PooledFit, trial: EffectTrial) -> np.ndarray | None:
    return effect_responses._passed(base, [trial])[0]


def test_together_is_as_alone(base: PooledFit) -> None:
    chosen = [effect for effect in catalogue().values() if effect.name != "sway_quadratic"]
    trials = [EffectTrial(effect, steps) for effect in [*chosen[::3], *TERMS[:9]] for steps in grid(effect)]
    found = responses(base, trials, WORKERS)
    assert max(map(len, effect_responses._bundles(trials))) > 5
    for trial, together in zip(trials, found, strict=True):
        single = alone(base, trial)
        if single is None:
            assert together is None
            continue
        assert together is not None and together.shape == (2 * base.count, len(trial.making))
        np.testing.assert_allclose(
            # at least what rounding makes of nothing: of one day's runs no other day's load is seen
            *(together, single),
            rtol=1e-5,
            atol=max(1e-6 * np.abs(single).max(), 1e-9),
            err_msg=trial.effect.name,
        )


def test_no_bundle_is_wider_than_the_lanes_and_none_is_lost() -> None:
    trials = [EffectTrial(effect, steps) for effect in catalogue().values() for steps in grid(effect)]
    bundles = effect_responses._bundles(trials)
    assert sorted(i for bundle in bundles for i in bundle) == list(range(len(trials)))
    for bundle in bundles:
        assert sum(len(trials[i].making) for i in bundle) <= MOST or len(bundle) == 1


def test_one_that_is_no_number_takes_no_other_with_it(base: PooledFit) -> None:
    size = Parameter(name="c", unit="1", low=-1.0, high=1.0, steps=(0.01,), meaning="size")
    wild = Effect(name="wild", plain="wild", reference="none", parameters=(size,), terms={"yaw": "c/(r-r)"})
    tame = catalogue()["yaw_quadratic"]
    trials = [EffectTrial(effect, steps) for effect in (wild, tame) for steps in grid(effect)]
    first, *others = responses(base, trials, WORKERS)
    assert first is None and all(one is not None for one in others)
