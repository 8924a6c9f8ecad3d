"""The common grid: exact instants, angles across north, nothing across a gap."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s, make_grid
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS

START = 1_746_252_000_000_000_000


def steady(period_s: float, n: int, value: np.ndarray) -> Series:
    return Series(START + np.round(np.arange(n) * period_s * SECOND_NS).astype(np.int64), value)


def test_instants_are_whole_nanoseconds_and_include_both_bounds() -> None:
    grid = make_grid({"x": steady(0.2, 101, np.arange(101.0))}, START, START + 20 * SECOND_NS, 0.1)
    assert grid.time_utc_ns.tolist() == [START + 100_000_000 * k for k in range(201)]
    np.testing.assert_array_equal(grid.columns["x"][::2], np.arange(101.0))
    np.testing.assert_allclose(grid.columns["x"][1::2], np.arange(100) + 0.5)
    np.testing.assert_allclose(grid.seconds, np.arange(201) * 0.1)


def test_a_third_of_a_second_does_not_drift() -> None:
    grid = make_grid({}, START, START + 3600 * SECOND_NS, 1.0 / 3.0)
    assert np.unique(np.diff(grid.time_utc_ns)).tolist() == [333_333_333]
    assert grid.step_s == 0.333_333_333


def test_nothing_across_a_gap_and_each_channel_judged_by_its_own_rate() -> None:
    time = START + np.array([0, 1, 2, 7, 8, 9], dtype=np.int64) * SECOND_NS
    gappy = Series(time, np.arange(6.0))
    slow = steady(5.0, 3, np.array([0.0, 5.0, 10.0]))
    grid = make_grid({"gappy": gappy, "slow": slow}, START, START + 9 * SECOND_NS, 0.5)
    assert gap_limit_s(gappy) == 3.0
    assert gap_limit_s(slow) == 15.0
    seconds = grid.seconds
    np.testing.assert_array_equal(np.isnan(grid.columns["gappy"]), (seconds > 2.0) & (seconds < 7.0))
    np.testing.assert_allclose(grid.columns["slow"], seconds)


def test_a_lost_sentence_of_a_fast_compass_is_no_gap() -> None:
    whole = steady(0.2, 50, np.arange(50.0))
    keep = np.arange(50) != 20
    one = Series(whole.time_utc_ns[keep], whole.value[keep])
    grid = make_grid({"heading": one}, START, int(one.time_utc_ns[-1]), 0.2)
    np.testing.assert_allclose(grid.columns["heading"], np.arange(50.0))


def test_an_angle_is_interpolated_across_north_the_short_way() -> None:
    # 359 deg, then 1 deg, as a `Series` holds it: unwrapped
    value = np.unwrap(np.deg2rad([359.0, 1.0, 3.0]))
    grid = make_grid({"heading": steady(1.0, 3, value)}, START, START + 2 * SECOND_NS, 0.5)
    found = np.rad2deg(grid.columns["heading"]) % 360.0
    np.testing.assert_allclose((found + 180.0) % 360.0 - 180.0, [-1.0, 0.0, 1.0, 2.0, 3.0], atol=1e-9)
