"""The climb over several runs asks the filter for no more than it needs, and every way gives the same bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kempf.pipeline.diagnose.screening.screen import score
from kempf.pipeline.diagnose.steps.confirm import confirm, unseen
from kempf.pipeline.diagnose.steps.ladder_step import step_of
from kempf.pipeline.estimate import pooled_fit, sensitivity
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.levels import first_levels
from kempf.pipeline.estimate.pooled_fit import Linearised, PooledFit, linearise
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.batch import MOST
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effects import get
from tests.diagnose.sailing import WORKERS, Sailed, sailed


class Counted:
    """The filter, and how often it was asked."""

    def __init__(self) -> None:
        self.passes, self.ask, self.ask_at_once = 0, sensitivity.passed, sensitivity.passes

    def one(self, filtered: RunFilter, point: Point) -> Passed:
        self.passes += 1
        return self.ask(filtered, point)

    def several(self, filtered: RunFilter, points: Sequence[Point]) -> list[Passed]:
        self.passes += len(points)
        return self.ask_at_once(filtered, points)


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Counted:
    found = Counted()
    monkeypatch.setattr(sensitivity, "passed", found.one)
    monkeypatch.setattr(sensitivity, "passes", found.several)
    return found


#: a model that asks the extended filter, though its effect is hardly there
MODEL = EffectModel((get("sway_quadratic"),))


def fit_of(ship: Sailed, iterations: int, model: EffectModel = MODEL) -> PooledFit:
    """Climb from an ordinary ship and ordinary levels."""
    filtered = [RunFilter(run, model, ship.spec) for run in ship.runs[:2]]
    levels = np.array([first_levels(one) for one in filtered])
    hull, values = mariner_like(ship.runs[0].ship.length_m).array(), np.full(len(model.names), 0.1)
    return pooled_fit.fit(filtered, hull, levels, values, WORKERS, iterations)


def test_derivatives_are_asked_for_only_where_the_search_goes_on(counted: Counted) -> None:
    ship = sailed("none")
    names = ("sway_quadratic", "yaw_quadratic", "sway_cubic", "yaw_cubic", "sway_v2r", "yaw_v2r")
    model = EffectModel(tuple(get(name) for name in names))
    two, each = 2, sum(len(sensitivity.active(one)) for one in fit_of(ship, 0, model).runs)
    assert each > two * MOST
    counted.passes = 0
    beginning = fit_of(ship, 0, model)
    # the start and its derivatives, and none of it again for the linearisation that a fit keeps
    assert counted.passes == two + each
    layout = pooled_fit.CommonLikelihood(beginning.runs, WORKERS)
    theta = np.concatenate([beginning.hull, beginning.values / layout.unit, beginning.levels.ravel()])
    value, gradient, _ = layout.full(theta)
    shared = 6 + len(names)
    lower = theta + 0.1 * np.concatenate([np.zeros(shared), np.sign(-gradient[shared:])])
    counted.passes = 0
    there, slope, _ = layout.full(lower)
    assert there < value and not slope.any()
    # the pass there, and what goes through beside it in the same lanes
    assert counted.passes == two * MOST


def test_a_point_beside_which_the_filter_runs_away_is_no_place_to_go_on_from(monkeypatch: pytest.MonkeyPatch) -> None:
    beginning = fit_of(sailed("none"), 0)
    real = pooled_fit._finished

    def away(*given: Any) -> tuple[Linearised, ...]:
        first, *others = real(*given)
        J = first.J.copy()
        J[3, 1] = 1e200
        return (replace(first, J=J), *others)

    layout = pooled_fit.CommonLikelihood(beginning.runs, WORKERS)
    theta = np.concatenate([beginning.hull, beginning.values / layout.unit, beginning.levels.ravel()])
    with monkeypatch.context() as patched:
        patched.setattr(pooled_fit, "_finished", away)
        value, slope, _ = layout.full(theta)
    assert value == -np.inf and not slope.any()
    # and nothing of it is kept
    assert layout.full(theta)[0] == beginning.log_likelihood


def test_a_run_by_itself_and_runs_together_are_linearised_to_the_same_bits() -> None:
    fit = fit_of(sailed("none"), 3)
    for number, line in enumerate(fit.linearised):
        run, point = fit.runs[number], fit.point(number)
        (alone,) = linearise((run,), (point,), WORKERS)
        assert alone.index == line.index
        assert np.array_equal(alone.J, line.J) and np.array_equal(alone.u, line.u)


def test_the_gains_of_a_candidate_are_those_over_what_was_asked_of_the_base_before() -> None:
    ship = sailed("none")
    base, held = fit_of(ship, 40, EffectModel()), ship.runs[2:3]
    before = unseen(base, held, WORKERS)
    one = confirm(base, before, score(base, get("sway_quadratic"), WORKERS), held, WORKERS)
    after = unseen(one.fit, held, WORKERS)
    assert np.array_equal(one.fold_gains, after.folds - before.folds)
    assert np.array_equal(one.held_out_gains, after.held - before.held)


def test_a_rung_by_itself_has_the_free_runs_of_its_manoeuvres_in_their_order() -> None:
    ship = sailed("none")
    found = step_of(fit_of(ship, 3, EffectModel()), ship.runs[2:], None)
    assert [one.name for one in found.fitted] == ["run 0", "run 1"]
    assert [one.name for one in found.held] == [run.name for run in ship.runs[2:]]
