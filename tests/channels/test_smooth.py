"""The speed without its noise and its spikes."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.lateral_speed import noise_std
from kempf.pipeline.channels.series import SECOND_NS, Series
from kempf.pipeline.channels.smooth import smoothed, without_spikes


def slow(period_s: float = 1.0, noise: float = 0.05, seed: int = 0) -> tuple[Series, np.ndarray]:
    time = np.arange(0.0, 900.0, period_s)
    truth = 8.0 - 0.8 * np.sin(np.pi * time / 150.0) ** 2
    read = truth + noise * np.random.default_rng(seed).standard_normal(time.size)
    return Series((time * SECOND_NS).astype(np.int64), read), truth


def test_most_of_the_noise_goes_and_the_speed_stays() -> None:
    # fewer readings leave more
    for period_s, share in ((0.2, 0.35), (1.0, 0.5), (2.0, 0.65)):
        read, truth = slow(period_s)
        smooth = smoothed(read, noise_std(read))
        found = smooth.series
        np.testing.assert_array_equal(found.time_utc_ns, read.time_utc_ns)
        assert np.std(found.value - truth) < share * 0.05
        assert abs(np.mean(found.value - truth)) < 0.2 * 0.05


def test_a_speed_without_noise_is_left_alone() -> None:
    read, _ = slow(noise=0.0)
    assert smoothed(read, 0.0).series is read
    few = Series(read.time_utc_ns[:8], read.value[:8])
    assert smoothed(few, 0.05).series is few


def test_a_change_faster_than_the_noise_allows_is_not_smoothed_away() -> None:
    time = np.arange(0.0, 600.0)
    truth = 8.0 + np.sin(2 * np.pi * time / 20.0)
    read = Series((time * SECOND_NS).astype(np.int64), truth + 0.02 * np.random.default_rng(1).standard_normal(600))
    assert np.std(smoothed(read, noise_std(read)).series.value - truth) < 0.02


def test_spikes_go_and_are_counted_steps_stay() -> None:
    read, _ = slow()
    value = read.value.copy()
    value[[50, 200, 201, 640]] += [4.0, -3.0, -3.0, 6.0]
    found, count = without_spikes(Series(read.time_utc_ns, value))
    assert count == 4 and len(found) == len(read) - 4
    assert without_spikes(read) == (read, 0) or without_spikes(read)[1] == 0
    step = Series(
        read.time_utc_ns, np.where(np.arange(len(read)) < 400, 8.0, 5.0) + 0.01 * np.sin(np.arange(len(read)))
    )
    assert without_spikes(step)[1] == 0


def test_the_noise_that_is_left_is_as_large_and_as_slow_as_it_says() -> None:
    for period_s in (0.2, 1.0):
        left, told = [], []
        for seed in range(40):
            read, truth = slow(period_s, seed=seed)
            found = smoothed(read, 0.05)
            inside = slice(len(read) // 6, -len(read) // 6)
            left.append((found.series.value - truth)[inside])
            told.append(found)
        errors = np.array(left)
        # about their mean, which is what smoothing does to the speed itself
        spread = np.sqrt(np.mean(np.var(errors, axis=0)))
        assert spread / np.mean([one.error_std for one in told]) == pytest.approx(1.0, abs=0.2)
        # twice the integral of the autocorrelation is the power at frequency 0, that of the reading's own noise
        slowly = np.var(np.mean(errors, axis=1)) * errors.shape[1] * period_s
        assert slowly == pytest.approx(0.05**2 * period_s, rel=0.6)
        for one in told:
            assert 2.0 * one.error_std**2 * one.error_time_s == pytest.approx(0.05**2 * period_s, rel=1e-9)
