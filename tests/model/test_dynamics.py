"""The derivatives of the motion are those of the motion, also where an effect lets the speed go with the states."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.batch import ONE
from kempf.pipeline.model.chain import PSI, R, V
from kempf.pipeline.model.dynamics import N_BEFORE, N_INPUT, PARAMETER, SHIP, dynamics
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.model.terms.program import DEPTH
from kempf.schemas.effects import catalogue, get
from kempf.schemas.instrument_noise import lasting_noise

SPEED, LENGTH, RUDDER = 7.0, 100.0, 0.3


def moved(model: EffectModel, values: Float, x: Float, exponent: float = 2.0) -> tuple[Float, Float]:
    """dx/dt and its derivatives, shapes (n,) and (n, n)."""
    hull, width = mariner_like(LENGTH).array()[:, None], N_BEFORE + model.extra
    symbols, slopes = np.zeros((PARAMETER + values.size, 1)), np.zeros((PARAMETER + values.size, width, 1))
    symbols[SHIP : SHIP + 10, 0] = [*hull[:, 0], LENGTH, 6.0, SPEED, 1.0]
    symbols[PARAMETER:, 0] = values
    for i in range(width):
        slopes[i, i] = 1.0
    row = np.zeros(N_INPUT)
    row[0] = SPEED
    f, J = np.zeros((width, 1)), np.zeros((width, width, 1))
    dynamics(
        *(x[:, None].copy(), row, np.array([RUDDER]), (hull, (0.0, 0.0, 0.0, 0.0, exponent, SPEED))),
        *(model.table, symbols, slopes, np.zeros((DEPTH, width + 1, 1)), np.zeros(1), np.zeros((width + 1, 1))),
        *(f, J, ONE),
    )
    return f[:, 0], J[:, :, 0]


def by_differences(model: EffectModel, values: Float, x: Float, exponent: float = 2.0) -> Float:
    """The same derivatives, column by column from the motion a little to both sides."""
    steps = 1e-6 * np.eye(x.size)
    ends = [[moved(model, values, x + sign * step, exponent)[0] for sign in (1.0, -1.0)] for step in steps]
    return np.column_stack([(above - below) / 2e-6 for above, below in ends])


@pytest.mark.parametrize("exponent", [2.0, 1.3])
def test_a_speed_that_goes_with_the_states_is_in_the_derivatives(exponent: float) -> None:
    model, values = EffectModel((get("speed_loss"),)), np.array([1.0, 0.2])
    x = np.zeros(N_BEFORE + model.extra)
    x[V], x[R], x[PSI], x[N_BEFORE] = -0.4, 0.015, 0.2, 0.6
    _, J = moved(model, values, x, exponent)
    np.testing.assert_allclose(J, by_differences(model, values, x, exponent), rtol=1e-6, atol=1e-9)


def test_states_of_instruments_stand_beside_those_of_effects_and_move_no_ship() -> None:
    own = EffectModel((get("waves"), get("memory")))
    whole = EffectModel((*own.effects, *lasting_noise().values()))
    values = np.array([p.steps[0] for _, p in whole.parameters])
    x = np.zeros(N_BEFORE + own.extra)
    x[V], x[R], x[N_BEFORE:] = -0.4, 0.015, 0.1
    f, J = moved(own, values[: len(own.names)], x)
    # noise of any size and at any moment: the rudder and the speed are where they were
    more, K = moved(whole, values, np.concatenate([x, np.full(whole.extra - own.extra, 0.7)]))
    np.testing.assert_array_equal(more[: x.size], f)
    np.testing.assert_array_equal(K[: x.size, : x.size], J)
    assert not np.any(K[: x.size, x.size :])


@pytest.mark.parametrize("name", sorted(set(catalogue()) - {"speed_loss"}))
def test_derivatives_by_every_state_are_there_where_an_effect_lets_the_speed_go_with_them(name: str) -> None:
    model = EffectModel((get(name), get("speed_loss")))
    values = np.array([0.3 * p.steps[0] for _, p in model.parameters])
    x = np.zeros(N_BEFORE + model.extra)
    x[V], x[R], x[PSI], x[N_BEFORE:] = -0.4, 0.015, 0.2, 0.1
    _, J = moved(model, values, x)
    np.testing.assert_allclose(J, by_differences(model, values, x), rtol=1e-5, atol=1e-8)
    assert np.any(J[N_BEFORE + model.extra - 1] != 0.0)
