"""What a chart draws of a series: every extreme, nothing invented, nothing joined across a gap."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS
from kempf.workbench.charts.bins import _BLOCKS, reduced
from kempf.workbench.charts.frames import encoded
from tests.workbench.web.decoded import decoded

START = 1_746_258_421_000_000_000


def series(values: np.ndarray, rate_hz: float = 10.0) -> Series:
    return Series(START + (np.arange(values.size) * SECOND_NS / rate_hz).astype(np.int64), values.astype(np.float64))


def test_few_values_are_all_drawn_at_their_instants():
    one = series(np.arange(50.0))
    shown = reduced(one, START, int(one.time_utc_ns[-1]), 100)
    assert shown.total == shown.drawn == 50
    np.testing.assert_array_equal(shown.value, one.value)
    np.testing.assert_allclose(shown.time_s, one.seconds_since(START))


@given(st.integers(0, 2**31), st.integers(500, 5000), st.integers(40, 200))
def test_the_smallest_and_the_largest_of_every_bin_are_drawn(seed: int, count: int, bins: int):
    values = np.random.default_rng(seed).normal(size=count).round(1)  # rounded, so that equal ones occur
    one = series(values)
    end = int(one.time_utc_ns[-1])
    shown = reduced(one, START, end, bins)
    assert shown.total == count and shown.drawn <= max(2 * bins, min(count, 2 * bins))
    number = (one.time_utc_ns - START) * bins // (end - START + 1)
    drawn = np.rint(shown.time_s * SECOND_NS).astype(np.int64) * bins // (end - START + 1)
    for k in np.unique(number):
        inside = shown.value[drawn == k]
        assert inside.min() == values[number == k].min()
        assert inside.max() == values[number == k].max()
    pairs = set(zip(one.seconds_since(START).tolist(), values.tolist(), strict=True))
    assert set(zip(shown.time_s.tolist(), shown.value.tolist(), strict=True)) <= pairs
    assert np.all(np.diff(shown.time_s) > 0.0)


@given(st.integers(0, 2**31), st.integers(100, 20_000), st.integers(1, 12))
def test_no_peak_is_lost_where_a_bin_holds_many(seed: int, count: int, bins: int):
    values = np.random.default_rng(seed).normal(size=count).round(1)
    one = series(values)
    end = int(one.time_utc_ns[-1])
    shown = reduced(one, START, end, bins)
    assert shown.drawn <= max(2 * bins, min(count, 2 * bins)) and np.all(np.diff(shown.time_s) > 0.0)
    place = np.searchsorted(one.time_utc_ns, START + np.rint(shown.time_s * SECOND_NS).astype(np.int64))
    np.testing.assert_array_equal(values[place], shown.value)
    length = next((n for n in _BLOCKS if count >= 2 * n * bins), 1)
    # a bin begins with a block
    number = np.repeat((one.time_utc_ns[::length] - START) * bins // (end - START + 1), length)[:count]
    for k in np.unique(number):
        drawn = shown.value[number[place] == k]
        assert drawn.min() == values[number == k].min() and drawn.max() == values[number == k].max()


def test_one_value_beyond_each_edge_so_that_lines_leave_the_window():
    one = series(np.arange(100.0))
    shown = reduced(one, START + 2 * SECOND_NS, START + 3 * SECOND_NS, 100)
    assert shown.value.tolist() == [float(k) for k in range(19, 32)]
    assert (shown.total, shown.drawn) == (11, 11)
    assert shown.time_s[0] == pytest.approx(-0.1)


def test_no_line_crosses_a_gap():
    time = np.concatenate([np.arange(100), np.arange(300, 400)]) * (SECOND_NS // 10) + START
    one = Series(time.astype(np.int64), np.ones(200))
    shown = reduced(one, START, int(time[-1]), 500)
    at = np.flatnonzero(np.isnan(shown.value))
    assert at.size == 1
    assert shown.time_s[at[0] - 1] == pytest.approx(9.9) and shown.time_s[at[0] + 1] == pytest.approx(30.0)
    assert np.isnan(reduced(one, START, int(time[-1]), 10).value).sum() == 1


def test_a_window_without_values_shows_its_neighbours_alone():
    one = series(np.arange(20.0), rate_hz=0.1)
    shown = reduced(one, START + 11 * SECOND_NS, START + 12 * SECOND_NS, 100)
    assert shown.value.tolist() == [1.0, 2.0] and shown.total == 0


def test_a_frame_says_what_it_holds():
    one = series(np.linspace(-1.0, 1.0, 300))
    end = int(one.time_utc_ns[-1])
    shown = {"heading": reduced(one, START, end, 1000), "yaw_rate": reduced(one, START, end, 20)}
    head, found = decoded(encoded(START, end, shown))
    assert head["from_utc_ns"] == str(START)
    assert [(s["name"], s["total"]) for s in head["series"]] == [("heading", 300), ("yaw_rate", 300)]
    for name, (seconds, values) in found.items():
        np.testing.assert_allclose(seconds, shown[name].time_s, rtol=1e-6)
        np.testing.assert_allclose(values, shown[name].value, rtol=1e-6)
