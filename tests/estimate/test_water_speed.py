"""The speed through the water beside what turning costs."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.series import Series
from kempf.pipeline.channels.signal import signal
from kempf.pipeline.estimate.record.water_speed import water_speed
from kempf.schemas.units import SECOND_NS

LEG_S = 100.0


def series(time: np.ndarray, value: np.ndarray) -> Series:
    return Series((time * SECOND_NS).astype(np.int64), value)


def sailed(loss: float, seed: int) -> tuple[Series, Series, Series, np.ndarray]:
    """Log, heading and rudder of a zigzag, the speed integrated every 10 ms: it is lost with r^2, won back in 60 s."""
    fine = np.arange(0.0, 800.0, 0.01)
    rate = 0.01 * np.tanh(3.0 * np.sin(np.pi * fine / LEG_S))
    heading, speed = np.cumsum(rate) * 0.01, np.empty(fine.size)
    v, wind = 8.0, 0.0006 * np.sin(2 * np.pi * fine / 700.0)
    for k in range(fine.size):
        speed[k] = v
        v += 0.01 * ((8.0 - v) / 60.0 + wind[k] - loss * rate[k] ** 2)
    every, random = slice(0, None, 100), np.random.default_rng(seed)
    time, truth = fine[every], speed[every]
    log = series(time, truth + 0.05 * random.standard_normal(time.size))
    psi = series(time, heading[every] + 1e-3 * random.standard_normal(time.size))
    return log, psi, series(time, 0.3 * np.sign(np.sin(np.pi * (time + 10.0) / LEG_S))), truth


def test_the_loss_in_the_turns_is_not_smoothed_away() -> None:
    beside, alone, stated, dips = [], [], [], []
    for seed in range(12):
        log, heading, rudder, truth = sailed(loss=80.0, seed=seed)
        found = water_speed(log, heading, rudder)
        error = found.series.value - truth
        beside.append(np.std(error))
        alone.append(np.std(signal(log).series.value - truth))
        stated.append(found.error_std)
        dips.append((error - error.mean()) @ (truth - truth.mean()) / np.sum((truth - truth.mean()) ** 2))
    assert np.mean(beside) < 0.7 * np.mean(alone)
    assert np.mean(beside) == pytest.approx(np.mean(stated), rel=0.35)
    assert abs(np.mean(dips)) < 0.03


def test_a_speed_that_turning_does_not_touch_is_left_alone() -> None:
    slope = []
    for seed in range(12):
        log, heading, rudder, truth = sailed(loss=0.0, seed=seed)
        found = water_speed(log, heading, rudder).series.value
        square = np.gradient(heading.value) ** 2
        slope.append(np.std(found - truth))
        assert np.corrcoef(found - truth, square)[0, 1] < 0.6
    assert np.mean(slope) < 0.02


def test_without_a_turn_it_is_the_spline_alone() -> None:
    log, heading, _, _ = sailed(loss=80.0, seed=0)
    still = Series(log.time_utc_ns, np.zeros(len(log)))
    np.testing.assert_array_equal(water_speed(log, heading, still).series.value, signal(log).series.value)


def test_means_are_taken_for_the_curve_that_they_are_of() -> None:
    """Means over a third of a leg: what the turns cost is as large as without them, and at its time."""
    dips, off = [], []
    for seed in range(6):
        log, heading, rudder, truth = sailed(loss=80.0, seed=seed)
        many = round(LEG_S / 3.0)
        middle = np.arange(many // 2, len(log) - many // 2, many)
        value = np.array([np.mean(log.value[k - many // 2 : k + many // 2 + 1]) for k in middle])
        means = Series(log.time_utc_ns[middle], value)
        found = water_speed(means, heading, rudder, float(many)).series
        at = log.seconds_since(0)
        inside = (at > LEG_S) & (at < at[-1] - LEG_S)
        dip = truth[inside] - truth[inside].mean()
        for errors, series_of in ((dips, found), (off, means)):
            error = np.interp(at, series_of.seconds_since(0), series_of.value)[inside] - truth[inside]
            errors.append(error @ dip / (dip @ dip))
    assert abs(np.mean(dips)) < 0.05
    assert np.mean(off) < -0.15


def test_between_means_that_are_lost_nothing_is_made_up() -> None:
    log, heading, rudder, _ = sailed(loss=80.0, seed=0)
    means = Series(log.time_utc_ns[2::5], np.convolve(log.value, np.full(5, 0.2), mode="valid")[::5])
    at = means.seconds_since(0)
    kept = (at < 300.0) | (at > 400.0)
    gappy = Series(means.time_utc_ns[kept], means.value[kept])
    whole, found = (water_speed(one, heading, rudder, 5.0).series for one in (means, gappy))
    assert np.max(np.diff(whole.seconds_since(0))) < 1.0
    assert np.max(np.diff(found.seconds_since(0))) > 85.0
    assert len(found) < 0.9 * len(whole)
    inside = np.isin(whole.time_utc_ns, found.time_utc_ns)
    truth = np.interp(whole.seconds_since(0)[inside], log.seconds_since(0), sailed(loss=80.0, seed=0)[3])
    assert np.max(np.abs(np.interp(whole.seconds_since(0)[inside], found.seconds_since(0), found.value) - truth)) < 0.15


def test_what_turning_costs_is_kept_where_the_means_hardly_scatter() -> None:
    """Means of a boat whose legs are as short as three of them, and no noise for a spline to leave out."""
    fine = np.arange(0.0, 120.0, 0.01)
    rate = 0.5 * np.tanh(3.0 * np.sin(np.pi * fine / 6.0))
    speed = np.empty(fine.size)
    v = 1.8
    for k in range(fine.size):
        speed[k] = v
        v += 0.01 * ((1.8 - v) / 2.0 - 0.6 * rate[k] ** 2)
    every = slice(None, None, 10)
    at, truth = fine[every], speed[every]
    psi = series(at, (np.cumsum(rate) * 0.01)[every])
    rudder = series(at, 0.3 * np.sign(np.sin(np.pi * (at + 0.6) / 6.0)))
    middle = np.arange(1.0, 119.0, 2.0)
    means = series(middle, np.array([np.mean(speed[(fine >= t - 1.0) & (fine < t + 1.0)]) for t in middle]))
    found = water_speed(means, psi, rudder, 2.0)
    assert found.shape is not None
    inside = (at > 6.0) & (at < 112.0)
    error = np.interp(at, found.series.seconds_since(0), found.series.value)[inside] - truth[inside]
    straight = np.interp(at, middle, means.value)[inside] - truth[inside]
    assert np.std(error) < 0.3 * np.std(straight)
    # and what is said of the error is of its size
    assert 0.3 * found.error_std < np.std(error) < 3.0 * found.error_std
