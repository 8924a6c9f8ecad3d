"""A log that shows means is known by its noise; noise that lasts is not taken for a mean."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.averaging import readings_averaged
from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.units import SECOND_NS

COUNT, STD = 1500, 0.05


def ship_and(noise: Float) -> Series:
    """A speed that sinks in turns as a ship's does, read once a second."""
    time = np.arange(noise.size, dtype=np.float64)
    speed = 7.0 - 0.4 * np.sin(2.0 * np.pi * time / 90.0) ** 2
    return Series((time * SECOND_NS).astype(np.int64), speed + noise)


def white(count: int = COUNT, seed: int = 1) -> Float:
    return STD * np.random.default_rng(seed).standard_normal(count)


def test_fresh_noise_is_no_mean() -> None:
    assert readings_averaged(ship_and(white())) == 1.0


@pytest.mark.parametrize("many", [3, 5, 10])
def test_a_running_mean_is_found_with_its_length(many: int) -> None:
    noise = np.convolve(white(COUNT + many - 1), np.full(many, 1.0 / many), mode="valid")
    assert readings_averaged(ship_and(noise)) == many


def test_a_mean_over_a_time_that_now_holds_a_reading_more_lies_between() -> None:
    fresh, more = white(COUNT + 5), np.random.default_rng(2).integers(0, 2, COUNT)
    noise = np.array([np.mean(fresh[k + 1 - m : k + 6]) for k, m in enumerate(more)])
    assert readings_averaged(ship_and(noise)) == 5.5


@pytest.mark.parametrize("kept", [0.5, 0.8, 0.95])
def test_noise_that_lasts_is_no_mean(kept: float) -> None:
    noise = white()
    for k in range(1, noise.size):
        noise[k] = kept * noise[k - 1] + np.sqrt(1.0 - kept**2) * noise[k]
    assert readings_averaged(ship_and(noise)) == 1.0


def test_a_speed_whose_changes_are_above_its_noise_is_no_mean() -> None:
    # a boat's speed falls and rises within seconds: her spectrum has gaps of its own
    rng, value = np.random.default_rng(3), np.empty(COUNT)
    time, value[0] = 0.5 * np.arange(COUNT), 1.8
    turning = np.abs(np.sin(2.0 * np.pi * time / 11.0)) > 0.6
    for k in range(1, COUNT):
        value[k] = value[k - 1] + 0.4 * (1.8 - 0.5 * turning[k] - value[k - 1])
    value += 1e-4 * rng.standard_normal(COUNT)
    assert readings_averaged(Series((time * SECOND_NS).astype(np.int64), value)) == 1.0


def test_a_short_log_or_one_with_gaps_says_nothing() -> None:
    log = ship_and(np.convolve(white(COUNT + 4), np.full(5, 0.2), mode="valid"))
    assert readings_averaged(Series(log.time_utc_ns[:100], log.value[:100])) == 1.0
    there = np.arange(COUNT) % 300 > 30
    assert readings_averaged(Series(log.time_utc_ns[there], log.value[there])) == 1.0
