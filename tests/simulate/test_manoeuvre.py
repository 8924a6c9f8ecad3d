"""The programme: executes where the heading crosses, overshoots, a rudder that takes its time, and what is refused."""

from __future__ import annotations

from math import radians

import numpy as np
import pytest

from kempf.pipeline.simulate.disturbances import CALM
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.manoeuvre import (
    TICK_S,
    CourseChange,
    HandSteering,
    SteadyCourse,
    Step,
    TurningCircle,
    ZigzagTest,
)
from kempf.pipeline.simulate.programme import sail
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT
from kempf.schemas.errors import UsageError


@pytest.mark.parametrize("name", ["mariner", "container", "tanker", "ferry"])
@pytest.mark.parametrize("side", ["starboard", "port"])
def test_executes_stand_where_the_heading_crosses(name: str, side: str) -> None:
    zigzag = ZigzagTest(20.0, 15.0, "starboard" if side == "starboard" else "port", legs=5, duration_s=3000.0)
    path, (_, record) = sail(HULLS[name], (SteadyCourse(100.0), zigzag), PAPER_ENVIRONMENT, seed=2, heading_deg=350.0)
    assert record.executes_s[0] == record.start_s
    assert len(record.executes_s) == 5
    crossings = (*record.executes_s[1:], record.end_s)
    signs = (1.0 if side == "starboard" else -1.0) * np.array([1, -1, 1, -1, 1])
    psi = path.at(np.array(crossings)).state[:, 2] - record.base_heading_rad
    np.testing.assert_allclose(psi, signs * radians(20.0), rtol=0, atol=1e-9)
    # and nowhere before on that leg
    for begin, end, sign in zip(record.executes_s, crossings, signs, strict=True):
        inside = path.at(np.linspace(begin + 0.1, end - 0.001, 500)).state[:, 2] - record.base_heading_rad
        assert np.all(sign * inside < radians(20.0))
    # the order changes sides with the execute: the rudder moves at full rate from that very instant
    for instant, sign in zip(record.executes_s, signs, strict=True):
        before, after = path.at(np.array([instant - 0.021, instant + 0.3])).rudder
        rate = HULLS[name].rudder_rate_rad_s
        assert after == pytest.approx(min(max(before + sign * 0.3 * rate, -radians(15)), radians(15)), abs=1e-9)


def test_overshoots_are_the_greatest_heading_beyond() -> None:
    path, (record,) = sail(HULLS["mariner"], (ZigzagTest(20.0, 20.0, legs=4),), CALM, seed=0)
    sides = [1.0, -1.0, 1.0]
    found = []
    for begin, end, side in zip(record.executes_s[1:], (*record.executes_s[2:], record.end_s), sides, strict=True):
        dense = path.at(np.linspace(begin, end, 20_001)).state[:, 2]
        found.append(float(np.max(side * dense)) - radians(20.0))
    # the fourth leg ends at its crossing: the turn beyond it is not on record
    np.testing.assert_allclose(record.overshoots_rad, found, atol=1e-8)


@pytest.mark.parametrize("name", sorted(HULLS))
def test_zigzags_look_like_ships(name: str) -> None:
    _, (record,) = sail(HULLS[name], (ZigzagTest(20.0, 20.0, legs=3, duration_s=1500.0),), CALM, seed=0)
    first = np.rad2deg(record.overshoots_rad[0])
    assert 8.0 < first < 25.0
    hull = HULLS[name]
    initial_turning_lengths = (record.executes_s[1] - record.start_s) * hull.trial_speed_m_s / hull.length_m
    assert 1.0 < initial_turning_lengths < 2.5


def test_a_zigzag_without_a_number_of_legs_lasts_its_duration() -> None:
    path, (record,) = sail(HULLS["ferry"], (ZigzagTest(duration_s=1200.0),), CALM, seed=0)
    assert path.duration_s == pytest.approx(1200.0)
    assert record.end_s == pytest.approx(1200.0)
    crossings = len(record.executes_s) - 1
    assert crossings > 14
    assert len(record.overshoots_rad) in (crossings, crossings - 1)


def test_port_mirrors_starboard_in_calm_water() -> None:
    right, (a,) = sail(HULLS["container"], (ZigzagTest(10, 10, "starboard", 4),), CALM, seed=0)
    left, (b,) = sail(HULLS["container"], (ZigzagTest(10, 10, "port", 4),), CALM, seed=0)
    np.testing.assert_allclose(right.column("v"), -left.column("v"), atol=1e-12)
    np.testing.assert_allclose(right.column("psi"), -left.column("psi"), atol=1e-12)
    np.testing.assert_allclose(a.overshoots_rad, b.overshoots_rad, atol=1e-12)


def test_the_rudder_keeps_its_rate_and_limit() -> None:
    hull = HULLS["mariner"]
    programme = (SteadyCourse(60.0, 90.0), HandSteering(200.0, rudder_rms_deg=25.0), TurningCircle(-35.0))
    path, _ = sail(hull, programme, CALM, seed=1)
    rate = np.abs(np.diff(path.rudder)) / path.step_s
    assert rate.max() == pytest.approx(hull.rudder_rate_rad_s, rel=1e-9)
    assert np.abs(path.rudder).max() <= hull.rudder_limit_rad


@pytest.mark.parametrize("name", sorted(set(HULLS) - {"tanker"}))
def test_the_autopilot_goes_the_shorter_way_and_holds(name: str) -> None:
    programme = (SteadyCourse(600.0, 20.0), CourseChange(-50.0, 900.0))
    path, records = sail(HULLS[name], programme, CALM, seed=0, heading_deg=350.0)
    psi = np.rad2deg(path.column("psi"))
    turned = round(records[0].end_s / path.step_s)
    assert psi[turned] == pytest.approx(380.0, abs=0.5), "through north, not wrapped"
    assert psi[-1] == pytest.approx(330.0, abs=1.0)


def test_the_integral_takes_the_wind_out_of_the_heading() -> None:
    path, _ = sail(HULLS["mariner"], (SteadyCourse(1500.0),), PAPER_ENVIRONMENT, seed=0, heading_deg=40.0)
    assert np.rad2deg(path.column("psi")[-1]) == pytest.approx(40.0, abs=0.3)
    assert abs(path.rudder[-1]) > radians(0.3)


def test_hand_steering_has_its_size_and_its_band() -> None:
    step = HandSteering(2000.0, 5.0, 20.0, 100.0)
    steering = step.steering(HULLS["ferry"], 0.0, np.random.default_rng(0))
    assert np.rad2deg(steering.orders.std()) == pytest.approx(5.0, rel=0.05)
    power = np.abs(np.fft.rfft(steering.orders * np.hanning(steering.orders.size))) ** 2
    frequency = np.fft.rfftfreq(steering.orders.size, TICK_S)
    inside = (frequency > 1 / 110) & (frequency < 1 / 19)
    assert power[inside].sum() / power.sum() > 0.99


def test_a_turning_circle_ends_after_its_change_of_heading() -> None:
    path, (record,) = sail(HULLS["ferry"], (TurningCircle(35.0, 360.0),), CALM, seed=0)
    assert np.rad2deg(path.column("psi")[-1]) == pytest.approx(360.0, abs=0.1)
    assert record.executes_s == (0.0,)
    assert record.end_s == pytest.approx(path.duration_s)


@pytest.mark.parametrize(
    ("programme", "code"),
    [
        ((), "programme_empty"),
        ((SteadyCourse(0.0),), "programme_duration"),
        ((SteadyCourse(float("nan")),), "programme_duration"),
        ((ZigzagTest(legs=0),), "programme_legs"),
        ((HandSteering(60.0, 5.0, 50.0, 50.0),), "programme_band"),
        ((SteadyCourse(10.0, float("inf")),), "programme_heading"),
        ((TurningCircle(2000.0, 1e9, 600.0),), "plant_out_of_range"),
    ],
)
def test_an_impossible_programme_is_refused(programme: tuple[Step, ...], code: str) -> None:
    with pytest.raises(UsageError) as caught:
        sail(HULLS["ferry"], programme, CALM, seed=0)
    assert caught.value.code == code
    assert caught.value.next_step
