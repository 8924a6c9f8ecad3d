"""Runs of a steering gear in noisy readings."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.gear_runs import with_straight_runs
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.standing import without_noise
from kempf.schemas.units import SECOND_NS

NOISE = np.deg2rad(0.1)
RATE = np.deg2rad(2.5)
ANGLE = np.deg2rad(20.0)


def gear(executes: Float) -> tuple[Float, Float]:
    """Corners of a rudder that goes to one side and the other at each execute, s and rad."""
    time, angle, now = [0.0], [0.0], 0.0
    for k, at in enumerate(executes.tolist()):
        aim = ANGLE * (-1) ** k
        time += [at, at + abs(aim - now) / RATE]
        angle += [now, aim]
        now = aim
    return np.array([*time, executes[-1] + 60.0]), np.array([*angle, now])


def read(period_s: float, corners: tuple[Float, Float], seed: int, noise: float = NOISE) -> Series:
    at = np.arange(0.0, corners[0][-1], period_s)
    value = np.interp(at, *corners) + noise * np.random.default_rng(seed).standard_normal(at.size)
    return Series(np.round(at * SECOND_NS).astype(np.int64), value)


@pytest.mark.parametrize("period_s", [0.5, 1.0])
def test_corners_are_found_to_a_part_of_the_period_and_the_line_is_better_than_its_readings(period_s: float) -> None:
    corners = gear(np.array([20.13, 81.37, 150.71, 220.9]))
    late, off = [], []
    for seed in range(20):
        raw = without_noise(read(period_s, corners, seed), NOISE)
        found = with_straight_runs(raw, NOISE)
        new = np.setdiff1d(found.time_utc_ns, raw.time_utc_ns) / SECOND_NS
        nearest = np.argmin(np.abs(new[:, None] - corners[0]), axis=1)
        assert np.unique(nearest).size == nearest.size and 0 not in nearest
        late.append(new - corners[0][nearest])
        own = found.time_utc_ns / SECOND_NS
        off.append(np.sqrt(np.mean((found.value - np.interp(own, *corners)) ** 2)))
    late_s = np.concatenate(late)
    # of four runs now and then one is left, whose readings do not lie on a line by chance
    assert late_s.size > 0.9 * 8 * 20
    assert np.std(late_s) < 0.08
    # neither early nor late on the whole
    assert abs(late_s.mean()) < 0.02
    assert np.median(off) < 0.5 * NOISE


def test_what_is_no_line_within_the_noise_is_left_as_it_was_read() -> None:
    corners = gear(np.array([20.0, 81.0]))
    time = np.arange(0.0, 140.0, 0.5)
    # a gear that slows down before it arrives
    slow = np.interp(time, *corners)
    lagging = np.empty_like(slow)
    lagging[0] = slow[0]
    for k in range(1, slow.size):
        lagging[k] = lagging[k - 1] + (slow[k] - lagging[k - 1]) * (1.0 - np.exp(-0.5 / 3.0))
    noise = NOISE * np.random.default_rng(3).standard_normal(time.size)
    raw = without_noise(Series(np.round(time * SECOND_NS).astype(np.int64), lagging + noise), NOISE)
    assert with_straight_runs(raw, NOISE) is raw


def test_a_gap_hides_corners_and_without_noise_or_stands_nothing_is_done() -> None:
    corners = gear(np.array([20.13, 81.37]))
    raw = read(0.5, corners, 1)
    inside = (raw.time_utc_ns > 22 * SECOND_NS) & (raw.time_utc_ns < 25 * SECOND_NS)
    holed = without_noise(Series(raw.time_utc_ns[~inside], raw.value[~inside]), NOISE)
    new = np.setdiff1d(with_straight_runs(holed, NOISE).time_utc_ns, holed.time_utc_ns) / SECOND_NS
    assert new.size == 2 and np.all(new > 80.0)
    assert with_straight_runs(raw, NOISE) is raw
    clean = read(0.5, corners, 1, noise=0.0)
    assert with_straight_runs(clean, 0.0) is clean
    swing = Series(raw.time_utc_ns, ANGLE * np.sin(raw.time_utc_ns / SECOND_NS / 5.0))
    assert with_straight_runs(swing, NOISE) is swing
