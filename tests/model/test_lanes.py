"""Arithmetic of lanes is numpy's, number by number, and with one lane that of a plain number, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit
from kempf.pipeline.model.batch import LANES, MOST, ONE
from kempf.pipeline.model.lanes import at, choose, everywhere, power, put, root

COUNT = 12


@njit(error_model="numpy")
def worked(a, b, out, lanes):  # type: ignore[no-untyped-def]
    x, y = at(a, (1, 2), lanes), at(b, 1, lanes)
    put(out, 0, x + y, lanes)
    put(out, 1, 2.0 - x, lanes)
    put(out, 2, x * 3, lanes)
    put(out, 3, x / y, lanes)
    put(out, 4, -x, lanes)
    put(out, 5, abs(x), lanes)
    put(out, 6, choose(x, y, x, y), lanes)
    put(out, 7, choose(x, 0.0, 1.0, 0.0), lanes)
    put(out, 8, root(abs(x)), lanes)
    put(out, 9, power(abs(x), 1.3), lanes)
    put(out, 10, 0.5, lanes)
    total = everywhere(1.0, lanes)
    total += x
    total -= y
    total *= x
    total /= y
    put(out, 11, total, lanes)


def expected(x: Float, y: Float) -> Float:
    rows = [x + y, 2.0 - x, 3.0 * x, x / y, -x, np.abs(x), np.minimum(x, y), np.where(x <= 0.0, 1.0, 0.0)]
    rows += [np.sqrt(np.abs(x)), np.abs(x) ** 1.3, np.full(x.size, 0.5), (1.0 + x - y) * x / y]
    return np.stack(rows)


@pytest.mark.parametrize("lanes", [ONE, LANES])
def test_arithmetic_is_that_of_numbers(lanes: tuple[int, ...]) -> None:
    random, many = np.random.default_rng(5), lanes[0]
    a, b, out = random.normal(size=(2, 3, many)), random.normal(size=(2, many)), np.zeros((COUNT, many))
    a[1, 2, 0] = 0.0
    worked(a, b, out, lanes)
    wanted = expected(a[1, 2], b[1])
    np.testing.assert_array_equal(np.delete(out, 9, axis=0), np.delete(wanted, 9, axis=0))
    np.testing.assert_allclose(out[9], wanted[9], rtol=1e-15)


def test_a_place_is_found_in_a_part_of_an_array() -> None:
    """Rows of inputs are taken two at a time: their lanes lie side by side, the rows do not."""
    random = np.random.default_rng(6)
    whole, b, out = random.normal(size=(4, 3, MOST)), random.normal(size=(4, MOST)), np.zeros((2 * COUNT, MOST))
    worked(whole[::2], b[::2], out[::2], LANES)
    np.testing.assert_array_equal(out[0], whole[2, 2] + b[2])
    np.testing.assert_array_equal(out[1::2], 0.0)


def test_a_number_that_is_none_is_not_below() -> None:
    a, b, out = np.full((2, 3, MOST), np.nan), np.ones((2, MOST)), np.zeros((COUNT, MOST))
    worked(a, b, out, LANES)
    np.testing.assert_array_equal(out[6:8], [[1.0] * MOST, [0.0] * MOST])
    assert np.all(np.isnan(out[[0, 1, 2, 3, 4, 5, 8, 9, 11]]))
