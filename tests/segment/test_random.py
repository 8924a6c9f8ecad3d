"""Random manoeuvres: large rudder orders at irregular times, and steering that is none."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.instruments import Instruments as Channels
from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.find import find_manoeuvres
from kempf.pipeline.segment.find_turning import find_turning
from kempf.pipeline.segment.random_manoeuvre import RandomManoeuvre, find_random
from tests.segment.nomoto import START_NS, Instruments, Ship, measure


def at_random(ship: Ship, orders: int, seed: int) -> tuple[float, float]:
    """Sail so many orders, each far from the one before; return the instants of the first and the last, s."""
    random = np.random.default_rng(seed)
    begun, last, rudder = ship.now, ship.now, ship.rudder
    for _ in range(orders):
        others = [angle for angle in (-35.0, -20.0, 0.0, 20.0, 35.0) if abs(angle - rudder) >= 20.0]
        rudder, last = float(random.choice(others)), ship.now
        ship.wait(rudder, float(random.uniform(20.0, 50.0)))
    return begun, last


def found_in(ship: Ship, speed: Series | None = None, shaft: Series | None = None) -> list[RandomManoeuvre]:
    heading, rudder = measure(ship, Instruments())
    series = {"heading": heading, "rudder_angle": rudder}
    series |= {"speed_through_water": constant(ship, 5.0) if speed is None else speed}
    series |= {} if shaft is None else {"shaft_speed": shaft}
    channels = Channels(series, {}, ())
    before = [*(found := find_manoeuvres(heading, rudder)), *find_turning(channels, found)]
    taken = [(one.start_utc_ns, one.end_utc_ns) for one in before]
    return find_random(channels, taken)


def constant(ship: Ship, value: float) -> Series:
    return stepped(ship, value, value, 0.0)


def stepped(ship: Ship, before: float, behind: float, at_s: float) -> Series:
    """A channel once a second that changes at an instant."""
    time_s = np.arange(0.0, ship.now, 1.0)
    time_utc_ns = START_NS + np.round(time_s * 1e9).astype(np.int64)
    return Series(time_utc_ns, np.where(time_s < at_s, before, behind))


def seconds(utc_ns: int) -> float:
    return (utc_ns - START_NS) / 1e9


@pytest.mark.parametrize("scale", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_it_is_found_with_its_orders(seed: int, scale: float) -> None:
    ship = Ship(scale=scale)
    ship.wait(0.0, 400.0)
    first, last = at_random(ship, 12, seed)
    ship.autopilot(ship.heading, 600.0)
    (one,) = found_in(ship)
    assert seconds(one.orders_utc_ns[0]) == pytest.approx(first, abs=60.0 * scale)
    # the autopilot that takes over goes far, too, until it has her
    assert -60.0 * scale < seconds(one.orders_utc_ns[-1]) - last < 120.0 * scale
    assert 10 <= len(one.orders_utc_ns) <= 14
    assert one.start_utc_ns < one.orders_utc_ns[0] and one.orders_utc_ns[-1] < one.end_utc_ns
    assert one.delta0_deg == pytest.approx(35.0, abs=0.5) and one.heading_range_deg > 30.0


def test_too_few_orders_are_none() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    at_random(ship, 4, 0)
    ship.autopilot(ship.heading, 300.0)
    assert found_in(ship) == []


@pytest.mark.parametrize("seed", range(10))
def test_hand_steering_is_none(seed: int) -> None:
    """A helmsman who holds any angle for any time, about a course."""
    random = np.random.default_rng(seed)
    ship = Ship()
    ship.wait(0.0, 60.0)
    while ship.now < 1500.0:
        towards = -1.0 if ship.heading > 0 else 1.0
        ship.wait(towards * float(random.uniform(-3.0, 12.0)), float(random.uniform(6.0, 35.0)))
    assert found_in(ship) == []


def test_a_zigzag_and_a_circle_are_none() -> None:
    ship = Ship()
    ship.wait(0.0, 100.0)
    ship.zigzag(20.0, 20.0, 1, 8)
    ship.autopilot(ship.heading, 200.0)
    ship.wait(0.0, 60.0)
    ship.steer(35.0, at_most_s=300.0)
    assert found_in(ship) == []


def test_it_ends_where_she_stops_or_her_shaft_turns_astern() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    first, last = at_random(ship, 20, 1)
    half = 0.5 * (first + last)
    for channels in ({"speed": stepped(ship, 5.0, 1.0, half)}, {"shaft": stepped(ship, 1.5, -1.5, half)}):
        (one,) = found_in(ship, **channels)
        assert seconds(one.end_utc_ns) <= half and one.orders_utc_ns[-1] < one.end_utc_ns
    # a shaft that stands still does not turn astern
    (one,) = found_in(ship, shaft=stepped(ship, 1.5, 0.0, half))
    assert seconds(one.end_utc_ns) > half


def test_a_long_rest_of_the_rudder_parts_two() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    at_random(ship, 10, 2)
    ship.wait(0.0, 900.0)
    begun, _ = at_random(ship, 10, 3)
    one, other = found_in(ship)
    assert seconds(one.end_utc_ns) < begun - 600.0 < seconds(other.start_utc_ns)


def test_over_ground_it_is_the_way_along_the_ship_that_counts() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    at_random(ship, 12, 4)
    heading, rudder = measure(ship, Instruments())
    ground = constant(ship, 5.0)
    over = np.interp(ground.time_utc_ns, heading.time_utc_ns, heading.value)
    base = {"heading": heading, "rudder_angle": rudder, "speed_over_ground": ground}
    ahead = Channels({**base, "course_over_ground": Series(ground.time_utc_ns, over)}, {}, ())
    astern = Channels({**base, "course_over_ground": Series(ground.time_utc_ns, over + np.pi)}, {}, ())
    assert len(find_random(ahead)) == 1 == len(find_random(Channels(base, {}, ())))
    assert find_random(astern) == []


def test_without_what_it_takes_there_is_none() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    at_random(ship, 12, 4)
    heading, rudder = measure(ship, Instruments())
    whole = {"heading": heading, "rudder_angle": rudder, "speed_through_water": constant(ship, 5.0)}
    assert len(find_random(Channels(whole, {}, ()))) == 1
    nothing = Series(heading.time_utc_ns[:0], heading.value[:0])
    for name in whole:
        assert find_random(Channels({k: v for k, v in whole.items() if k != name}, {}, ())) == []
        assert find_random(Channels({**whole, name: nothing}, {}, ())) == []
    # a shaft that never wrote says nothing against it
    assert len(find_random(Channels({**whole, "shaft_speed": nothing}, {}, ()))) == 1
