"""Random manoeuvres: large rudder orders at irregular times, and steering that is none."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.instruments import Instruments as Channels
from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.find_circles_and_spirals import find_circles_and_spirals
from kempf.pipeline.segment.spirals.random_manoeuvre import RandomManoeuvre, find_random
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from tests.segment.nomoto import START_NS, Instruments, Ship, measure


def at_random(ship: Ship, orders: int, seed: int, rest: tuple[float, float] = (20.0, 50.0)) -> tuple[float, float]:
    """Sail so many orders, each far from the one before; return the instants of the first and the last, s."""
    random = np.random.default_rng(seed)
    begun, last, rudder = ship.now, ship.now, ship.rudder
    for _ in range(orders):
        others = [angle for angle in (-35.0, -20.0, 0.0, 20.0, 35.0) if abs(angle - rudder) >= 20.0]
        rudder, last = float(random.choice(others)), ship.now
        ship.wait(rudder, float(random.uniform(*rest)))
    return begun, last


def found_in(
    ship: Ship, speed: Series | None = None, shaft: Series | None = None, unrecorded: tuple[float, float] | None = None
) -> list[RandomManoeuvre]:
    heading, rudder = measure(ship, Instruments())
    if unrecorded is not None:
        time_s = (rudder.time_utc_ns - START_NS) / 1e9
        there = (time_s < unrecorded[0]) | (time_s > unrecorded[1])
        rudder = Series(rudder.time_utc_ns[there], rudder.value[there])
    series = {"heading": heading, "rudder_angle": rudder}
    series |= {"speed_through_water": constant(ship, 5.0) if speed is None else speed}
    series |= {} if shaft is None else {"shaft_speed": shaft}
    channels = Channels(series, {}, ())
    before = [*(found := find_zigzags(heading, rudder)), *find_circles_and_spirals(channels, found)]
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
    ship = Ship()
    ship.by_hand(seed)
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


def test_parts_of_unequal_rhythm_share_nothing() -> None:
    ship = Ship(rudder_rate_deg_s=20.0, time_constant_s=4.0, gain_per_s=0.1)
    ship.wait(0.0, 200.0)
    at_random(ship, 9, 2, rest=(44.0, 45.0))
    ship.wait(ship.rudder, 10.0)
    at_random(ship, 24, 4, rest=(12.0, 12.5))
    heading, rudder = measure(ship, Instruments())
    series = {"heading": heading, "rudder_angle": rudder, "speed_through_water": constant(ship, 5.0)}
    one, other = find_random(Channels(series, {}, ()))
    assert one.end_utc_ns <= other.start_utc_ns
    assert one.orders_utc_ns[-1] < one.end_utc_ns and other.start_utc_ns < other.orders_utc_ns[0]


@pytest.mark.parametrize("apart_s", [300.0, 1200.0])
def test_a_passage_with_course_alterations_is_none(apart_s: float) -> None:
    ship = Ship()
    for k in range(9):
        course = ship.heading + (40.0 if k % 2 else -25.0)
        side = 1.0 if k % 2 else -1.0
        ship.steer(20.0 * side, lambda course=course, side=side: side * (ship.heading - course) > -15.0)  # type: ignore[misc]
        ship.wait(10.0 * side, 6.0)
        ship.wait(-8.0 * side, 8.0)
        ship.autopilot(course, apart_s)
    assert found_in(ship) == []


def test_readings_that_are_wrong_for_a_moment_end_nothing() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    first, last = at_random(ship, 12, 1)
    half = round(0.5 * (first + last))
    for channel, value in (("speed", 5.0), ("shaft", 1.5)):
        series = constant(ship, value)
        series.value[half : half + 2] = -value
        (one,) = found_in(ship, **{channel: series})
        assert seconds(one.start_utc_ns) <= first + 1.0 and last - 1.0 <= seconds(one.end_utc_ns), channel
    few = constant(ship, 1.5)
    assert len(found_in(ship, shaft=Series(few.time_utc_ns[:2], few.value[:2]))) == 1


def test_a_gap_ends_it_and_a_short_one_does_not() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    first, last = at_random(ship, 20, 1)
    half = 0.5 * (first + last)
    one, other = found_in(ship, unrecorded=(half, half + 40.0))
    assert seconds(one.end_utc_ns) <= half and half + 39.0 <= seconds(other.start_utc_ns)
    (whole,) = found_in(ship, unrecorded=(half, half + 0.6))
    assert whole.start_utc_ns < START_NS + half * 1e9 < whole.end_utc_ns
    for missing, parts in ((40.0, 1), (120.0, 2)):
        log = constant(ship, 5.0)
        time_s = (log.time_utc_ns - START_NS) / 1e9
        there = (time_s < half) | (time_s > half + missing)
        assert len(found_in(ship, speed=Series(log.time_utc_ns[there], log.value[there]))) == parts


def test_the_first_order_after_she_gathered_way_counts() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    first, _ = at_random(ship, 12, 1)
    gathering = stepped(ship, 0.5, 5.0, first - 15.0)
    (one,), (whole,) = found_in(ship, speed=gathering), found_in(ship)
    assert one.orders_utc_ns == whole.orders_utc_ns and whole.start_utc_ns < one.start_utc_ns


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
