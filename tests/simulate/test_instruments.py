"""The instruments: when they measure, what they see, how noisy they are."""

from __future__ import annotations

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS, Instrument
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest
from kempf.pipeline.simulate.trial import Trial, TrialSettings, simulate_trial, zigzag_settings
from kempf.schemas.channels import CHANNEL_COLUMNS
from kempf.schemas.errors import UsageError

WEATHER = Environment(
    Disturbance(5e-3, 1e-3), Disturbance(0.2, 0.05), Disturbance(-0.1), Disturbance(0.15, 0.05), Disturbance(7.0)
)
SETTINGS = TrialSettings(
    HULLS["ferry"],
    (SteadyCourse(60.0), ZigzagTest(duration_s=240.0)),
    WEATHER,
    (*DEFAULT_INSTRUMENTS, Instrument("rudder_order", 2.0, 0.3)),
    seed=5,
    noise_scale=0.0,
    heading_deg=340.0,
)


@pytest.fixture(scope="module")
def clean() -> Trial:
    return simulate_trial(SETTINGS)


def truth_at(trial: Trial, name: str, column: str) -> np.ndarray:
    seconds = (trial.record(name).measured_utc_ns - trial.settings.start_utc_ns) / 1e9
    sample = trial.truth.trajectory.at(seconds)
    index = {"v": 0, "r": 1, "psi": 2, "north": 3, "east": 4, "V": 5}
    return sample.rudder if column == "rudder" else sample.state[:, index[column]]


def test_without_noise_every_value_is_the_truth_at_its_instant(clean: Trial) -> None:
    def value(name: str, column: str) -> np.ndarray:
        return clean.record(name).values[column]

    np.testing.assert_allclose(value("yaw_rate", "yaw_rate_rad_s"), truth_at(clean, "yaw_rate", "r"), atol=1e-9)
    np.testing.assert_allclose(value("rudder", "rudder_angle_rad"), truth_at(clean, "rudder", "rudder"), atol=1e-9)
    np.testing.assert_allclose(value("log", "speed_through_water_m_s"), truth_at(clean, "log", "V"), atol=1e-9)
    np.testing.assert_allclose(value("heading", "heading_rad"), truth_at(clean, "heading", "psi") % (2 * pi), atol=1e-9)


def test_gnss_obeys_equations_18_and_19(clean: Trial) -> None:
    gnss = clean.record("gnss")
    sample = clean.truth.trajectory.at((gnss.measured_utc_ns - SETTINGS.start_utc_ns) / 1e9)
    v, psi = sample.state[:, 0], sample.state[:, 2]
    y_v = gnss.values["speed_over_ground_m_s"] * np.sin(gnss.values["course_over_ground_rad"] - psi)
    _, current_north, current_east, lateral = sample.forcing.T
    expected = v + lateral - current_north * np.sin(psi) + current_east * np.cos(psi)
    np.testing.assert_allclose(y_v, expected, atol=1e-9)


def test_positions_are_the_integral_of_the_velocities(clean: Trial) -> None:
    gnss = clean.record("gnss")
    path = clean.truth.trajectory
    course, speed = gnss.values["course_over_ground_rad"], gnss.values["speed_over_ground_m_s"]
    instants = (gnss.measured_utc_ns - SETTINGS.start_utc_ns) / 1e9
    step = 0.01
    ahead, behind = path.at(instants[1:-1] + step), path.at(instants[1:-1] - step)
    north = (ahead.state[:, 3] - behind.state[:, 3]) / (2 * step)
    np.testing.assert_allclose(north, (speed * np.cos(course))[1:-1], atol=1e-5)
    # a minute of latitude is a nautical mile, within the ellipsoid's half per cent
    miles = np.rad2deg(gnss.values["latitude_rad"] - radians(59.9)) * 60.0
    np.testing.assert_allclose(miles * 1852.0, path.at(instants).state[:, 3], rtol=5e-3, atol=0.1)


def test_the_antenna_adds_the_turn_of_its_arm() -> None:
    ahead = simulate_trial(replace(SETTINGS, antenna_forward_m=40.0))
    middle = simulate_trial(SETTINGS)

    def lateral(trial: Trial) -> np.ndarray:
        values = trial.record("gnss").values
        angle = values["course_over_ground_rad"] - truth_at(trial, "gnss", "psi")
        return np.asarray(values["speed_over_ground_m_s"] * np.sin(angle))

    np.testing.assert_allclose(lateral(ahead) - lateral(middle), 40.0 * truth_at(middle, "gnss", "r"), atol=1e-9)


def test_the_relative_wind_and_the_ships_way_give_the_true_wind(clean: Trial) -> None:
    wind = clean.record("wind")
    sample = clean.truth.trajectory.at((wind.measured_utc_ns - SETTINGS.start_utc_ns) / 1e9)
    direction = wind.values["wind_angle_rad"] + sample.state[:, 2]
    north, east = sample.ground_velocity()
    speed = wind.values["wind_speed_m_s"]
    true_north, true_east = speed * np.cos(direction) - north, speed * np.sin(direction) - east
    np.testing.assert_allclose(np.hypot(true_north, true_east), 7.0, atol=1e-9)
    np.testing.assert_allclose(np.arctan2(true_east, true_north) % (2 * pi), WEATHER.wind_from_rad, atol=1e-9)


def test_clocks_keep_rate_phase_jitter_and_latency(clean: Trial) -> None:
    for record in clean.instruments:
        instrument = record.instrument
        seconds = (record.measured_utc_ns - SETTINGS.start_utc_ns) / 1e9
        ticks = instrument.phase_s + np.arange(seconds.size) / instrument.rate_hz
        assert np.max(np.abs(seconds - ticks)) <= instrument.jitter_s + 1e-9
        assert abs(seconds.size - 300.0 * instrument.rate_hz) <= 1
        assert np.all(np.diff(record.measured_utc_ns) > 0)
        delay = (record.arrival_utc_ns - record.measured_utc_ns) / 1e9
        assert np.all(delay >= 0)
        assert delay.mean() == pytest.approx(instrument.latency_s, abs=5 * instrument.latency_jitter_s / 17)
        assert set(record.values) <= set(CHANNEL_COLUMNS)
        assert all(v.shape == seconds.shape for v in record.values.values())


@pytest.mark.parametrize("scale", [1.0, 0.1])
def test_noise_has_its_standard_deviation(scale: float) -> None:
    settings = zigzag_settings("mariner", duration_s=3000.0, noise_scale=scale, seed=9)
    noisy, clean = simulate_trial(settings), simulate_trial(replace(settings, noise_scale=0.0))
    for name, column, std in (
        ("yaw_rate", "yaw_rate_rad_s", radians(0.03)),
        ("heading", "heading_rad", radians(0.05)),
        ("rudder", "rudder_angle_rad", radians(0.1)),
        ("log", "speed_through_water_m_s", 0.05),
    ):
        error = noisy.record(name).values[column] - clean.record(name).values[column]
        error = (error + pi) % (2 * pi) - pi if column == "heading_rad" else error
        assert error.std() == pytest.approx(scale * std, rel=0.06)
        assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.08, "white"
    a, b = noisy.record("gnss").values, clean.record("gnss").values
    for function in (np.cos, np.sin):
        error = a["speed_over_ground_m_s"] * function(a["course_over_ground_rad"]) - b[
            "speed_over_ground_m_s"
        ] * function(b["course_over_ground_rad"])
        assert error.std() == pytest.approx(scale * 0.05, rel=0.06), "the same in both directions"


def test_one_more_instrument_leaves_the_others_alone() -> None:
    few = simulate_trial(replace(SETTINGS, instruments=DEFAULT_INSTRUMENTS[:2], noise_scale=1.0))
    many = simulate_trial(replace(SETTINGS, noise_scale=1.0))
    for record in few.instruments:
        other = many.record(record.instrument.name)
        np.testing.assert_array_equal(record.arrival_utc_ns, other.arrival_utc_ns)
        for column, values in record.values.items():
            np.testing.assert_array_equal(values, other.values[column])


def test_the_standard_trial_is_the_papers() -> None:
    settings = zigzag_settings(seed=1)
    rates = {i.name: i.rate_hz for i in settings.instruments}
    assert rates["gnss"] == rates["yaw_rate"] == 1.0
    assert settings.environment.wind_force.mean == 5e-3
    stream = np.hypot(settings.environment.current_north.mean, settings.environment.current_east.mean)
    assert stream == pytest.approx(0.3, rel=1e-3)
    zigzag = settings.programme[1]
    assert isinstance(zigzag, ZigzagTest)
    assert (zigzag.heading_deg, zigzag.rudder_deg, zigzag.duration_s) == (20.0, 20.0, 1200.0)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"instruments": (Instrument("sextant", 1.0),)}, "instrument_unknown"),
        ({"instruments": (Instrument("log", 1.0, noise={"velocity": 1.0}),)}, "instrument_noise_unknown"),
        ({"instruments": (Instrument("log", 0.0),)}, "instrument_clock"),
        ({"instruments": (Instrument("log", 1.0, jitter_s=0.5),)}, "instrument_clock"),
        ({"instruments": (Instrument("log", 1.0), Instrument("log", 2.0))}, "instrument_twice"),
        ({"seed": -1}, "trial_settings"),
        ({"substeps": 0}, "trial_settings"),
        ({"noise_scale": -1.0}, "trial_settings"),
    ],
)
def test_impossible_settings_are_refused(change: dict[str, object], code: str) -> None:
    with pytest.raises(UsageError) as caught:
        simulate_trial(replace(SETTINGS, **change))  # type: ignore[arg-type]
    assert caught.value.code == code


def test_unknown_names_are_reported(clean: Trial) -> None:
    with pytest.raises(UsageError, match="sextant"):
        clean.record("sextant")
    with pytest.raises(UsageError, match="raft"):
        zigzag_settings("raft")
