"""Effects that only together make predictions better: found where they are, and nowhere else."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
from scipy.optimize import lsq_linear

from kempf.pipeline.diagnose.steps.joint import _sets, _worth, better_together, kinds
from kempf.pipeline.shooting.ahead import Ahead, shooting_range
from kempf.pipeline.shooting.normal_equations import NormalEquations
from kempf.schemas.effects import catalogue, get
from tests.diagnose.sailing import WORKERS, sailed


def equations(J: np.ndarray, e: np.ndarray, low: np.ndarray, high: np.ndarray) -> NormalEquations:
    return NormalEquations(np.zeros(J.shape[1]), low, high, float(e @ e), J.T @ J, J.T @ e)


def test_a_step_within_bounds_is_the_best_one() -> None:
    generator = np.random.default_rng(3)
    J, e = generator.normal(size=(40, 5)), generator.normal(size=40)
    low, high = np.full(5, -0.05), np.full(5, 0.05)
    made = equations(J, e, low, high)
    step = made.step(0.0)
    best = lsq_linear(J, -e, (low, high))
    assert np.all((step >= low) & (step <= high)) and np.any(np.abs(step) == 0.05)
    assert made.cost_after(step) <= 1.02 * 2.0 * best.cost
    assert np.isclose(made.cost_after(step), np.sum((e + J @ step) ** 2))
    # those of some unknowns are those of their columns alone
    two = np.array([1, 3])
    free = equations(J, e, np.full(5, -9.0), np.full(5, 9.0)).of(two)
    assert np.allclose(free.step(0.0), np.linalg.lstsq(J[:, two], -e, rcond=None)[0])


def test_what_hides_each_other_is_seen_together_only() -> None:
    generator = np.random.default_rng(5)
    effects = [get("propeller_wash"), get("rudder_asymmetry"), get("cross_flow_drag"), get("yaw_cubic")]
    J, e = generator.normal(size=(60, 6 + len(effects))), generator.normal(size=60)
    first, second = J[:, 6], generator.normal(size=60)
    second -= first * (first @ second) / (first @ first)
    # two opposite columns, and an error that lies between them
    J[:, 7] = -first + 0.2 * second
    e = 20.0 * second + 0.1 * e
    wide = np.full(J.shape[1], 1e3)
    linear, base = equations(J, e, -wide, wide), SimpleNamespace(fit=SimpleNamespace(shared=np.zeros(6)))

    def left(*columns: int) -> float:
        part = linear.of(np.array([*range(6), *columns]))
        return part.cost_after(part.step(0.0)) / linear.cost

    assert left(6) > 0.7 and left(7) > 0.7 and left(6, 7) < 0.05
    (chosen, shared), *_ = _worth(linear, cast("Ahead", base), effects)
    assert [effect.name for effect in chosen] == ["propeller_wash", "rudder_asymmetry"]
    assert shared.shape == (8,)


def test_no_set_bends_the_hull_twice() -> None:
    hulls = [effect for effect in catalogue().values() if effect.group == "hull"]
    assert {len(chosen) for chosen in _sets(hulls)} == {1}
    rudder = get("rudder_stall")
    assert {frozenset(e.name for e in chosen) for chosen in _sets([*hulls[:2], rudder]) if len(chosen) > 1} == {
        frozenset((hulls[0].name, rudder.name)),
        frozenset((hulls[1].name, rudder.name)),
    }


def test_formulas_of_one_thing_are_of_one_kind_and_others_are_not() -> None:
    def of(*names: str) -> list[str]:
        return kinds([get(name) for name in names])

    assert of("wind_force", "propeller_wash", "cross_flow_drag") == of("sway_vr2", "speed_exponent", "wind_force")
    assert of("wind_force", "propeller_wash") != of("earth_current", "propeller_wash")
    assert of("wind_force", "propeller_wash") != of("wind_force", "rudder_stall")
    assert of("propeller_wash") != of("propeller_wash", "cross_flow_drag")


def test_a_ship_without_effects_gets_none_and_one_held_out_run_confirms_nothing() -> None:
    ship = sailed("none")
    effects = [effect for effect in catalogue().values() if not effect.needs]
    two = shooting_range(ship.runs[:-2], ship.runs[-2:], ship.spec, WORKERS)
    assert better_together(two, two.plain, effects) is None
    dragged = sailed("cross_flow_drag")
    one = shooting_range(dragged.runs[:-1], dragged.runs[-1:], dragged.spec, WORKERS)
    assert better_together(one, one.plain, effects) is None
