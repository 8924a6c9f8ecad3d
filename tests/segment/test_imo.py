"""The IMO criteria: limits by the resolution's table, and when they do not apply."""

from __future__ import annotations

from dataclasses import replace

import pytest

from kempf.pipeline.segment.particulars import Particulars
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.segment.zigzags.imo import judge, overshoot_limits
from kempf.pipeline.segment.zigzags.zigzag import SpeedConstancy, Zigzag
from tests.segment.nomoto import Instruments, Ship, measure


def zigzag(psi0: float, delta0: float, legs: int = 5) -> Zigzag:
    ship = Ship()
    ship.wait(0.0, 60.0)
    ship.zigzag(psi0, delta0, 1, legs)
    return find_zigzags(*measure(ship, Instruments()))[0]


@pytest.mark.parametrize(
    ("ratio", "first", "second"),
    [
        (5.0, 10.0, 25.0),
        (9.999, 10.0, 25.0),
        (10.0, 10.0, 25.0),
        (20.0, 15.0, 32.5),
        (30.0, 20.0, 40.0),
        (50.0, 20.0, 40.0),
    ],
)
def test_limits_of_the_resolution(ratio: float, first: float, second: float) -> None:
    assert overshoot_limits(8.0 * ratio, 8.0) == pytest.approx((first, second))


def test_ten_ten_and_twenty_twenty() -> None:
    ten = judge(zigzag(10, 10), Particulars(160.0, 8.0))
    assert [c.name for c in ten] == ["10/10 first overshoot", "10/10 second overshoot"]
    assert [c.limit_deg for c in ten] == [15.0, 32.5]
    assert [c.passed for c in ten] == [True, True]
    (twenty,) = judge(zigzag(20, 20), Particulars(160.0, None))
    assert (twenty.limit_deg, twenty.passed, twenty.why) == (25.0, True, "")


def test_too_large_an_overshoot_fails() -> None:
    good = zigzag(20, 20)
    bad = replace(good, overshoots=(replace(good.overshoots[0], beyond_nominal_deg=25.1), *good.overshoots[1:]))
    assert judge(bad, Particulars(160.0, 8.0))[0].passed is False
    edge = replace(good, overshoots=(replace(good.overshoots[0], beyond_nominal_deg=25.0), *good.overshoots[1:]))
    assert judge(edge, Particulars(160.0, 8.0))[0].passed is True


def test_not_applicable_says_why() -> None:
    ten = zigzag(10, 10)
    assert "length" in judge(ten, Particulars(None, 8.0))[0].why
    assert "speed" in judge(ten, Particulars(160.0, None))[0].why
    assert "100 m" in judge(ten, Particulars(88.0, 6.0))[0].why
    assert "10/20" in judge(zigzag(10, 20), Particulars(160.0, 8.0))[0].why
    turning = replace(ten, quality=replace(ten.quality, start="turning"))
    assert "steady" in judge(turning, Particulars(160.0, 8.0))[0].why
    slow = replace(ten, speed=SpeedConstancy(approach_m_s=7.0, mean_m_s=6.5, std_m_s=0.1, trend_percent=0.0))
    assert "90 %" in judge(slow, Particulars(160.0, 8.0))[0].why
    short = replace(ten, overshoots=ten.overshoots[:1])
    assert "broken off" in judge(short, Particulars(160.0, 8.0))[1].why
    for case in (
        judge(ten, Particulars(88.0, 6.0)),
        judge(turning, Particulars(160.0, 8.0)),
        judge(slow, Particulars(160.0, 8.0)),
    ):
        assert all(c.passed is None for c in case)


def test_speed_of_the_approach_counts() -> None:
    ten = zigzag(10, 10)
    fast = replace(ten, speed=SpeedConstancy(approach_m_s=16.0, mean_m_s=15.0, std_m_s=0.1, trend_percent=0.0))
    assert judge(fast, Particulars(160.0, 8.0))[0].limit_deg == 10.0


def test_a_model_is_judged_as_the_ship_that_it_is_one_of() -> None:
    ten = zigzag(10, 10)
    approach = SpeedConstancy(approach_m_s=1.179, mean_m_s=1.1, std_m_s=0.01, trend_percent=0.0)
    model = replace(ten, speed=approach)
    # 7 m at 1.179 m/s take 5.9 s, the ship of 320 m 40 s: the limits of the two are the table's two ends
    alone, full = judge(model, Particulars(7.0, 1.179)), judge(model, Particulars(7.0, 1.179, 45.714))
    assert [c.limit_deg for c in full] == [20.0, 40.0]
    assert all(c.passed is None and "model_scale" in c.why for c in alone)
    assert all(c.passed is not None for c in full)
    # a model of a ship that is too short is no reason to ask for its scale
    (why,) = {c.why for c in judge(model, Particulars(7.0, 1.179, 10.0))}
    assert why == "the ship is 70 m long, the standard begins at 100 m"
