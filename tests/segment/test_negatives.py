"""What must not be taken for a zigzag, and what of it for no turning circle, pull-out or spiral either."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.instruments import Instruments as Channels
from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.find_circles_and_spirals import find_circles_and_spirals
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from tests.segment.nomoto import START_NS, Instruments, Ship, measure


def found_in(ship: Ship, instruments: Instruments | None = None) -> list[str]:
    heading, rudder = measure(ship, instruments or Instruments())
    return [f"{z.kind} {z.psi0_deg:g}/{z.delta0_deg:g} n{len(z.executes)}" for z in find_zigzags(heading, rudder)]


def all_found_in(ship: Ship) -> list[object]:
    """Zigzags, and what else may be sailed."""
    heading, rudder = measure(ship, Instruments())
    turning = find_circles_and_spirals(Channels({"heading": heading, "rudder_angle": rudder}, {}, ()))
    return [*find_zigzags(heading, rudder), *turning]


@pytest.mark.parametrize("amplitude", [2.0, 3.0, 5.0, 8.0, 15.0])
@pytest.mark.parametrize("period", [20.0, 45.0, 90.0])
def test_sinusoidal_rudder(amplitude: float, period: float) -> None:
    ship = Ship()
    ship.wait(0.0, 60.0)
    while ship.now < 900.0:
        ship.wait(amplitude * float(np.sin(2 * np.pi * ship.now / period)), 0.1)
    assert found_in(ship) == []


@pytest.mark.parametrize("seed", range(6))
def test_autopilot_in_a_seaway(seed: int) -> None:
    random = np.random.default_rng(seed)
    ship = Ship()
    push = 0.0
    while ship.now < 1800.0:
        push += -0.02 * push + 0.02 * float(random.standard_normal())
        ship.drift_deg_s = push + 0.2 * float(np.sin(2 * np.pi * ship.now / 9.0))
        ship.autopilot(50.0, 1.0, gain=1.5, damping=10.0)
    assert found_in(ship) == []


@pytest.mark.parametrize("seed", range(40))
def test_hand_steering(seed: int) -> None:
    ship = Ship()
    ship.by_hand(seed)
    assert all_found_in(ship) == []


@pytest.mark.parametrize("angle", [10.0, 25.0, 35.0])
def test_turning_circles_to_both_sides(angle: float) -> None:
    ship = Ship()
    ship.wait(0.0, 60.0)
    start = ship.heading
    ship.steer(angle, lambda: ship.heading - start >= 540.0)
    ship.wait(0.0, 100.0)
    turned = ship.heading
    ship.steer(-angle, lambda: turned - ship.heading >= 540.0)
    ship.wait(0.0, 100.0)
    assert found_in(ship) == []


@pytest.mark.parametrize("change", [10.0, 20.0, 45.0, 90.0])
def test_course_changes_with_counter_rudder(change: float) -> None:
    ship = Ship()
    ship.wait(0.0, 60.0)
    for sign in (1, -1, 1, 1, -1):
        goal = ship.heading + sign * change
        ship.steer(sign * 10.0, lambda sign=sign, goal=goal: sign * (goal - ship.heading) <= 5.0)  # type: ignore[misc]
        ship.steer(-sign * 10.0, lambda sign=sign: sign * ship.yaw_rate <= 0.0)  # type: ignore[misc]
        ship.wait(0.0, 90.0)
    assert found_in(ship) == []


def test_course_changes_by_autopilot() -> None:
    ship = Ship()
    for course in (0.0, 30.0, 10.0, 60.0, 40.0, 120.0):
        ship.autopilot(course, 240.0)
    assert found_in(ship) == []


@pytest.mark.parametrize("side", [1, -1])
def test_pull_out(side: int) -> None:
    ship = Ship()
    ship.wait(0.0, 60.0)
    for sign in (side, -side):
        ship.wait(sign * 20.0, 120.0)
        ship.wait(0.0, 150.0)
    assert found_in(ship) == []


@pytest.mark.parametrize("side", [1, -1])
def test_williamson_turn(side: int) -> None:
    ship = Ship()
    ship.wait(0.0, 60.0)
    ship.steer(side * 35.0, lambda: side * ship.heading >= 60.0)
    ship.steer(-side * 35.0, lambda: side * ship.heading <= -160.0)
    ship.autopilot(-side * 180.0, 200.0)
    assert all_found_in(ship) == []


def test_spiral_with_both_sides() -> None:
    ship = Ship()
    ship.wait(0.0, 60.0)
    for angle in (20.0, 10.0, 5.0, 0.0, -5.0, -10.0, -20.0, -10.0, -5.0, 0.0, 5.0, 10.0, 20.0):
        ship.wait(angle, 180.0)
    assert found_in(ship) == []


def test_rudder_that_does_not_turn_the_ship() -> None:
    """The steering gear tried alongside: the heading does not answer."""
    ship = Ship(gain_per_s=0.0)
    for sign in (1, -1, 1, -1, 1, -1):
        ship.wait(sign * 35.0, 40.0)
    assert found_in(ship) == []


def test_rudder_with_the_wrong_sign() -> None:
    """Positive to port: the heading switches at the wrong side, and the channel doctor should say so."""
    ship = Ship()
    ship.wait(0.0, 60.0)
    ship.zigzag(20.0, 20.0, 1, 6)
    heading, rudder = measure(ship, Instruments())
    assert find_zigzags(heading, Series(rudder.time_utc_ns, -rudder.value)) == []


def test_noise_only() -> None:
    random = np.random.default_rng(3)
    time = START_NS + np.arange(36000, dtype=np.int64) * 100_000_000
    heading = Series(time, np.deg2rad(random.standard_normal(time.size) * 0.3))
    rudder = Series(time, np.deg2rad(random.standard_normal(time.size) * 2.0))
    assert find_zigzags(heading, rudder) == []
