"""What an effect is given of wind, revolutions and depth: the signal, not the noise of the instrument."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.signal import signal
from kempf.pipeline.estimate.record import heel
from kempf.pipeline.estimate.record.conditions import conditions
from kempf.pipeline.estimate.record.grid_run import ShipConstants, make_run, plain_run
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS
from tests.estimate.simulated import bounds, changed, instruments_of, record_of, sailed, without


def relative_wind(time_s: Float, noise: float = 0.0) -> tuple[Float, Float]:
    """Speed and angle on a ship in a zigzag, 10 m/s from 30 degrees with gusts, of her own way seen from the bow."""
    sample = sailed("ferry").truth.trajectory.at(time_s)
    heading, ahead = sample.state[:, 2], sample.state[:, 5]
    true = 10.0 + np.sin(2.0 * np.pi * time_s / 90.0)
    north, east = true * np.cos(0.5) + ahead * np.cos(heading), true * np.sin(0.5) + ahead * np.sin(heading)
    random = np.random.default_rng(2)
    speed = np.hypot(north, east) + noise * random.standard_normal(time_s.size)
    return speed, np.unwrap(np.arctan2(east, north) - heading) + 0.05 * noise * random.standard_normal(time_s.size)


def logged(noise: float, period_s: float = 2.0) -> Instruments:
    """The log of the zigzag with this wind."""
    trial = sailed("ferry")
    time = np.arange(0.3, trial.truth.trajectory.duration_s - 1.0, period_s)
    made = instruments_of(trial)
    for name, value in zip(("wind_speed", "wind_angle"), relative_wind(time, noise), strict=True):
        instants = trial.settings.start_utc_ns + (time * SECOND_NS).astype(np.int64)
        made = changed(made, name, Series(instants, value))
    return made


def laid(instruments: Instruments) -> tuple[dict[str, Float], frozenset[str], Float]:
    """Its conditions, and the instants of these in the trial, s."""
    trial, record = sailed("ferry"), record_of(sailed("ferry"))
    fine = np.arange(0.0, record.time_s[-1], 0.25)
    return *conditions(instruments, record, fine), fine + (record.start_utc_ns - trial.settings.start_utc_ns) * 1e-9


def test_between_two_readings_the_wind_turns_with_the_ship() -> None:
    columns, channels, time = laid(logged(0.0, period_s=10.0))
    speed, angle = relative_wind(time)
    assert {"wind_speed", "wind_angle"} <= channels
    off = np.angle(np.exp(1j * (columns["gamma"] - angle)))
    assert np.std(off) < np.deg2rad(0.6)
    assert np.std(columns["U"] - speed) < 0.06


def test_most_of_the_noise_of_the_anemometer_goes() -> None:
    columns, _, time = laid(logged(1.0))
    speed, angle = relative_wind(time)
    assert np.std(columns["U"] - speed) < 0.45
    assert np.std(np.angle(np.exp(1j * (columns["gamma"] - angle)))) < 0.04
    force, true = columns["U"] ** 2 * np.sin(columns["gamma"]), speed**2 * np.sin(angle)
    about = force - force.mean()
    assert about @ (true - true.mean()) / (about @ about) == pytest.approx(1.0, abs=0.1)


def heeled(time_s: Float) -> tuple[Instruments, Float, Float]:
    """The log of a ship who rolls with a period of 6 s as she turns, her roll and readings of it, at 2 Hz from 0.1 s.

    Her roll is integrated by steps of 0.01 s, by nothing that the estimator uses.
    """
    trial = sailed("ferry")
    fine = np.arange(0.0, trial.truth.trajectory.duration_s - 1.0, 0.01)
    state = trial.truth.trajectory.at(fine).state
    push, w = 0.02 * state[:, 5] * state[:, 1], 2.0 * np.pi / 6.0
    angle, rate, angles = 0.0, 0.0, np.empty(fine.size)
    for k in range(fine.size):
        rate += 0.01 * (-0.3 * w * rate - w * w * (angle + push[k]))
        angle += 0.01 * rate
        angles[k] = angle
    read = fine[10::50]
    true = angles[10::50]
    noisy = true + 0.3 * np.std(true) * np.random.default_rng(4).standard_normal(true.size)
    roll = Series(trial.settings.start_utc_ns + np.round(read * SECOND_NS).astype(np.int64), noisy)
    wandering = np.interp(time_s, read, signal(roll).series.value)
    return changed(instruments_of(trial), "roll", roll), np.interp(time_s, fine, angles), wandering


@pytest.mark.parametrize(("yaw_rate", "chosen_by"), [(True, 4000), (False, 4000), (True, 500)])
def test_the_heel_of_a_turn_is_what_the_turn_lets_expect(
    yaw_rate: bool, chosen_by: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(heel, "_MOST", chosen_by)
    trial = sailed("ferry")
    record = record_of(trial) if yaw_rate else record_of(trial, "yaw_rate")
    fine = np.arange(0.0, record.time_s[-1], 0.25)
    log, true, wandering = heeled(fine + (record.start_utc_ns - trial.settings.start_utc_ns) * 1e-9)
    columns, channels = conditions(log, record, fine)
    assert "roll" in channels
    assert np.std(columns["phi"] - true) < 0.5 * np.std(wandering - true)
    about = columns["phi"] - columns["phi"].mean()
    assert about @ (true - true.mean()) / (about @ about) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("step_s", "within"), [(0.05, 2e-6), (0.01, 2e-6), (heel._FINEST_S, 1e-4)])
@pytest.mark.parametrize("period_s", [0.5, 6.0, 40.0])
@pytest.mark.parametrize("damping", [0.05, 0.4])
def test_an_oscillator_is_that_of_scipy(period_s: float, damping: float, step_s: float, within: float) -> None:
    w = 2.0 * np.pi / period_s
    above, below, _ = cont2discrete(([w * w], [1.0, 2.0 * damping * w, w * w]), step_s, method="foh")
    found = heel.oscillator(period_s, damping, step_s)
    np.testing.assert_allclose(found[0], above.ravel(), rtol=within)
    np.testing.assert_allclose(found[1], below, rtol=1e-12)


def test_a_channel_that_ends_within_the_manoeuvre_is_none() -> None:
    start, end = bounds(sailed("ferry"))
    whole = logged(0.0)
    short = whole
    for name in ("wind_speed", "wind_angle"):
        short = changed(short, name, whole.series[name].between(start, (start + end) // 2))
    columns, channels, _ = laid(short)
    assert not {"U", "gamma"} & set(columns) and not {"wind_speed", "wind_angle"} & channels
    assert "shaft_speed" in channels and "n" in columns
    alone, channels, _ = laid(without(whole, "wind_angle"))
    assert "U" in alone and "gamma" not in alone and "wind_speed" in channels


def test_a_run_knows_what_the_rudder_did_before_it() -> None:
    trial, record = sailed("ferry", noise_scale=3.0), record_of(sailed("ferry", noise_scale=3.0))
    ship, spec = ShipConstants(100.0, 5.0, 0.0), ModelSpec()
    run = make_run("run", record, instruments_of(trial), spec, ship, step_s=2.0)
    step = run.fine_time_s[1]
    start_s = (record.start_utc_ns - trial.settings.start_utc_ns) * 1e-9
    line, before = run.rudder_line, run.rudder_line.time_s < 0.0
    back = start_s + line.time_s[before]
    # the log begins with the first reading of the rudder
    assert 0.0 < back[0] < 2.0 and np.count_nonzero(before) < run.inputs.shape[0]
    np.testing.assert_allclose(np.diff(back), step)
    true = trial.truth.trajectory.at(back).rudder
    assert np.std(line.angle_rad[before] - true) < 0.5 * np.deg2rad(0.3)
    assert plain_run("run", record, spec, 0.0, 100.0).rudder_line.time_s[0] == 0.0
