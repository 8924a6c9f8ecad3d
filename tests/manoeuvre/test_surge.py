"""The speed's equation, the rudder's rate and what is covered, read off simulated logs."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.grid_run import GridRun, plain_run
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings
from kempf.pipeline.manoeuvre.covered import beyond, covered
from kempf.pipeline.manoeuvre.rudder_rate import SOLAS_RAD_S, rudder_rate
from kempf.pipeline.manoeuvre.sailed import Reach
from kempf.pipeline.manoeuvre.surge.identify import surge_of
from kempf.pipeline.simulate.hulls import HULLS
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.symbols import CHANNEL_SYMBOLS
from tests.estimate.simulated import bounds, instruments_of, sailed

LENGTH = HULLS["mariner"].length_m


def record_of(**changes: float) -> Record:
    trial = sailed("mariner", duration_s=700.0, seed=3, **changes)  # type: ignore[arg-type]
    return make_record(instruments_of(trial), *bounds(trial))


def run_of(record: Record) -> GridRun:
    return plain_run("run", record, ModelSpec(), 0.0, LENGTH)


@pytest.mark.parametrize("loss", [0.3, 0.8])
def test_time_and_loss_are_those_of_the_simulator(loss: float) -> None:
    fit = surge_of([run_of(record_of(speed_loss=loss))], LENGTH)
    assert not fit.remarks
    tau, by_drift, by_rate, by_rudder, by_wind = fit.best
    assert by_drift == by_wind == 0.0
    assert by_rudder < 0.2
    assert abs(by_rate - loss) < 3.0 * fit.std[2] < 0.3 * loss
    assert abs(tau - 6.0) < 3.0 * fit.std[0] < 3.0


def test_a_ship_that_loses_nothing_is_seen_to() -> None:
    fit = surge_of([run_of(record_of(speed_loss=0.0))], LENGTH)
    assert max(fit.best[1] * 0.03, fit.best[2]) < 0.03


def losing(run: GridRun, tau: float, losses: Float, settled: float = 8.4, begin: float = 5.0) -> GridRun:
    """A run whose speed goes by the equation along the motion that was measured, by Euler's rule, in still air."""
    speed = [begin]
    for k in range(run.speed_m_s.size - 1):
        kept = settled * (1.0 - losses[k])
        speed.append(speed[-1] + run.step_s * (kept - speed[-1]) * settled / (tau * LENGTH))
    inputs = run.inputs.copy()
    inputs[:, 0] = np.interp(run.fine_time_s, run.time_s, speed)
    inputs[:, 2 + list(CHANNEL_SYMBOLS.values()).index("shaft_speed")] = 2.0
    readings = SpeedReadings(run.time_s, np.array(speed))
    changed = {"approach_m_s": begin, "approach_per_s": 2.0 * begin / settled, "speed_readings": readings}
    return replace(run, inputs=inputs, channels=run.channels | {"shaft_speed"}, **changed)  # type: ignore[arg-type]


def turning(run: GridRun, settled: float = 8.4) -> tuple[Float, Float]:
    """Return -L v r / V_s^2 and (L r / V_s)^2 of a run."""
    v, r = np.nan_to_num(run.measured[:, 0]), np.nan_to_num(run.measured[:, 1])
    return -LENGTH * np.minimum(v * r, 0.0) / settled**2, (LENGTH * r / settled) ** 2


def test_a_loss_by_drift_and_turn_is_seen_to_be_one_whatever_the_shaft_keeps() -> None:
    run = run_of(record_of(speed_loss=0.3))
    tau, by_drift = 7.0, 9.0
    run = losing(run, tau, by_drift * turning(run)[0])
    fit = surge_of([run], LENGTH)
    assert run.settled_m_s == pytest.approx(8.4)
    assert fit.best[1] == pytest.approx(by_drift, rel=0.15)
    # what the yaw rate has beside it, the data put near nothing
    assert abs(fit.best[2]) < 2.0 * max(fit.std[2], 0.1)
    assert fit.best[0] == pytest.approx(tau, rel=0.15)
    assert fit.settled[0] == pytest.approx(1.0, abs=0.02)


def test_what_the_yaw_rate_gives_beside_the_drift_is_seen_and_may_push_her_on() -> None:
    run = run_of(record_of(speed_loss=0.3))
    measured = run.measured.copy()
    # drift that does not go with the turn: else one of the two says as much as both
    measured[:, 0] = -LENGTH * measured[:, 1] * (0.3 + 0.2 * np.sin(run.time_s / 40.0))
    run = replace(run, measured=measured)
    drift, rate = turning(run)
    fit = surge_of([losing(run, 7.0, 12.0 * drift - 1.5 * rate, begin=8.4)], LENGTH)
    assert fit.best[2] < -0.5
    cost = fit.best[1] * drift + fit.best[2] * rate
    np.testing.assert_allclose(cost.max(), (12.0 * drift - 1.5 * rate).max(), rtol=0.15)
    drawn = fit.drawn(np.random.default_rng(0).standard_normal((500, 5)))
    assert np.mean(drawn[:, 2] < 0.0) > 0.8


def test_what_a_head_wind_costs_is_seen_and_calm_air_costs_nothing() -> None:
    run = run_of(record_of(speed_loss=0.3))
    t, names = run.time_s, list(CHANNEL_SYMBOLS.values())
    inputs = run.inputs.copy()
    ahead = 12.0 * np.cos(2.0 * np.pi * run.fine_time_s / 300.0)
    inputs[:, 2 + names.index("wind_speed")] = np.abs(ahead)
    inputs[:, 2 + names.index("wind_angle")] = np.where(ahead < 0.0, np.pi, 0.0)
    windy = replace(run, inputs=inputs, channels=run.channels | {"wind_speed", "wind_angle"})
    own = 12.0 * np.cos(2.0 * np.pi * t / 300.0)
    # W: the wind over the deck from ahead, less that of her own way
    way = 8.0
    losses = 0.3 * turning(run)[1] * 2.0 + 0.04 * (own * np.abs(own) - way**2) / 8.4**2
    fit = surge_of([losing(windy, 7.0, losses)], LENGTH)
    assert fit.best[4] == pytest.approx(0.04, rel=0.25)
    assert surge_of([losing(run, 7.0, losses)], LENGTH).best[4] == 0.0


@pytest.mark.parametrize("by_time", [False, True])
def test_logs_of_two_shaft_speeds_say_whether_she_finds_her_speed_in_a_way_or_a_time(by_time: bool) -> None:
    run, tau, slow = run_of(record_of(speed_loss=0.3)), 7.0, 6.0
    runs = [
        losing(run, tau, 0.8 * turning(run)[1], begin=8.4),
        losing(run, tau * slow / 8.4 if by_time else tau, 0.8 * turning(run, slow)[1], settled=slow, begin=slow),
    ]
    fit = surge_of(runs, LENGTH)
    assert float(fit.probability @ fit.by_time) == pytest.approx(float(by_time), abs=0.01)
    for settled in (8.4, slow):
        own = fit.at(settled)
        wanted = tau * settled / 8.4 if by_time else tau
        assert own.best[0] == pytest.approx(wanted, rel=0.1)
        assert own.sure.best[0] == own.best[0]
        drawn = own.drawn(np.random.default_rng(0).standard_normal((200, 5)))
        assert np.median(drawn[:, 0]) == pytest.approx(wanted, rel=0.1)
    assert not surge_of(runs[:1], LENGTH).by_time.any()


def test_without_turns_the_loss_is_a_guess_and_said_to_be() -> None:
    run = run_of(record_of(speed_loss=0.3))
    measured = run.measured.copy()
    measured[:, 1] = 0.0
    inputs = run.inputs.copy()
    inputs[:, 0] = 7.7
    steady = SpeedReadings(run.time_s, np.full(run.time_s.size, 7.7))
    fit = surge_of([replace(run, measured=measured, inputs=inputs, speed_readings=steady)], LENGTH)
    assert fit.std[2] > 1.0
    assert "usual ships" in fit.remarks[0]
    none = surge_of([replace(run, measured=np.full_like(measured, np.nan))], LENGTH)
    assert "guess" in none.remarks[0]


def test_draws_spread_as_the_posterior_says_and_lose_no_negative_speed() -> None:
    fit = surge_of([run_of(record_of(speed_loss=0.3))], LENGTH)
    drawn = fit.drawn(np.random.default_rng(0).standard_normal((4000, 5)))
    np.testing.assert_allclose(drawn.std(axis=0), fit.std, rtol=0.2, atol=0.02)
    assert np.all(drawn >= 0.0)


def test_the_rudder_s_rate_is_that_of_the_helm() -> None:
    seen = rudder_rate([record_of()])
    assert seen.executes >= 3
    assert seen.rad_s == pytest.approx(HULLS["mariner"].rudder_rate_rad_s, rel=0.05)
    assert seen.remark == ""


def test_readings_too_sparse_to_show_a_rate_give_that_of_solas() -> None:
    record = record_of()
    coarse = replace(record, rudder_period_s=30.0)
    taken = rudder_rate([coarse])
    assert taken.executes == 0
    assert taken.rad_s >= SOLAS_RAD_S
    assert "do not show how fast" in taken.remark
    still = replace(record, rudder_rad=np.zeros_like(record.rudder_rad))
    assert rudder_rate([still]).rad_s == SOLAS_RAD_S


def test_what_lies_beyond_the_logs_is_named_with_both_ranges() -> None:
    logs = covered([run_of(record_of())], LENGTH)
    assert logs.rudder_rad == pytest.approx(radians(20.0), rel=0.02)
    assert 0.1 < logs.drift_rad < 0.3
    assert beyond(logs, logs) == ()
    wider = Reach(2.0 * logs.drift_rad, logs.yaw_rate, radians(35.0), 0.5 * logs.slowest_m_s, logs.fastest_m_s)
    found = {one.quantity: one for one in beyond(wider, logs)}
    assert set(found) == {"drift", "rudder", "speed"}
    assert found["rudder"].predicted[1] == pytest.approx(35.0)
    assert found["rudder"].covered[1] == pytest.approx(20.0, rel=0.02)
    assert "rudder up to 35 deg, the logs cover 20" in found["rudder"].sentence
    unknown = replace(logs, drift_rad=float("nan"))
    assert [one.quantity for one in beyond(logs, unknown)] == ["drift"]
