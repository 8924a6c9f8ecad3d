"""Readings averaged over the cells of a grid."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.estimate.record.average import cell_means

STEP_S, CELLS = 0.5, 60


def swinging(time_s: np.ndarray) -> np.ndarray:
    """Return a yaw rate whose curve a cell can see: a period of forty cells."""
    return np.sin(2.0 * np.pi * time_s / (40.0 * STEP_S))


def readings() -> np.ndarray:
    """Return instants, ten in every cell and none on its edge, s."""
    return np.arange(0.025, STEP_S * (CELLS - 1), 0.05)


def plain_mean(cell: int, column: np.ndarray) -> float:
    return float(np.mean(column[np.abs(readings() - STEP_S * cell) < 0.5 * STEP_S]))


def test_the_mean_of_a_curve_is_put_right() -> None:
    rate = swinging(readings())
    mean, late = cell_means(readings(), rate, STEP_S, CELLS)
    np.testing.assert_allclose(late[4:-4], 0.0, atol=1e-12)
    true = swinging(STEP_S * np.arange(CELLS))[4:-4]
    was = np.max(np.abs([plain_mean(k, rate) for k in range(CELLS)][4:-4] - true))
    # at the peak of a swing the mean over a fortieth of its period is 1e-3 of it too small
    assert was > 8e-4 and np.max(np.abs(mean[4:-4] - true)) < 0.15 * was


def test_one_reading_a_cell_stays_as_it_is() -> None:
    time = STEP_S * np.arange(CELLS) + 0.1
    mean, late = cell_means(time[:-1], swinging(time[:-1]), STEP_S, CELLS)
    np.testing.assert_array_equal(mean[:-1], swinging(time[:-1]))
    np.testing.assert_allclose(late[:-1], 0.1)


def test_beside_a_missing_mean_nothing_is_put_right() -> None:
    column = swinging(readings())
    column[np.abs(readings() - STEP_S * 30) < 0.5 * STEP_S] = np.nan
    mean, late = cell_means(readings(), column, STEP_S, CELLS)
    assert np.isnan(mean[30]) and late[30] == 0.0 and np.all(np.isfinite(np.delete(mean, 30)))
    assert mean[28] == plain_mean(28, column) and mean[26] != plain_mean(26, column)


def test_noise_hardly_grows() -> None:
    random = np.random.default_rng(1)
    time = np.arange(0.0, STEP_S * 4000, 0.05)
    noise = random.standard_normal(time.size)
    mean, _ = cell_means(time, noise, STEP_S, 4000)
    assert abs(np.std(mean) * np.sqrt(10.0) - 1.0) < 0.03
