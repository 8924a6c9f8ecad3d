"""Two questions of every effect: is it there, and does it matter."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from kempf.pipeline.diagnose.steps.by_prediction import _idle
from kempf.pipeline.diagnose.steps.immaterial import Weight
from kempf.pipeline.diagnose.steps.improves_prediction import better_ahead, falls, worsens
from kempf.pipeline.diagnose.steps.ladder import Ladder
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.steps.legs import in_std
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.shooting.ahead import Ahead, ShootingRange
from kempf.pipeline.shooting.left_out import LeftOut
from kempf.schemas.effect import Effect
from kempf.schemas.effects import catalogue, get


def ahead(level: float, spread: float = 0.1, seed: int = 1, *, held: float | None = None) -> Ahead:
    """A model whose errors lie about a level in every window of four manoeuvres."""

    def errors(mean: float) -> LeftOut:
        windows = tuple(
            np.abs(np.random.default_rng([seed, k]).normal(mean, spread * mean, (12, 3))) / 3.0 for k in range(4)
        )
        return LeftOut(np.array([w.sum(axis=1).mean() for w in windows]), windows)

    none = LeftOut(np.zeros(0), ())
    made = SimpleNamespace(left_out=errors(level), own=errors(level), held=none if held is None else errors(held))
    return cast("Ahead", made)


def test_an_error_that_falls_in_most_manoeuvres_is_a_fall() -> None:
    assert falls(ahead(2.0), ahead(1.0, seed=2))
    assert not falls(ahead(1.0), ahead(2.0, seed=2)) and worsens(ahead(1.0), ahead(2.0, seed=2))
    # by two per cent nobody is served, however sure that is
    assert not falls(ahead(1.0, 1e-4), ahead(0.98, 1e-4, seed=2))
    assert not worsens(ahead(1.0, 0.5), ahead(1.02, 0.5, seed=2))


def test_what_helps_the_fitted_and_harms_the_held_out_is_refused() -> None:
    before, after = ahead(2.0, held=1.0), ahead(1.0, seed=2, held=3.0)
    assert worsens(before, after) and not falls(before, after)


@pytest.mark.parametrize(
    ("fall", "t", "shift", "in_std", "matters"),
    [
        (0.3, 5.0, 0.0, 0.1, True),
        (0.015, 3.0, 0.0, 0.1, False),
        (0.001, 5.0, 0.0, 0.1, False),
        (-0.001, -1.0, 0.1, 2.5, True),
        # a gyro that reads 0.3 % low: sure of it, and nobody would notice
        (-0.001, -1.0, 0.003, 9.0, False),
        (np.nan, np.nan, 0.0, 0.0, True),
    ],
)
def test_an_effect_matters_where_a_prediction_or_the_hull_moves(
    fall: float, t: float, shift: float, in_std: float, matters: bool
) -> None:
    assert Weight(fall, t, shift, in_std).matters is matters


def test_sums_that_hang_together_are_less_sure_than_their_parts() -> None:
    independent = np.random.default_rng(5).normal(0.3, 1.0, 400)
    blocks = np.repeat(np.random.default_rng(6).normal(0.3, 1.0, 20), 20)
    assert in_std(independent) == pytest.approx(6.0, abs=1.5)
    assert in_std(blocks.reshape(20, 20).sum(axis=1)) < 0.5 * in_std(blocks)
    assert in_std(np.array([3.0])) == 0.0


@pytest.mark.parametrize(("best_by_likelihood", "refitted_too"), [(1, False), (9, True), (11, False)])
def test_the_likeliest_effect_worth_it_is_refitted_wherever_the_screen_by_legs_ranks_it(
    best_by_likelihood: int, refitted_too: bool
) -> None:
    effects = list(catalogue().values())[:12]
    # eleven are worth a refit, the last one is not
    screened = [(0.5 + 0.01 * k if k < 11 else 0.999, effect) for k, effect in enumerate(effects)]
    refits: list[str] = []

    def with_effect(base: Ahead, effect: Effect) -> None:
        refits.append(effect.name)

    shooting = cast("ShootingRange", SimpleNamespace(screened=lambda base, of: screened, with_effect=with_effect))
    plain = cast("Ahead", SimpleNamespace(fit=SimpleNamespace(cost=1.0)))
    scores = {effect.name: float(k == best_by_likelihood) for k, effect in enumerate(effects)}
    assert better_ahead(shooting, plain, effects, scores) is None
    first_six = [effect.name for effect in effects[:6]]
    # where the likeliest is worth nothing ahead, the likeliest of the others is the first of them
    assert refits == [*first_six, effects[best_by_likelihood].name] if refitted_too else refits == first_six


@pytest.mark.parametrize(
    ("without", "size", "idle"),
    [
        # legs are predicted as well without it
        ((1.0, 0.1), 9.0, True),
        # by a tenth worse, as chance may have it: it depends on whether there is anything of it
        ((1.1, 1.5), 0.7, True),
        ((1.1, 1.5), 9.0, False),
        # clearly worse: it is needed whatever its size
        ((2.0, 0.1), 0.7, False),
    ],
)
def test_an_effect_whose_part_another_has_taken_over_is_taken_out(
    without: tuple[float, float], size: float, idle: bool
) -> None:
    first, last = get("cross_flow_drag"), get("cross_flow_cubic")
    now = ahead(1.0, without[1])
    vars(now)["fit"] = SimpleNamespace(values=np.array([size, 5.0]))
    vars(now)["std"] = np.ones(8)
    vars(now)["model"] = EffectModel((first, last))
    steps = [SimpleNamespace(added=added, ahead=now) for added in (None, first, last)]
    shooting = SimpleNamespace(without=lambda *_: ahead(without[0], without[1], seed=2))
    found = _idle(cast("Ladder", SimpleNamespace(shooting=shooting)), cast("list[Step]", steps))
    assert found is (first if idle else None)
