"""What receiver and log have smoothed is found and undone; a receiver that is late as a whole is left alone."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from kempf.pipeline.channels.doctor.log import EARTH_M, Log
from kempf.pipeline.channels.instant_errors import IN_THE_LOG
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateness import velocity_lateness
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.undelayed_speeds import apart, undelayed_speeds, unsmoothed
from kempf.schemas.units import SECOND_NS

SPEED, PERIOD_S, LONG_S = 1.8, 0.2, 300.0
FIX_STD_M, VELOCITY_STD_M_S = 0.8, 0.015
TIME = np.arange(0.0, LONG_S, PERIOD_S)


def boat(late_s: float = 0.0, smoothed_s: float = 0.0, seed: int = 3) -> Instruments:
    """Zigzags of a boat: fixes and velocity of ``late_s`` ago, the velocity then smoothed from fix to fix."""
    random = np.random.default_rng(seed)

    def course(time: Float) -> Float:
        return 0.5 * np.sin(2.0 * np.pi * time / 14.0) + 0.01 * time

    fine = np.arange(-5.0, LONG_S, 0.01)
    way = np.cumsum(SPEED * np.exp(1j * course(fine))) * 0.01
    then = TIME - late_s
    place = np.interp(then, fine, way.real) + 1j * np.interp(then, fine, way.imag)
    place += FIX_STD_M * (random.standard_normal(TIME.size) + 1j * random.standard_normal(TIME.size))
    velocity = SPEED * np.exp(1j * course(then))
    velocity += VELOCITY_STD_M_S * (random.standard_normal(TIME.size) + 1j * random.standard_normal(TIME.size))
    kept = smoothed_s / (smoothed_s + PERIOD_S)
    velocity = lfilter([1.0 - kept], [1.0, -kept], velocity, zi=[kept * velocity[0]])[0]
    utc = np.rint(TIME * SECOND_NS).astype(np.int64)
    channels = {
        "latitude": 0.9 + place.real / EARTH_M,
        "longitude": place.imag / EARTH_M / np.cos(0.9),
        "speed_over_ground": np.abs(velocity),
        "course_over_ground": np.unwrap(np.angle(velocity)),
        "speed_through_water": SPEED + 0.02 * random.standard_normal(TIME.size),
    }
    return Instruments({name: Series(utc, value) for name, value in channels.items()}, {}, ())


def of_velocity(instruments: Instruments) -> tuple[float, float]:
    log = Log(instruments.series)
    track, velocity = log.track(), log.velocity("course")
    assert track is not None
    assert velocity is not None
    found = velocity_lateness(track, velocity)
    assert found is not None
    return found.late_s, found.std_s


def test_a_smoothed_velocity_is_as_late_as_its_filter_makes_it() -> None:
    apart_in_std = []
    for seed in range(20):
        late_s, std_s = of_velocity(boat(smoothed_s=0.3, seed=seed))
        assert std_s < 0.1
        apart_in_std.append((late_s - 0.3) / std_s)
    assert 0.5 < np.std(apart_in_std) < 1.6
    assert abs(np.mean(apart_in_std)) < 0.8


def test_it_is_undone_and_said() -> None:
    ship, there = boat(smoothed_s=0.4), boat()
    found = undelayed_speeds(ship, 0, int(LONG_S * SECOND_NS))
    assert any("late beside the fixes" in sentence for sentence in found.said)
    assert 0.0 < found.errors.smoothing_s < 0.1
    off = [found.instruments.series["course_over_ground"], ship.series["course_over_ground"]]
    off_rad = [float(np.std(one.value - there.series["course_over_ground"].value)) for one in off]
    assert off_rad[0] < 0.3 * off_rad[1]


def test_what_is_not_late_stays_as_it_is() -> None:
    # a receiver that is late as a whole is an effect to be named, and shows nothing here
    for late_s in (0.0, 0.3):
        ship = boat(late_s)
        found = undelayed_speeds(ship, 0, int(LONG_S * SECOND_NS))
        assert found.instruments is ship
        assert found.said == ()
        assert found.errors == IN_THE_LOG


def test_what_may_be_late_is_left_and_not_known() -> None:
    """A receiver that smooths over 0.1 s, in boats that do not all show it."""
    kinds = set()
    for seed in range(40):
        ship = boat(smoothed_s=0.1, seed=seed)
        late_s, std_s = of_velocity(ship)
        found = undelayed_speeds(ship, 0, int(LONG_S * SECOND_NS))
        same = found.instruments is ship
        if late_s > 2.326 * std_s:
            kinds.add("undone")
            assert not same and found.errors.smoothing_s == std_s and "undone" in found.said[0]
        elif late_s > max(1.645 * std_s, 0.2 * PERIOD_S):
            kinds.add("may be")
            assert same and found.errors.smoothing_s == late_s and "may be" in found.said[0]
        else:
            kinds.add("none")
            assert same and found.errors == IN_THE_LOG and found.said == ()
    assert kinds == {"undone", "may be", "none"}


def test_what_lateness_takes_from_the_lateral_speed_is_its_difference() -> None:
    """Eq. (18) of a velocity from which a little more is taken, less that of the velocity as it is."""
    ship, more_s = boat(smoothed_s=0.4), 1e-4
    late_s, _ = of_velocity(ship)
    found = undelayed_speeds(ship, 0, int(LONG_S * SECOND_NS))
    assert found.velocity is not None
    speed, course = (ship.series[name] for name in ("speed_over_ground", "course_over_ground"))
    less, more = (unsmoothed(speed, course, late_s + by) for by in (0.0, more_s))
    heads = 0.8 * course.value
    lateral = [one["speed_over_ground"].value * np.sin(one["course_over_ground"].value - heads) for one in (less, more)]
    np.testing.assert_allclose(
        (found.velocity.slope * np.exp(-1j * heads)).imag, (lateral[1] - lateral[0]) / more_s, atol=1e-6
    )


def test_a_log_of_means_is_read_at_their_middle_one_after_the_other() -> None:
    ship = boat()
    log = ship.series["speed_through_water"]
    speed = SPEED + 0.05 * np.sin(2.0 * np.pi * TIME / 60.0) + log.value - SPEED
    shown = np.convolve(np.concatenate([np.full(9, speed[0]), speed]), np.full(10, 0.1), mode="valid")
    late = Instruments({**ship.series, "speed_through_water": Series(log.time_utc_ns, shown)}, {}, ())
    found = undelayed_speeds(late, 0, int(LONG_S * SECOND_NS))
    assert any("means over 2 s" in sentence for sentence in found.said)
    means = found.instruments.series["speed_through_water"]
    assert np.all(np.diff(means.time_utc_ns) == 10 * log.time_utc_ns[1])
    at = (means.time_utc_ns / SECOND_NS)[1:]
    assert np.std(means.value[1:] - SPEED - 0.05 * np.sin(2.0 * np.pi * at / 60.0)) < 0.01


def test_means_over_a_number_of_readings_that_varies_share_none() -> None:
    log = Series(np.arange(12, dtype=np.int64) * SECOND_NS, np.arange(12.0))
    means = apart(log, 5.5)
    assert means.value.tolist() == [0.0, 6.0]
    assert means.time_utc_ns.tolist() == [-2.25 * SECOND_NS, 3.75 * SECOND_NS]
