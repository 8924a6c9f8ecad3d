"""One channel over time: interpolation at and beside its instants, gaps, cutting."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS

START = 1_746_252_000_000_000_000


def series(seconds: list[float], values: list[float]) -> Series:
    return Series(START + np.round(np.array(seconds) * SECOND_NS).astype(np.int64), np.array(values, dtype=np.float64))


def at(one: Series, seconds: list[float], max_gap_s: float) -> list[float]:
    found: list[float] = one.at(START + np.round(np.array(seconds) * SECOND_NS).astype(np.int64), max_gap_s).tolist()
    return found


def test_values_at_the_instants_are_exact_and_between_them_linear() -> None:
    one = series([0.0, 1.0, 3.0], [1.0, 2.0, -2.0])
    assert at(one, [0.0, 1.0, 3.0], 5.0) == [1.0, 2.0, -2.0]
    assert at(one, [0.25, 2.0], 5.0) == pytest.approx([1.25, 0.0])


def test_nothing_outside_the_series() -> None:
    one = series([1.0, 2.0], [5.0, 6.0])
    assert np.isnan(at(one, [0.999_999_999, 2.000_000_001], 9.0)).all()
    assert at(one, [1.0, 2.0], 9.0) == [5.0, 6.0]


def test_nothing_is_invented_in_a_gap_but_its_ends_stand() -> None:
    one = series([0.0, 1.0, 11.0, 12.0], [0.0, 1.0, 11.0, 12.0])
    found = at(one, [0.5, 1.0, 1.000_000_001, 6.0, 10.999_999_999, 11.0, 11.5], 3.0)
    assert found[0] == 0.5 and found[1] == 1.0 and found[5] == 11.0 and found[6] == 11.5
    assert np.isnan(found[2:5]).all()


def test_a_gap_as_long_as_allowed_is_bridged() -> None:
    assert at(series([0.0, 3.0], [0.0, 3.0]), [1.5], 3.0) == [1.5]


def test_one_value_is_known_at_its_instant_only() -> None:
    one = series([1.0], [7.0])
    found = at(one, [0.0, 1.0, 2.0], 10.0)
    assert found[1] == 7.0 and np.isnan([found[0], found[2]]).all()
    assert np.isnan(one.period_s)


def test_an_empty_series_knows_nothing() -> None:
    one = series([], [])
    assert len(one) == 0
    assert np.isnan(at(one, [0.0, 1.0], 1.0)).all()
    assert at(one, [], 1.0) == []


def test_between_holds_both_bounds() -> None:
    one = series([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0])
    assert one.between(START + SECOND_NS, START + 2 * SECOND_NS).value.tolist() == [1.0, 2.0]
    assert one.between(START + SECOND_NS + 1, START + 2 * SECOND_NS - 1).value.tolist() == []


def test_instants_must_increase_and_shapes_agree() -> None:
    with pytest.raises(ValueError, match="increase strictly"):
        series([0.0, 0.0], [1.0, 2.0])
    with pytest.raises(ValueError, match="increase strictly"):
        series([1.0, 0.0], [1.0, 2.0])
    with pytest.raises(ValueError, match="expected"):
        Series(np.arange(3, dtype=np.int64), np.zeros(2))


@given(
    seconds=st.lists(st.floats(0.0, 1e5), min_size=2, max_size=20, unique_by=lambda t: round(t * 1e3)),
    asked=st.lists(st.floats(-10.0, 1e5 + 10.0), min_size=1, max_size=20),
    max_gap_s=st.floats(0.5, 1e5),
)
def test_at_is_linear_interpolation_or_nothing(seconds: list[float], asked: list[float], max_gap_s: float) -> None:
    time = sorted(round(t * 1e3) / 1e3 for t in seconds)
    one = series(time, [3.0 * t - 1.0 for t in time])
    for t, found in zip(asked, at(one, asked, max_gap_s), strict=True):
        exact = int(START + np.round(np.array(t) * SECOND_NS).astype(np.int64))
        after = int(np.searchsorted(one.time_utc_ns, exact))
        if after < len(one) and one.time_utc_ns[after] == exact:
            assert found == one.value[after]
        elif after in {0, len(one)} or (one.time_utc_ns[after] - one.time_utc_ns[after - 1]) / SECOND_NS > max_gap_s:
            assert np.isnan(found)
        else:
            assert found == pytest.approx(3.0 * t - 1.0, abs=1e-8 + 1e-10 * abs(t))


@given(
    seconds=st.lists(st.floats(0.0, 1e5), min_size=1, max_size=40, unique_by=lambda t: round(t * 1e3)),
    asked=st.lists(st.floats(-10.0, 1e5 + 10.0), min_size=1, max_size=20),
    max_gap_s=st.floats(0.5, 1e5),
)
def test_a_question_alone_has_the_same_answer_as_among_others(
    seconds: list[float], asked: list[float], max_gap_s: float
) -> None:
    time = sorted(round(t * 1e3) / 1e3 for t in seconds)
    one = series(time, [np.sin(t) for t in time])
    everything = at(one, [-20.0, *asked, *time, 2e5], max_gap_s)[1 : 1 + len(asked)]
    np.testing.assert_array_equal(at(one, asked, max_gap_s), everything)
    np.testing.assert_array_equal([at(one, [t], max_gap_s)[0] for t in asked], everything)
    assert at(one, [], max_gap_s) == []
