"""The yaw rate to which a ship comes with the rudder that she holds."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.segment.rudder.measured import Signals
from kempf.pipeline.segment.rudder.yaw_rate import settling_rate

HOLD_S, STEP_S = 120.0, 0.5


def signals(rate_deg_s: Float, noise_deg: float = 0.05, seed: int = 1) -> Signals:
    """A rudder that is held, and a compass with its noise."""
    time = STEP_S * np.arange(rate_deg_s.size)
    noise = noise_deg * np.random.default_rng(seed).standard_normal(time.size)
    heading = np.deg2rad(STEP_S * np.cumsum(rate_deg_s) + noise)
    return Signals(0, time, heading, time, np.zeros(time.size), 0.0)


def decay(time_constant_s: float, left: float = 0.0) -> Float:
    time = STEP_S * np.arange(round(HOLD_S / STEP_S) + 1)
    return np.asarray(left + (2.0 - left) * np.exp(-time / time_constant_s))


@pytest.mark.parametrize("left", [0.0, 0.7, -0.3])
@pytest.mark.parametrize("time_constant_s", [30.0, 60.0])
def test_what_is_missing_is_added(time_constant_s: float, left: float) -> None:
    found = settling_rate(signals(decay(time_constant_s, left)), 0.0, HOLD_S)
    assert found.on_the_way
    value, std, last = np.rad2deg([found.comes_to, found.comes_to_std, found.last.value])
    assert abs(value - left) < 0.25 * abs(last - left)
    # as much as was missing is its error
    assert std == pytest.approx(abs(last - left), rel=0.3)


def test_no_more_is_added_than_has_changed() -> None:
    found = settling_rate(signals(decay(400.0)), 0.0, HOLD_S)
    value, std, last = np.rad2deg([found.comes_to, found.comes_to_std, found.last.value])
    assert value > 0.5 * last
    # she may come to nothing, and may be said to go on
    assert value - 2.0 * std < 0.0 < last


def test_a_rate_that_does_not_slow_down_says_nothing() -> None:
    time = STEP_S * np.arange(round(HOLD_S / STEP_S) + 1)
    found = settling_rate(signals(0.5 + 0.005 * time), 0.0, HOLD_S)
    assert not found.on_the_way
    assert found.comes_to == found.last.value
    assert found.comes_to_std > 2.0 * found.comes_to


def test_wandering_wind_is_hardly_ever_a_trend() -> None:
    errors, ways = [], []
    for seed in range(60):
        random = np.random.default_rng(seed)
        wander = np.zeros(round(HOLD_S / STEP_S) + 1)
        memory = float(np.exp(-STEP_S / 30.0))
        for k in range(1, wander.size):
            wander[k] = memory * wander[k - 1] + 0.02 * np.sqrt(1.0 - memory**2) * random.standard_normal()
        found = settling_rate(signals(0.5 + wander, seed=seed), 0.0, HOLD_S)
        errors.append(np.rad2deg(found.comes_to) - 0.5)
        ways.append(found.on_the_way)
    assert np.mean(ways) < 0.1
    assert np.max(np.abs(errors)) < 0.1
