"""Bad input is refused or flagged, each case with its reason; good input raises no alarm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.moves import moves, swing
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.simulate.hulls import HULLS
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS
from tests.estimate.simulated import bounds, changed, instruments_of, record_of, sailed, without

TRIAL = sailed("ferry", seed=1, duration_s=400.0)
START, END = bounds(TRIAL)
LOG = instruments_of(TRIAL)
KNOT, DEG = 1852.0 / 3600.0, np.pi / 180.0
Change = Callable[[np.ndarray], np.ndarray]


def valued(channel: str, change: Change, log: Instruments = LOG) -> Instruments:
    one = log.series[channel]
    return changed(log, channel, Series(one.time_utc_ns, change(one.value)))


def times(factor: float) -> Change:
    return lambda x: factor * x


def held(channel: str, from_s: float, to_s: float, log: Instruments = LOG) -> Instruments:
    """The channel repeats one reading for a while."""
    one = log.series[channel]
    seconds = one.seconds_since(START)
    value = one.value.copy()
    value[(seconds >= from_s) & (seconds <= to_s)] = np.interp(from_s, seconds, value)
    return changed(log, channel, Series(one.time_utc_ns, value))


def stuck(channel: str, log: Instruments = LOG) -> Instruments:
    return valued(channel, lambda x: np.full_like(x, x[0]), log)


def refused(log: Instruments, end_ns: int = END) -> DataRejected:
    with pytest.raises(DataRejected) as caught:
        make_record(log, START, end_ns)
    return caught.value


def emptied(x: np.ndarray) -> np.ndarray:
    return np.where(np.arange(x.size) > 0.8 * x.size, 0.0, x)


REFUSED: list[tuple[str, Instruments, str, str]] = [
    ("degrees of rudder for radians", valued("rudder_angle", times(1 / DEG)), "rudder_unit", "`unit: deg`"),
    ("radians of rudder for degrees", valued("rudder_angle", times(DEG)), "rudder_unit", "`unit: rad`"),
    ("rate in deg/s for rad/s", valued("yaw_rate", times(1 / DEG)), "yaw_rate_unit", "`unit: deg/s`"),
    ("rate in rad/s for deg/s", valued("yaw_rate", times(DEG)), "yaw_rate_unit", "`unit: rad/s`"),
    ("rate in deg/min for deg/s", valued("yaw_rate", times(60.0)), "yaw_rate_unit", "`unit: deg/min`"),
    ("rate in deg/s for deg/min", valued("yaw_rate", times(1 / 60.0)), "yaw_rate_unit", "`unit: deg/s`"),
    ("rate in rad/s for deg/min", valued("yaw_rate", times(DEG / 60.0)), "yaw_rate_unit", "`unit: rad/s`"),
    ("rate of the wrong sign", valued("yaw_rate", times(-1.0)), "yaw_rate_sign", "`positive: port`"),
    ("both", valued("yaw_rate", times(-1 / DEG)), "yaw_rate_unit", "`unit: deg/s`, and `positive: port`"),
    ("heading in rad for deg", valued("heading", times(DEG)), "heading_unit", "`unit: rad`"),
    ("heading of the wrong sign", valued("heading", times(-1.0)), "heading_sign", "for heading"),
    ("compass dead", stuck("heading"), "heading_stuck", "compass"),
    ("compass dead, no rate", stuck("heading", without(LOG, "yaw_rate")), "heading_stuck", "compass"),
    ("compass hangs for 40 s", held("heading", 100.0, 140.0), "heading_stuck", "before or after"),
    (
        "compass leaps",
        valued("heading", lambda x: x + 0.4 * (np.arange(x.size) > 0.5 * x.size)),
        "heading_leap",
        "before",
    ),
    ("log hangs", held("speed_through_water", 100.0, 300.0), "speed_stuck", "Map no speed_through_water"),
    ("log stops", valued("speed_through_water", emptied), "speed_stuck", "Map no speed_through_water"),
    ("astern", valued("speed_through_water", times(-1.0)), "speed_negative", "ahead"),
    ("log in knots for m/s", valued("speed_through_water", times(1 / KNOT)), "speed_unit", "`unit: kn`"),
    ("log in m/s for knots", valued("speed_through_water", times(KNOT)), "speed_unit", "`unit: m/s`"),
    ("GNSS in knots for m/s", valued("speed_over_ground", times(1 / KNOT)), "speed_unit", "`unit: kn`"),
    ("GNSS in m/s for knots", valued("speed_over_ground", times(KNOT)), "speed_unit", "`unit: m/s`"),
    ("GNSS in km/h for m/s", valued("speed_over_ground", times(3.6)), "speed_unit", "`unit: km/h`"),
    ("course of another ship", valued("course_over_ground", lambda x: x + 2.0), "course_not_along_heading", "offset"),
    ("course reversed", valued("course_over_ground", lambda x: x + np.pi), "course_not_along_heading", "astern"),
]


@pytest.mark.parametrize(("log", "code", "cure"), [case[1:] for case in REFUSED], ids=[case[0] for case in REFUSED])
def test_bad_input_is_refused_with_its_cure(log: Instruments, code: str, cure: str) -> None:
    error = refused(log)
    assert error.code == code
    assert cure in error.next_step
    assert error.details


def stops(x: np.ndarray) -> np.ndarray:
    return np.where(np.arange(x.size) > 0.8 * x.size, 1e-3 * np.sin(np.arange(x.size)), x)


def test_a_ship_that_stops_is_refused() -> None:
    error = refused(valued("speed_through_water", stops))
    assert error.code == "no_speed"
    assert 0.1 < error.details["share"] < 0.3


def test_one_turn_is_refused_and_two_legs_are_not() -> None:
    executes = [START + round(s * SECOND_NS) for s in np.array(TRIAL.truth.zigzags[0].executes_s) - 100.0]
    error = refused(LOG, executes[1])
    assert error.code == "too_few_executes"
    assert error.details == {"executes": 1, "needed": 2}
    assert make_record(LOG, START, executes[2]).warnings == ()


def test_a_ship_that_does_not_swing_back_is_flagged() -> None:
    # a rudder that goes over and back while she only turns to starboard
    one = LOG.series["heading"]
    seconds = one.seconds_since(START)
    circle = 0.02 * np.clip(seconds, 0.0, None)
    turning = changed(without(LOG, "yaw_rate"), "heading", Series(one.time_utc_ns, circle))
    course = LOG.series["course_over_ground"]
    turning = changed(turning, "course_over_ground", Series(course.time_utc_ns, 0.02 * course.seconds_since(START)))
    said = make_record(without(turning, "latitude", "longitude"), START, END).warnings
    assert any("has not swung back" in warning for warning in said)


@pytest.mark.parametrize("log", [stuck("yaw_rate"), held("yaw_rate", 100.0, 140.0)])
def test_a_yaw_rate_that_is_stuck_is_left_out(log: Instruments) -> None:
    record = make_record(log, START, END)
    assert record.used == (True, False, True)
    assert len(record.warnings) == 1 and "is stuck" in record.warnings[0]


def test_a_constant_speed_is_fine() -> None:
    assert make_record(stuck("speed_through_water"), START, END).warnings == ()


def test_a_mis_scaled_rate_is_flagged() -> None:
    said = make_record(valued("yaw_rate", times(1.5)), START, END).warnings
    assert len(said) == 1 and "integrated yaw rate is 1.5" in said[0]


def test_a_rate_of_another_ship_is_flagged() -> None:
    other = instruments_of(sailed("mariner", seed=5, duration_s=400.0)).series["yaw_rate"]
    (said,) = make_record(changed(LOG, "yaw_rate", other), START, END).warnings
    assert said.startswith("heading and yaw_rate may disagree")


def test_a_strong_stream_is_flagged_not_refused() -> None:
    # a boat of 1.9 m/s: half her speed is no more than a stream may be
    log = valued("speed_through_water", times(0.25 * KNOT), valued("speed_over_ground", times(0.25)))
    said = make_record(without(log, "latitude", "longitude"), START, END).warnings
    assert any("may disagree" in warning and "current removed" in warning for warning in said)


def test_a_course_well_off_the_heading_is_flagged() -> None:
    (said,) = make_record(valued("course_over_ground", lambda x: x + np.deg2rad(38.0)), START, END).warnings
    assert said.startswith("course_over_ground has an offset: add -38.0")


def test_a_rudder_to_port_is_flagged() -> None:
    (said,) = make_record(valued("rudder_angle", times(-1.0)), START, END).warnings
    assert said.startswith("rudder_angle has the wrong sign")


def test_sway_that_only_repeats_the_yaw_rate_is_flagged() -> None:
    # an antenna far ahead of a ship that does not drift: y_v is the yaw rate times its distance
    heading, rate = LOG.series["heading"], LOG.series["yaw_rate"]
    course, speed = LOG.series["course_over_ground"], LOG.series["speed_over_ground"]
    time = course.time_utc_ns
    sway = 30.0 * np.interp(time, rate.time_utc_ns, rate.value)
    sway += np.random.default_rng(1).normal(0.0, 0.05, time.size)
    K = np.interp(time, heading.time_utc_ns, heading.value)
    log = changed(LOG, "course_over_ground", Series(time, K + np.arcsin(sway / speed.value)))
    said = make_record(without(log, "latitude", "longitude"), START, END).warnings
    assert len(said) == 1 and "collinear" in said[0] and "other angles" in said[0]


@pytest.mark.parametrize("hull", sorted(HULLS))
def test_good_input_raises_no_alarm(hull: str) -> None:
    record: Record = record_of(sailed(hull, seed=3, duration_s=900.0))
    # the small boat's sway is hardly distinguished from her yaw rate: what is said of that is true
    assert [w for w in record.warnings if hull != "usv" or "collinear" not in w] == []


def test_moves_counts_legs_despite_spikes_and_noise() -> None:
    rng = np.random.default_rng(0)
    legs = np.repeat([0.0, 20.0, -20.0, 20.0, -20.0], 40) + rng.normal(0.0, 0.3, 200)
    assert moves(legs) == 4
    legs[[25, 90, 133]] = -80.0, 75.0, 60.0
    assert moves(legs) == 4
    assert swing(legs) == pytest.approx(40.0, abs=2.0)
    assert moves(np.repeat([0.0, 35.0], 50)) == 1
    assert moves(np.repeat([0.0, 35.0, 0.0], 50)) == 2
    assert moves(np.zeros(50)) == 0
