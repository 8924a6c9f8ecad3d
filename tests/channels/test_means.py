"""Means over a time, and the curve that has them."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.means import curve_of_means, mean_about
from kempf.pipeline.channels.series import Float, Nanoseconds, Series
from kempf.schemas.units import SECOND_NS


def utc(time_s: Float) -> Nanoseconds:
    return np.rint(time_s * SECOND_NS).astype(np.int64)


def swing(time_s: Float) -> Float:
    """The speed of a boat: it sinks in every turn, here every 8 s."""
    return 1.8 + 0.2 * np.sin(2.0 * np.pi * time_s / 8.0)


def test_the_mean_of_a_straight_line_is_its_middle() -> None:
    time = np.arange(0.0, 10.0, 0.25)
    line = Series(utc(time), 3.0 + 0.5 * time)
    at = np.array([1.3, 4.0, 8.7])
    np.testing.assert_allclose(mean_about(line, utc(at), 2.0), 3.0 + 0.5 * at, atol=1e-9)


def test_at_its_ends_a_mean_goes_over_what_there_is() -> None:
    line = Series(utc(np.arange(11.0)), np.arange(11.0))
    assert mean_about(line, utc(np.array([0.0, 10.0])), 4.0) == pytest.approx([1.0, 9.0])
    # beyond them nothing is known but the end
    assert mean_about(line, utc(np.array([-5.0, 15.0])), 2.0) == pytest.approx([0.0, 10.0])


def test_the_curve_is_what_the_means_are_of() -> None:
    """Means over 2 s of a swing of 8 s: a straight line between them loses a quarter of it."""
    fine = np.arange(0.0, 60.0, 0.05)
    truth = Series(utc(fine), swing(fine))
    middle = np.arange(1.0, 60.0, 2.0)
    means = Series(utc(middle), mean_about(truth, utc(middle), 2.0))
    inside = (fine > 4.0) & (fine < 56.0)
    curve = curve_of_means(means, utc(fine))[inside]
    straight = np.interp(fine[inside], middle, means.value)
    off = [np.std(one - swing(fine[inside])) / np.std(swing(fine[inside])) for one in (curve, straight)]
    assert off[0] < 0.06
    assert off[1] > 0.2


def test_the_curve_keeps_the_means_that_it_was_made_of() -> None:
    middle = np.arange(1.0, 40.0, 2.0)
    means = Series(utc(middle), np.random.default_rng(2).standard_normal(middle.size))
    fine = np.arange(0.0, 40.005, 0.01)
    again = mean_about(Series(utc(fine), curve_of_means(means, utc(fine))), means.time_utc_ns, 2.0)
    np.testing.assert_allclose(again, means.value, atol=1e-3)


def test_beside_a_hole_each_side_has_a_curve_of_its_own() -> None:
    """One curve through a hole would take the mean before it for one over half of the hole."""
    fine = np.arange(0.0, 80.0, 0.05)
    truth = Series(utc(fine), swing(fine))
    middle = np.concatenate([np.arange(1.0, 30.0, 2.0), np.arange(47.0, 80.0, 2.0)])
    means = Series(utc(middle), mean_about(truth, utc(middle), 2.0))
    beside = ((fine > 24.0) & (fine < 30.0)) | ((fine > 46.0) & (fine < 52.0))
    curve = curve_of_means(means, utc(fine))[beside]
    whole = np.arange(1.0, 80.0, 2.0)
    without = curve_of_means(Series(utc(whole), mean_about(truth, utc(whole), 2.0)), utc(fine))[beside]
    off = [np.max(np.abs(one - swing(fine[beside]))) for one in (curve, without)]
    # at an end a spline is worse than inside, and no more
    assert off[1] < off[0] < 0.13
