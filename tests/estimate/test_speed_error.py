"""What the speed's error does, against the simulator's own state."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.record.speed_error import rudder_of_speed_error
from kempf.schemas.units import SECOND_NS
from tests.estimate.simulated import record_of, sailed, truth_of


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("hull", ["mariner", "ferry", "container"])
def test_it_is_what_the_yaw_equation_loses_with_the_speed(hull: str) -> None:
    trial = sailed(hull, seed=3)
    record = record_of(trial)
    _, _, a21, a22, _, b2 = truth_of(trial)
    since = (record.start_utc_ns - trial.settings.start_utc_ns) / SECOND_NS
    v, r = trial.truth.trajectory.at(record.time_s + since).state[:, :2].T
    # the derivative of a21 V v + a22 V r + b2 V^2 delta with respect to V, over b2 V
    expected = 2.0 * record.rudder_rad + (a21 * v + a22 * r) / (b2 * record.speed_m_s)
    instants = record.start_utc_ns + np.round(record.time_s * SECOND_NS).astype(np.int64)
    heading = np.isfinite(record.measured[:, 2])
    found = rudder_of_speed_error(
        Series(instants[heading], record.measured[heading, 2]),
        Series(instants, record.rudder_rad),
        instants,
        record.rudder_rad,
    )
    assert rms(found) == pytest.approx(rms(expected), rel=0.3)
    assert np.corrcoef(found, expected)[0, 1] > 0.95
    # neither that of steady turns nor that of a rudder alone is as near
    assert rms(found - expected) < min(rms(k * record.rudder_rad - expected) for k in (1.0, 2.0))


def test_where_the_turn_is_steady_it_is_the_rudder_itself() -> None:
    # a ship that answers at once: r = K delta
    time = np.arange(0, 400, dtype=np.int64) * SECOND_NS
    delta = 0.3 * np.sign(np.sin(np.arange(400) / 12.0))
    heading = np.concatenate([[0.0], np.cumsum(0.02 * 0.5 * (delta[1:] + delta[:-1]))])
    found = rudder_of_speed_error(Series(time, heading), Series(time, delta), time, delta)
    inside = np.abs(np.convolve(delta, np.ones(9), "same")) > 2.6
    np.testing.assert_allclose(found[inside], delta[inside], rtol=0.05)


def test_without_enough_of_a_heading_a_steady_turn_is_assumed() -> None:
    time = np.arange(0, 100, dtype=np.int64) * SECOND_NS
    delta = np.sin(np.arange(100) / 5.0)
    few = Series(time[:5], np.zeros(5))
    assert rudder_of_speed_error(few, Series(time, delta), time, delta) is delta
    still = Series(time, np.zeros(100))
    assert np.all(np.isfinite(rudder_of_speed_error(still, Series(time, delta), time, delta)))
