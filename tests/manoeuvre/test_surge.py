"""The speed's equation, the rudder's rate and what is covered, read off simulated logs."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.grid_run import GridRun, plain_run
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.manoeuvre.covered import beyond, covered
from kempf.pipeline.manoeuvre.rudder_rate import SOLAS_RAD_S, rudder_rate
from kempf.pipeline.manoeuvre.sailed import Reach
from kempf.pipeline.manoeuvre.surge import surge_of
from kempf.pipeline.simulate.hulls import HULLS
from kempf.schemas.model_spec import ModelSpec
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
    assert not fit.by_rudder
    assert not fit.remarks
    tau, by_rate, by_rudder = fit.best
    assert by_rudder == 0.0
    assert abs(by_rate - loss) < 3.0 * fit.std[1] < 0.3 * loss
    assert abs(tau - 6.0) < 3.0 * fit.std[0] < 3.0


def test_a_ship_that_loses_nothing_is_seen_to() -> None:
    assert surge_of([run_of(record_of(speed_loss=0.0))], LENGTH).best[1] < 0.03


def test_without_turns_the_loss_is_a_guess_and_said_to_be() -> None:
    run = run_of(record_of(speed_loss=0.3))
    measured = run.measured.copy()
    measured[:, 1] = 0.0
    inputs = run.inputs.copy()
    inputs[:, 0] = 7.7
    fit = surge_of([replace(run, measured=measured, inputs=inputs)], LENGTH)
    assert fit.std[1] > 1.0
    assert "usual ships" in fit.remarks[0]
    none = surge_of([replace(run, measured=np.full_like(measured, np.nan))], LENGTH)
    assert "guess" in none.remarks[0]


def test_draws_spread_as_the_posterior_says_and_lose_no_negative_speed() -> None:
    fit = surge_of([run_of(record_of(speed_loss=0.3))], LENGTH)
    drawn = fit.drawn(np.random.default_rng(0).standard_normal((4000, 3)))
    np.testing.assert_allclose(drawn.std(axis=0)[:2], fit.std[:2], rtol=0.2)
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
