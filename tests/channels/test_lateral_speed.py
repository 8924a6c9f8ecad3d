"""Eqs. (18) and (19): closed forms, the standard error by Monte Carlo, the noise estimate, the check on the current."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels.lateral_speed import LateralSpeed, check_current, lateral_speed, noise_std
from kempf.pipeline.channels.series import Series
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.schemas.units import SECOND_NS

START = 1_746_252_000_000_000_000


def series(value: np.ndarray, period_s: float = 1.0, phase_s: float = 0.0) -> Series:
    time = START + np.round((np.arange(value.size) * period_s + phase_s) * SECOND_NS).astype(np.int64)
    return Series(time, np.asarray(value, dtype=np.float64))


def compute(speed: Series, course: Series, heading: Series) -> LateralSpeed:
    return lateral_speed(speed, course, heading, speed_std_m_s=0.05, course_std_rad=0.01, heading_std_rad=0.002)


@pytest.mark.parametrize("drift_deg", [0.0, 5.0, -8.0, 90.0, -120.0, 180.0])
@pytest.mark.parametrize("heading_deg", [0.0, 45.0, 359.0])
def test_closed_form(drift_deg: float, heading_deg: float) -> None:
    V, beta = 6.0, np.deg2rad(drift_deg)
    heading = np.full(20, np.deg2rad(heading_deg))
    # the course as the receiver gives it, in [0, 2 pi)
    course = (heading + beta) % (2 * np.pi)
    found = compute(series(np.full(20, V)), series(course), series(heading))
    np.testing.assert_allclose(found.value_m_s, V * np.sin(beta), atol=1e-12)
    np.testing.assert_allclose(found.forward_m_s, V * np.cos(beta), atol=1e-12)
    np.testing.assert_allclose(np.cos(found.drift_rad - beta), 1.0, atol=1e-12)
    assert np.all(np.abs(found.drift_rad) <= np.pi)
    expected = np.hypot(np.sin(beta) * 0.05, V * np.cos(beta) * np.hypot(0.01, 0.002))
    np.testing.assert_allclose(found.std_m_s, expected, rtol=1e-9)


def test_heading_is_taken_at_the_instants_of_the_course() -> None:
    # a turn of 1 deg/s; compass at 5 Hz, out of phase with the GNSS: the drift is exact because the heading is linear
    rate, V, beta = np.deg2rad(1.0), 5.0, np.deg2rad(4.0)
    gnss_s = np.arange(60) + 0.37
    course = series(rate * gnss_s + beta, phase_s=0.37)
    found = compute(series(np.full(60, V), phase_s=0.37), course, series(rate * np.arange(310) * 0.2, 0.2))
    np.testing.assert_allclose(found.value_m_s, V * np.sin(beta), rtol=1e-9)
    np.testing.assert_array_equal(found.time_utc_ns, course.time_utc_ns)


def test_nothing_where_the_heading_has_a_gap() -> None:
    heading = series(np.zeros(60))
    keep = (np.arange(60) < 20) | (np.arange(60) > 40)
    gappy = Series(heading.time_utc_ns[keep], heading.value[keep])
    found = compute(series(np.full(60, 5.0), phase_s=0.5), series(np.zeros(60), phase_s=0.5), gappy)
    seconds = (found.time_utc_ns - START) / SECOND_NS
    in_gap = ((seconds > 19) & (seconds < 41)) | (seconds > 59)
    np.testing.assert_array_equal(np.isnan(found.value_m_s), in_gap)
    np.testing.assert_array_equal(np.isnan(found.std_m_s), in_gap)


@pytest.mark.parametrize("drift_deg", [0.0, 6.0, 45.0])
def test_standard_error_is_the_spread_over_many_draws(drift_deg: float) -> None:
    random, n, V, beta = np.random.default_rng(4), 40_000, 7.0, np.deg2rad(drift_deg)
    std = {"speed_std_m_s": 0.05, "course_std_rad": 0.007, "heading_std_rad": 0.003}
    speed = series(V + std["speed_std_m_s"] * random.standard_normal(n))
    course = series(1.0 + beta + std["course_std_rad"] * random.standard_normal(n))
    heading = series(1.0 + std["heading_std_rad"] * random.standard_normal(n))
    found = lateral_speed(speed, course, heading, **std)
    assert float(np.median(found.std_m_s)) == pytest.approx(float(np.std(found.value_m_s)), rel=0.05)


@pytest.mark.parametrize("kind", ["white", "ramp", "swing", "spikes", "all"])
def test_noise_is_told_from_motion_and_spikes(kind: str) -> None:
    random, n, std = np.random.default_rng(6), 6000, 0.02
    value = std * random.standard_normal(n)
    if kind in {"ramp", "all"}:
        value += 0.3 * np.arange(n)
    if kind in {"swing", "all"}:
        value += 0.3 * np.sin(2 * np.pi * np.arange(n) / 60.0)
    if kind in {"spikes", "all"}:
        value[random.choice(n, 30, replace=False)] += 50.0
    assert noise_std(series(value)) == pytest.approx(std, rel=0.05)


def test_noise_of_almost_nothing_is_unknown_and_of_a_constant_zero() -> None:
    assert np.isnan(noise_std(series(np.zeros(7))))
    assert noise_std(series(np.full(50, 3.0))) == 0.0


def sailed(north: float, east: float, heading_deg: float) -> Trial:
    environment = Environment(current_north=Disturbance(north), current_east=Disturbance(east))
    settings = zigzag_settings("mariner", environment=environment, duration_s=900.0, seed=3)
    return simulate_trial(replace(settings, heading_deg=heading_deg))


def measured(trial: Trial) -> dict[str, Series]:
    """Channels over whole cycles of the zigzag, at their instants of measurement."""
    crossings = trial.truth.zigzags[0].executes_s[1:]
    start = trial.settings.start_utc_ns + round(crossings[0] * SECOND_NS)
    end = trial.settings.start_utc_ns + round(crossings[2 * ((len(crossings) - 1) // 2)] * SECOND_NS)
    found = {}
    for name, column in (
        ("gnss", "speed_over_ground_m_s"),
        ("gnss", "course_over_ground_rad"),
        ("heading", "heading_rad"),
        ("log", "speed_through_water_m_s"),
    ):
        record = trial.record(name)
        value = record.values[column]
        one = Series(record.measured_utc_ns, np.unwrap(value) if column.endswith("_rad") else value)
        found[column] = one.between(start, end)
    return found


@pytest.mark.parametrize(
    ("north", "east", "heading_deg"), [(0.3, 0.0, 0.0), (0.0, -0.4, 10.0), (-0.2, 0.25, 250.0), (0.15, 0.26, 330.0)]
)
def test_the_current_of_a_zigzag_is_found(north: float, east: float, heading_deg: float) -> None:
    trial = sailed(north, east, heading_deg)
    channels = measured(trial)
    heading = channels["heading_rad"]
    base = trial.truth.zigzags[0].base_heading_rad
    base += 2 * np.pi * np.round((np.mean(heading.value) - base) / (2 * np.pi))
    lateral = lateral_speed(
        channels["speed_over_ground_m_s"],
        channels["course_over_ground_rad"],
        heading,
        speed_std_m_s=0.05,
        course_std_rad=0.05 / 7.0,
        heading_std_rad=np.deg2rad(0.05),
    )
    found = check_current(lateral, heading, channels["speed_through_water_m_s"], base)
    speed, direction = np.hypot(north, east), np.arctan2(east, north)
    assert found.current_speed_m_s == pytest.approx(speed, abs=0.05)
    turned = np.angle(np.exp(1j * (found.current_direction_rad - direction)))
    assert abs(turned) < 0.05 / speed
    assert found.constant_m_s == pytest.approx(speed * np.sin(direction - base), abs=0.05)
    # the largest psi of a 20/20 zigzag is 20 deg and the overshoot
    swing = np.deg2rad(20.0) + max(trial.truth.zigzags[0].overshoots_rad)
    assert found.heading_term_m_s == pytest.approx(abs(speed * np.cos(direction - base)) * swing, abs=0.04)
    assert found.heading_term_over_noise == pytest.approx(found.heading_term_m_s / 0.05, rel=0.2)


def test_the_heading_term_vanishes_across_the_stream_and_not_along_it() -> None:
    along, across = sailed(0.3, 0.0, 0.0), sailed(0.3, 0.0, 90.0)
    terms = []
    for trial, base in ((along, 0.0), (across, np.pi / 2)):
        channels = measured(trial)
        heading = channels["heading_rad"]
        shifted = Series(
            heading.time_utc_ns,
            heading.value - 2 * np.pi * np.round((np.mean(heading.value) - base) / (2 * np.pi)),
        )
        lateral = compute(channels["speed_over_ground_m_s"], channels["course_over_ground_rad"], shifted)
        found = check_current(lateral, shifted, channels["speed_through_water_m_s"], base)
        terms.append(found.heading_term_m_s)
    assert terms[0] > 0.1
    assert terms[1] < 0.1 * terms[0]


def test_without_a_log_the_current_is_unknown() -> None:
    lateral = compute(series(np.full(30, 5.0)), series(np.zeros(30)), series(np.zeros(30)))
    found = check_current(lateral, series(np.zeros(30)), None, 0.0)
    assert np.isnan([found.current_speed_m_s, found.constant_m_s, found.heading_term_over_noise]).all()
    # a log that was silent during the segment
    silent = check_current(lateral, series(np.zeros(30)), series(np.full(5, 5.0), phase_s=1e4), 0.0)
    assert np.isnan(silent.current_speed_m_s)
