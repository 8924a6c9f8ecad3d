"""How a measured manoeuvre began and what blew from there on, read off a log."""

from math import pi, radians

import numpy as np
import pytest

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.manoeuvre.initial_conditions import initial_conditions
from kempf.schemas.units import SECOND_NS


def log_of(**columns: Float) -> Instruments:
    series = {}
    for name, value in columns.items():
        time = np.arange(value.size, dtype=np.int64) * SECOND_NS
        series[name] = Series(time, value.astype(np.float64))
    return Instruments(series, dict.fromkeys(series, "made up"), ())


def test_the_wind_is_read_as_a_course_and_counted_from_the_approach() -> None:
    t = np.arange(200.0)
    speed = np.where(t < 100.0, 4.0, 8.0)
    log = log_of(true_wind_speed=speed, true_wind_direction=np.full(t.size, pi / 2), speed_through_water=0 * t + 3.0)
    seen = initial_conditions(log, 50 * SECOND_NS, 190 * SECOND_NS, 10.0)
    assert seen.start.forward_m_s == pytest.approx(3.0)
    assert seen.wind_from_rad == pytest.approx(pi / 2)
    first, last = seen.air[0], seen.air[-1]
    np.testing.assert_allclose(first, [0.0, 0.0, 4.0], atol=1e-9)
    np.testing.assert_allclose(last, [140.0, 0.0, 8.0], atol=1e-9)
    # on a course of 90 deg the same wind comes from ahead
    turned = seen.counted_from(radians(90.0))
    assert turned.wind_from_rad == pytest.approx(0.0)
    np.testing.assert_allclose(turned.air[-1], [140.0, 8.0, 0.0], atol=1e-9)


def test_a_beginning_is_as_unsure_as_its_readings() -> None:
    rng = np.random.default_rng(5)
    noise = rng.normal(0.0, 1.0, (2, 400))
    log = log_of(speed_through_water=3.0 + 0.1 * noise[0], yaw_rate=1e-3 * noise[1])
    seen = initial_conditions(log, 300 * SECOND_NS, 390 * SECOND_NS, 64.0)
    # sixteen readings
    assert seen.start_std.forward_m_s == pytest.approx(0.025, rel=0.2)
    assert seen.start_std.yaw_rate_rad_s == pytest.approx(2.5e-4, rel=0.2)
    assert seen.start.forward_m_s == pytest.approx(3.0, abs=0.075)
    off = seen.start.off_by(seen.start_std, np.array([1.0, 1.0, -1.0]))
    assert off.forward_m_s == pytest.approx(seen.start.forward_m_s + seen.start_std.forward_m_s)
    assert off.yaw_rate_rad_s == pytest.approx(seen.start.yaw_rate_rad_s - seen.start_std.yaw_rate_rad_s)
    assert (off.lateral_m_s, off.rudder_rad) == (None, None)


def test_a_log_without_wind_has_none() -> None:
    seen = initial_conditions(log_of(speed_through_water=np.full(200, 3.0)), 50 * SECOND_NS, 190 * SECOND_NS, 10.0)
    assert seen.wind_m_s == 0.0
    assert seen.air.shape == (0, 3)
    assert seen.counted_from(1.0).air.shape == (0, 3)
