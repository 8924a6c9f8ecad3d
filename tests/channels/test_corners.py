"""Corners of a rate-limited rudder: found where they are, and not invented where there are none."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.corners import with_corners
from kempf.pipeline.channels.series import Series
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.units import SECOND_NS

NOISE = np.deg2rad(0.1)


def exact(time_s: np.ndarray, rate: float = np.deg2rad(2.5)) -> np.ndarray:
    """A zigzag's rudder, integrated by hand: 20 degrees from side to side at one rate."""
    turns = [10.37, 68.81, 127.13, 190.58, 251.02, 312.77, 370.11]
    angle = np.deg2rad(20.0)
    nodes, values, now = [0.0], [0.0], 0.0
    for number, start in enumerate(turns):
        goal = angle if number % 2 == 0 else -angle
        nodes += [start, start + abs(goal - now) / rate]
        values += [now, goal]
        now = goal
    return np.interp(time_s, nodes, values)


def read(period_s: float, noise: float, seed: int = 1, rate: float = np.deg2rad(2.5)) -> Series:
    time = np.arange(0.0, 420.0, period_s)
    value = exact(time, rate) + noise * np.random.default_rng(seed).standard_normal(time.size)
    return Series(np.round(time * SECOND_NS).astype(np.int64), value)


def off(series: Series, rate: float = np.deg2rad(2.5)) -> np.ndarray:
    """Error of the interpolated rudder over the whole of it."""
    fine = np.arange(0.0, 415.0, 0.01)
    return np.interp(fine, series.seconds_since(0), series.value) - exact(fine, rate)


@pytest.mark.parametrize("period_s", [1.0, 2.0])
def test_corners_of_exact_readings_are_exact(period_s: float) -> None:
    raw = read(period_s, 0.0)
    found = with_corners(raw, 0.0)
    assert 10 <= len(found) - len(raw) <= 14
    assert np.sqrt(np.mean(off(raw) ** 2)) > np.deg2rad(0.03)
    assert np.sqrt(np.mean(off(found) ** 2)) < 0.1 * np.sqrt(np.mean(off(raw) ** 2))


@pytest.mark.parametrize("period_s", [1.0, 2.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noisy_readings_show_their_corners_too(period_s: float, seed: int) -> None:
    raw = read(period_s, NOISE, seed)
    found = with_corners(raw, NOISE)
    assert len(found) - len(raw) >= 8
    # of the same noise, so that what is left is what the corners do
    truth = Series(raw.time_utc_ns, exact(raw.seconds_since(0)))
    noise_alone = np.interp(np.arange(0.0, 415.0, 0.01), raw.seconds_since(0), raw.value - truth.value)
    assert np.mean((off(found) - noise_alone) ** 2) < 0.3 * np.mean((off(raw) - noise_alone) ** 2)


@pytest.mark.parametrize("rate_hz", [0.5, 1.0])
def test_the_simulators_rudder_is_followed_between_its_readings(rate_hz: float) -> None:
    trial = simulate_trial(zigzag_settings("mariner", seed=3, duration_s=600.0))
    truth, start = trial.truth.trajectory, trial.settings.start_utc_ns
    fine = np.arange(5.0, 590.0, 0.02)
    time = np.arange(0.0, 595.0, 1.0 / rate_hz)
    angle = truth.at(time).rudder + NOISE * np.random.default_rng(5).standard_normal(time.size)
    raw = Series(start + np.round(time * SECOND_NS).astype(np.int64), angle)
    found = with_corners(raw, NOISE)
    wrong = [np.interp(fine, s.seconds_since(start), s.value) - truth.at(fine).rudder for s in (raw, found)]
    # cutting corners always errs to the same side, weighed by where the rudder goes
    assert len(found) > len(raw)
    assert np.mean(wrong[1] ** 2) < np.mean(wrong[0] ** 2)


def test_readings_stay_as_they_are() -> None:
    raw = read(1.0, NOISE)
    found = with_corners(raw, NOISE)
    kept = np.isin(found.time_utc_ns, raw.time_utc_ns)
    np.testing.assert_array_equal(found.time_utc_ns[kept], raw.time_utc_ns)
    np.testing.assert_array_equal(found.value[kept], raw.value)


def second(value: np.ndarray, period_s: float = 1.0) -> Series:
    return Series(np.round(np.arange(value.size) * period_s * SECOND_NS).astype(np.int64), value)


@pytest.mark.parametrize("seed", range(5))
def test_noise_has_no_corners(seed: int) -> None:
    noise = NOISE * np.random.default_rng(seed).standard_normal(1200)
    raw = second(noise)
    assert with_corners(raw, NOISE) is raw
    # even where the noise is said to be smaller than it is
    assert len(with_corners(raw, 0.0)) == len(raw)


@pytest.mark.parametrize("rows", [1, 2, 5])
def test_a_held_channel_has_no_corners(rows: int) -> None:
    held = np.repeat(exact(np.arange(0.0, 420.0, 1.0)), rows)
    jumps = second(held, 1.0 / rows)
    if rows > 1:
        assert len(with_corners(jumps, 0.0)) == len(jumps)
    order = second(np.repeat(np.tile([0.35, -0.35], 10), 40))
    assert len(with_corners(order, 0.0)) == len(order)


def test_a_smooth_rudder_has_no_corners() -> None:
    raw = second(0.3 * np.sin(np.arange(600) / 12.0))
    assert len(with_corners(raw, 0.0)) == len(raw)
    lagging = second(0.3 * np.exp(-(np.arange(600) % 60) / 8.0) * np.where(np.arange(600) // 60 % 2, 1.0, -1.0))
    assert len(with_corners(lagging, 0.0)) == len(lagging)


def test_too_fast_readings_and_too_few_are_left_alone() -> None:
    fast = read(0.1, NOISE)
    assert with_corners(fast, NOISE) is fast
    few = Series(np.arange(4, dtype=np.int64), np.zeros(4))
    assert with_corners(few, 0.0) is few


def test_nothing_is_invented_across_a_gap() -> None:
    raw = read(1.0, 0.0)
    seconds = raw.seconds_since(0)
    keep = (seconds < 66.0) | (seconds > 90.0)  # the rudder went over meanwhile
    gap = Series(raw.time_utc_ns[keep], raw.value[keep])
    new = np.setdiff1d(with_corners(gap, 0.0).time_utc_ns, gap.time_utc_ns) / SECOND_NS
    assert new.size and not np.any((new > 65.0) & (new < 91.0))
