"""Effects are as large as in the last model; what could be in their place is as large as beside the rest of it."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.diagnose.steps.final_sizes import final_sizes, refitted_size
from kempf.pipeline.diagnose.steps.ladder_step import Step, without_members
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effects import get
from tests.diagnose.sailing import WORKERS, sailed


@cache
def fitted(*names: str) -> PooledFit:
    ship = sailed("rudder_lag")
    return staged(ship.runs[:3], ship.spec, [get(name) for name in names], WORKERS)[1][-1]


def rung(fit: PooledFit, **alike: PooledFit) -> Step:
    """A rung chosen from these effects by these refits."""
    pairs = [
        (
            SimpleNamespace(effect=get(name)),
            cast(Confirmation, SimpleNamespace(fit=one, stated=with_instants(one, WORKERS))),
        )
        for name, one in alike.items()
    ]
    return Step(fit, get(next(iter(alike))) if alike else None, tuple(pairs), (), (), (), ())


def test_a_size_is_that_of_the_last_model() -> None:
    plain, lag, dead, last = (
        fitted(*names) for names in ((), ("rudder_lag",), ("dead_time",), ("rudder_lag", "yaw_quadratic"))
    )
    steps = [rung(plain), rung(lag, rudder_lag=lag, dead_time=dead), rung(last, yaw_quadratic=last)]
    sizes = final_sizes(steps, WORKERS)
    assert set(sizes) == {"rudder_lag", "dead_time", "yaw_quadratic"}
    assert sizes["rudder_lag"].values[0] == last.values[0] != lag.values[0]
    widened = agreement_of(last).widened
    assert sizes["rudder_lag"].std[0] == pytest.approx(widened * last.std[6]) and sizes["rudder_lag"].widened == widened
    np.testing.assert_array_equal(sizes["yaw_quadratic"].values, last.values[1:])
    beside = fitted("dead_time", "yaw_quadratic")
    assert sizes["dead_time"].values[0] == pytest.approx(beside.values[0], abs=0.1 * beside.std[6])
    assert sizes["dead_time"].values[0] != dead.values[0]


def test_what_was_chosen_later_is_in_the_place_of_nothing() -> None:
    plain, lag, quadratic, last = (
        fitted(*names) for names in ((), ("rudder_lag",), ("yaw_quadratic",), ("rudder_lag", "yaw_quadratic"))
    )
    steps = [rung(plain), rung(lag, rudder_lag=lag, yaw_quadratic=quadratic), rung(last, yaw_quadratic=last)]
    settled = without_members(steps)
    chosen = [[candidate.effect.name for candidate, _ in step.chosen_from] for step in settled]
    assert chosen == [[], ["rudder_lag"], ["yaw_quadratic"]]
    sizes = final_sizes(settled, WORKERS)
    np.testing.assert_array_equal(sizes["yaw_quadratic"].values, last.values[1:])


def test_a_last_model_that_is_the_refit_itself_asks_for_no_other() -> None:
    plain, lag, dead = fitted(), fitted("rudder_lag"), fitted("dead_time")
    (_, (_, other)) = (step := rung(lag, rudder_lag=lag, dead_time=dead)).chosen_from
    sizes = final_sizes([rung(plain), step], WORKERS)
    assert sizes["dead_time"].values[0] == dead.values[0] == refitted_size(get("dead_time"), other).values[0]
    assert final_sizes([rung(plain)], WORKERS) == {}
