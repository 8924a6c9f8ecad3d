"""Held values collapse to their measurements, and nothing else does."""

from __future__ import annotations

import gzip
import io
from dataclasses import replace

import numpy as np
import polars as pl
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kempf.pipeline.channels.holds import find_held
from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.channels.lateral_speed import lateral_speed
from kempf.pipeline.channels.series import Series
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.units import SECOND_NS
from tests.reading import read_log

ROW_NS = 100_000_000


def logged(sampled_ns: np.ndarray, values: np.ndarray, n_rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows every 0.1 s, each with the last value that has been measured."""
    time = np.arange(n_rows, dtype=np.int64) * ROW_NS
    last = np.searchsorted(sampled_ns, time, side="right") - 1
    good = last >= 0
    return time[good], values[last[good]][:, None]


@settings(max_examples=150, deadline=None)
@given(
    period=st.integers(2, 12),
    n_values=st.integers(30, 200),
    phase=st.floats(0.0, 1.0),
    jitter=st.floats(0.0, 0.4),
    seed=st.integers(0, 2**16),
)
def test_one_row_a_measurement_within_a_row_of_its_instant(
    period: int, n_values: int, phase: float, jitter: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    ticks = (np.arange(n_values) + phase) * period * ROW_NS
    instants = np.round(ticks + jitter * random.uniform(-1.0, 1.0, n_values) * ROW_NS).astype(np.int64)
    time, values = logged(np.sort(instants), np.arange(n_values, dtype=np.float64) ** 1.5, n_values * period)
    held = find_held(time, values)
    if period == 2 and held.rows_per_value == 1:
        return  # a jitter of 0.4 rows on holds of 2 rows: runs of 1, 2, 3; not taken for a hold, which is safe
    assert abs(held.rows_per_value - period) <= 1
    kept = np.round(values[held.rows, 0] ** (1.0 / 1.5)).astype(int)
    assert np.unique(kept).size == kept.size == np.unique(values).size
    assert np.all(np.diff(held.time_utc_ns) > 0)
    # the first value of the log may have been measured long before its first row
    error = (held.time_utc_ns - np.sort(instants)[kept])[1:]
    assert np.max(np.abs(error)) <= 1.3 * ROW_NS
    assert abs(np.mean(error)) <= 0.6 * ROW_NS


@settings(max_examples=100, deadline=None)
@given(
    period=st.integers(3, 12),
    phase=st.floats(0.0, 1.0),
    drift=st.sampled_from([0.0, 0.003, 0.03]),
    jitter=st.floats(0.0, 0.1),
    seed=st.integers(0, 2**16),
)
@example(period=3, phase=0.03125, drift=0.0, jitter=0.046875, seed=0)
def test_the_instants_are_as_far_off_as_is_said(
    period: int, phase: float, drift: float, jitter: float, seed: int
) -> None:
    """A clock that keeps step with the rows may stand anywhere in a row; one that does not shows where it stands."""
    random = np.random.default_rng(seed)
    n_values = 200
    ticks = (np.arange(n_values) * (period + drift) + phase) * ROW_NS
    instants = np.sort(np.round(ticks + jitter * random.uniform(-1.0, 1.0, n_values) * ROW_NS).astype(np.int64))
    time, values = logged(instants, np.arange(n_values, dtype=np.float64) ** 1.5, n_values * period)
    held = find_held(time, values)
    assert held.rows_per_value == period
    row_s = ROW_NS / SECOND_NS
    assert 0.0 <= held.std_s <= row_s / np.sqrt(12.0) * (1.0 + 1e-9)
    if drift == 0.03:
        assert held.std_s < 0.12 * row_s
    if drift == 0.0 and jitter == 0.0:
        assert held.std_s > 0.28 * row_s
    kept = np.round(values[held.rows, 0] ** (1.0 / 1.5)).astype(int)
    off_s = float(np.mean((held.time_utc_ns - instants[kept])[1:])) / SECOND_NS
    # anywhere within a row of this size; what jitters crosses an edge or not, which hides as much
    assert abs(off_s) <= np.sqrt(3.0) * held.std_s + (0.06 + jitter) * row_s


@given(step_deg=st.sampled_from([0.1, 0.5, 1.0]), seed=st.integers(0, 2**16))
def test_a_quantised_channel_at_rest_stays_sampled(step_deg: float, seed: int) -> None:
    # 2 Hz rudder that rests for minutes and is moved for minutes, in rows of 10 Hz
    random = np.random.default_rng(seed)
    t = np.arange(1200) * 0.5
    angle = np.where((t // 120) % 2 == 0, 0.0, 15.0 * np.sin(0.3 * t)) + 0.3 * step_deg * random.standard_normal(t.size)
    rounded = np.round(angle / step_deg) * step_deg
    time, values = logged(np.round(t * 1e9 + 3e7).astype(np.int64), rounded, 6000)
    held = find_held(time, values)
    if held.rows_per_value > 1:
        assert held.rows_per_value == 5
        # at most three periods without a sample, so that no gap opens
        assert np.max(np.diff(held.time_utc_ns)) <= 15 * ROW_NS
        back = np.interp(time, held.time_utc_ns, values[held.rows, 0])
        assert np.sqrt(np.mean((back - values[:, 0]) ** 2)) < 0.2 * 15.0


def test_a_native_channel_is_left_alone() -> None:
    random = np.random.default_rng(1)
    time = np.arange(3000, dtype=np.int64) * ROW_NS
    held = find_held(time, random.standard_normal((3000, 1)))
    assert held.rows_per_value == 1
    np.testing.assert_array_equal(held.time_utc_ns, time)
    np.testing.assert_array_equal(held.rows, np.arange(3000))


def test_too_few_changes_show_nothing() -> None:
    time = np.arange(100, dtype=np.int64) * ROW_NS
    held = find_held(time, np.repeat(np.arange(10.0), 10)[:, None])
    assert held.rows_per_value == 1
    assert find_held(time[:1], np.zeros((1, 1))).rows.tolist() == [0]
    assert find_held(time[:0], np.zeros((0, 1))).rows.size == 0


def test_a_slow_discrete_order_is_no_hold() -> None:
    random = np.random.default_rng(2)
    lengths = random.integers(150, 600, 40)  # legs of 15 to 60 s in rows of 10 Hz
    order = np.repeat(np.resize([20.0, -20.0], 40), lengths)
    time = np.arange(order.size, dtype=np.int64) * ROW_NS
    held = find_held(time, order[:, None])
    assert held.rows_per_value == 1
    assert held.rows.size == order.size


def test_the_order_of_a_perfectly_regular_zigzag_is_no_hold() -> None:
    lengths = 300 + np.random.default_rng(3).integers(-4, 5, 60)
    order = np.repeat(np.resize([20.0, -20.0], 60), lengths)
    time = np.arange(order.size, dtype=np.int64) * ROW_NS
    assert find_held(time, order[:, None]).rows_per_value == 1


def test_columns_of_one_instrument_are_held_together() -> None:
    rows = np.arange(2000)
    sample = rows // 10
    # speed repeats now and then by its rounding, the course does not
    speed, course = np.round(7.0 + 0.05 * np.sin(sample), 2), 0.01 * sample
    held = find_held(rows.astype(np.int64) * ROW_NS, np.column_stack([speed, course]))
    assert held.rows_per_value == 10
    np.testing.assert_array_equal(held.rows, np.arange(0, 2000, 10))


def test_settled_instants_take_the_delay_out_of_the_lateral_speed() -> None:
    settings = replace(
        zigzag_settings("ferry", duration_s=420.0, steady_s=60.0, noise_scale=0.0, seed=1), heading_deg=200.0
    )
    trial = simulate_trial(settings)
    log = to_csv(trial)
    readings = read_log("trial.csv.gz", log, logger_profile(settings)).frame
    settled = from_readings(readings).series
    rows = pl.read_csv(io.BytesIO(gzip.decompress(log)))
    time = rows["utc"].str.to_datetime(time_unit="ns").dt.epoch("ns").to_numpy().astype(np.int64)
    raw = {
        "speed_over_ground": Series(time, rows["sog"].to_numpy()),
        "course_over_ground": Series(time, np.unwrap(np.deg2rad(rows["cog"].to_numpy()))),
        "heading": Series(time, np.unwrap(np.deg2rad(rows["heading"].to_numpy()))),
    }

    def rms_error(channels: dict[str, Series]) -> float:
        names = ("speed_over_ground", "course_over_ground", "heading")
        found = lateral_speed(
            *(channels[name] for name in names), speed_std_m_s=0.0, course_std_rad=0.0, heading_std_rad=0.0
        )
        truth = trial.truth.trajectory.at((found.time_utc_ns - settings.start_utc_ns) / 1e9)
        north, east = truth.ground_velocity()
        psi = truth.state[:, 2]
        error = found.value_m_s - (east * np.cos(psi) - north * np.sin(psi))
        return float(np.sqrt(np.nanmean(error**2)))

    # 10 Hz rows of 1 Hz GNSS and 5 Hz compass; the ship sways and turns: what is left is a fraction of a row
    assert rms_error(settled) < 0.25 * rms_error(raw)
    assert rms_error(settled) < 0.02


def test_a_coarse_heading_that_repeats_itself_is_not_a_hold() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(1600, dtype=np.int64) * 1_000_000_000
    slow = np.cumsum(np.sin(np.arange(1600) / 90.0) * 0.55 + 0.05 * rng.standard_normal(1600))
    heading = np.round(slow)
    runs = np.diff(np.flatnonzero(np.append(True, np.diff(heading) != 0)))
    assert np.median(runs) == 2, "the case is not the one that was meant"
    assert find_held(time, heading[:, None]).rows_per_value == 1
