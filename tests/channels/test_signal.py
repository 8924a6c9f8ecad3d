"""What a channel was, given its readings."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.rounding import rounding_std
from kempf.pipeline.channels.series import Series
from kempf.pipeline.channels.signal import signal
from kempf.schemas.units import SECOND_NS


def slow(period_s: float = 1.0, noise: float = 0.05, seed: int = 0) -> tuple[Series, np.ndarray]:
    time = np.arange(0.0, 900.0, period_s)
    truth = 8.0 - 0.8 * np.sin(np.pi * time / 150.0) ** 2
    read = truth + noise * np.random.default_rng(seed).standard_normal(time.size)
    return Series((time * SECOND_NS).astype(np.int64), read), truth


def test_most_of_the_noise_goes_and_the_speed_stays() -> None:
    # fewer readings leave more
    for period_s, share in ((0.2, 0.35), (1.0, 0.5), (2.0, 0.65)):
        read, truth = slow(period_s)
        smooth = signal(read)
        found = smooth.series
        np.testing.assert_array_equal(found.time_utc_ns, read.time_utc_ns)
        assert np.std(found.value - truth) < share * 0.05
        assert abs(np.mean(found.value - truth)) < 0.2 * 0.05


def test_a_speed_without_noise_is_left_alone() -> None:
    read, _ = slow(noise=0.0)
    assert signal(read).series is read
    few = Series(read.time_utc_ns[:8], read.value[:8])
    assert signal(few).series is few


def test_a_change_faster_than_the_noise_allows_is_not_smoothed_away() -> None:
    time = np.arange(0.0, 600.0)
    truth = 8.0 + np.sin(2 * np.pi * time / 20.0)
    read = Series((time * SECOND_NS).astype(np.int64), truth + 0.02 * np.random.default_rng(1).standard_normal(600))
    assert np.std(signal(read).series.value - truth) < 0.02


def test_the_noise_that_is_left_is_as_large_and_as_slow_as_it_says() -> None:
    for period_s in (0.2, 1.0):
        left, stated = [], []
        for seed in range(40):
            read, truth = slow(period_s, seed=seed)
            found = signal(read)
            inside = slice(len(read) // 6, -len(read) // 6)
            left.append((found.series.value - truth)[inside])
            stated.append(found)
        errors = np.array(left)
        # about their mean, which is what smoothing does to the speed itself
        spread = np.sqrt(np.mean(np.var(errors, axis=0)))
        assert spread / np.mean([one.error_std for one in stated]) == pytest.approx(1.0, abs=0.2)
        # twice the integral of the autocorrelation is the power at frequency 0, that of the reading's own noise
        slowly = np.var(np.mean(errors, axis=1)) * errors.shape[1] * period_s
        assert slowly == pytest.approx(0.05**2 * period_s, rel=0.6)
        for one in stated:
            assert 2.0 * one.error_std**2 * one.error_time_s == pytest.approx(0.05**2 * period_s, rel=0.25)


def gusts(noise: float, seed: int, n: int = 400) -> tuple[Series, np.ndarray]:
    """A first-order process of 1 m/s and 20 s, read once a second, and not on the second."""
    random = np.random.default_rng(seed)
    time, truth = np.arange(float(n)) + random.uniform(-0.05, 0.05, n), np.empty(n)
    truth[0], kept = random.standard_normal(), np.exp(-1.0 / 20.0)
    for k in range(1, n):
        truth[k] = kept * truth[k - 1] + np.sqrt(1.0 - kept**2) * random.standard_normal()
    read = 7.0 + truth + noise * random.standard_normal(n)
    return Series((time * SECOND_NS).astype(np.int64), read), truth


@pytest.mark.parametrize("noise", [0.3, 1.0, 2.0])
def test_what_follows_the_signal_goes_with_it_one_to_one(noise: float) -> None:
    """A response to a noisy input regressed on its readings is too weak, on the signal it is right."""
    on_signal, on_readings = [], []
    for seed in range(30):
        read, truth = gusts(noise, seed)
        for found, column in ((on_signal, signal(read).series.value), (on_readings, read.value)):
            about = column - column.mean()
            found.append((about @ truth, about @ about))
    slope, weak = (np.sum(one, axis=0)[0] / np.sum(one, axis=0)[1] for one in (on_signal, on_readings))
    assert slope == pytest.approx(1.0, abs=0.07)
    assert weak == pytest.approx(1.0 / (1.0 + noise**2), abs=0.07)


def test_a_channel_without_noise_is_left_alone_and_one_of_noise_alone_does_not_move() -> None:
    read, _ = gusts(0.0, 0)
    assert np.std(signal(read).series.value - read.value) < 0.05
    still = Series(read.time_utc_ns, 5.0 + 0.1 * np.random.default_rng(3).standard_normal(len(read)))
    assert np.std(signal(still).series.value) < 0.02
    constant = Series(read.time_utc_ns, np.full(len(read), 1.5))
    assert signal(constant).series is constant


def test_a_rounded_channel_has_at_least_the_noise_of_its_rounding() -> None:
    time = np.arange(0.0, 900.0)
    truth = 8.0 - 0.4 * np.sin(np.pi * time / 450.0) ** 2
    read = Series((time * SECOND_NS).astype(np.int64), np.round(truth, 1))
    assert rounding_std(read) == pytest.approx(0.1 / np.sqrt(12.0))
    assert np.std(signal(read).series.value - truth) < np.std(read.value - truth)
    moving = Series(read.time_utc_ns, np.arange(900.0))
    assert rounding_std(moving) == 0.0


def test_what_it_goes_with_is_found_beside_it() -> None:
    time = np.arange(0.0, 900.0)
    dips = (np.arange(900) % 150 < 20).astype(float)
    truth = 8.0 + 0.1 * np.sin(2.0 * np.pi * time / 600.0) - 0.3 * dips
    alone, beside = [], []
    for seed in range(10):
        noise = 0.1 * np.random.default_rng(seed).standard_normal(900)
        read = Series((time * SECOND_NS).astype(np.int64), truth + noise)
        alone.append(np.std(signal(read).series.value - truth))
        beside.append(np.std(signal(read, [np.sin(time), dips]).series.value - truth))
    assert np.mean(beside) < 0.5 * np.mean(alone)
