"""A standing rudder is one angle, a creeping one a course; a moving or noiseless one is left as it was read."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Series
from kempf.pipeline.channels.standing import without_noise
from kempf.schemas.units import SECOND_NS

NOISE = np.deg2rad(0.2)


def read(time_s: np.ndarray, angle: np.ndarray, seed: int = 1) -> Series:
    noise = NOISE * np.random.default_rng(seed).standard_normal(time_s.size)
    return Series(np.round(time_s * SECOND_NS).astype(np.int64), angle + noise)


def zigzag(time_s: np.ndarray) -> np.ndarray:
    """20 degrees from side to side every 6 s, at 30 deg/s."""
    starts = np.arange(5.0, 95.0, 6.0)
    nodes, values, now = [0.0], [0.0], 0.0
    for number, start in enumerate(starts):
        goal = np.deg2rad(20.0) * (1.0 if number % 2 == 0 else -1.0)
        nodes += [start, start + abs(goal - now) / np.deg2rad(30.0)]
        values += [now, goal]
        now = goal
    return np.interp(time_s, nodes, values)


def test_noise_of_a_standing_rudder_is_averaged_and_a_move_is_kept() -> None:
    time = np.arange(0.0, 100.0, 0.1)
    truth = zigzag(time)
    raw = read(time, truth)
    found = without_noise(raw, NOISE)
    moves = np.abs(np.gradient(truth, 0.1)) > np.deg2rad(1.0)
    before, after = raw.value - truth, found.value - truth
    assert np.std(after[~moves]) < 0.4 * np.std(before[~moves])
    inner = moves & (np.abs(np.gradient(truth, 0.1)) > np.deg2rad(29.0))
    assert inner.sum() > 50
    assert np.array_equal(found.value[inner], raw.value[inner])
    # no move is cut off or drawn out
    assert np.max(np.abs(after)) < 5.0 * NOISE
    # what the noise does in the long run stays, but for a reading or two at the ends of a move
    assert abs(np.sum(after) - np.sum(before)) < 0.4 * NOISE * 16
    # noise leads no reading beyond the angles that it stands at
    assert np.ptp(found.value) < np.deg2rad(40.0) + NOISE < np.ptp(raw.value)


def test_a_creeping_rudder_is_its_course() -> None:
    time = np.arange(0.0, 60.0, 0.5)
    truth = np.deg2rad(0.1) * time
    assert np.std(without_noise(read(time, truth), NOISE).value - truth) < 0.3 * NOISE


def test_a_helmsman_who_works_all_the_time_is_followed() -> None:
    time = np.arange(0.0, 120.0, 0.5)
    truth = np.deg2rad(0.6) * np.sin(2.0 * np.pi * time / 15.0)
    raw = read(time, truth)
    found = without_noise(raw, NOISE).value
    assert np.std(found - truth) < 0.6 * np.std(raw.value - truth)
    # what the readings let expect is by as much too large as too small: a coefficient on it is the true one
    assert 0.95 < np.dot(found, truth) / np.dot(found, found) < 1.05


def test_over_a_gap_nothing_is_averaged() -> None:
    time = np.concatenate([np.arange(0.0, 20.0, 0.5), np.arange(60.0, 80.0, 0.5)])
    raw = read(time, np.where(time < 40.0, 0.0, 0.5 * NOISE))
    found = without_noise(raw, NOISE).value
    for part in (slice(1, 39), slice(41, 79)):
        assert np.allclose(found[part], raw.value[part].mean(), rtol=0.0, atol=1e-15)
    assert np.array_equal(found[[0, 39, 40, 79]], raw.value[[0, 39, 40, 79]])


def test_without_noise_it_is_the_same() -> None:
    raw = read(np.arange(0.0, 20.0, 0.5), np.zeros(40))
    assert without_noise(raw, 0.0) is raw
    assert without_noise(raw, np.nan) is raw


def test_a_move_that_goes_further_than_its_ends_is_left_as_it_was_read() -> None:
    time = np.arange(0.0, 40.0, 0.5)
    raw = read(time, np.interp(time, [18.0, 19.5, 20.5], np.deg2rad([0.0, 15.0, 10.0])))
    found = without_noise(raw, NOISE).value
    running = (time > 18.2) & (time < 20.3)
    assert np.array_equal(found[running], raw.value[running])
