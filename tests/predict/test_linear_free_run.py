"""The free run against an independent integration and against the truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.identify.linear_free_run import free_run
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.disturbances import Environment
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed, truth_of


def test_it_is_the_differential_equation_integrated() -> None:
    record = record_of(sailed("ferry", seed=3, duration_s=300.0))
    hull = Hull(*truth_of(sailed("ferry", seed=3, duration_s=300.0)))
    for power in (2.0, 1.0):
        found = free_run(record, hull, ModelSpec(rudder_speed_exponent=power))
        approach = float(np.median(record.speed_m_s[record.time_s <= 5.0]))

        def slope(t: float, x: np.ndarray, power: float = power, approach: float = approach) -> list[float]:
            k = int(np.clip(np.searchsorted(record.time_s, t, side="right"), 1, record.time_s.size - 1))
            V = 0.5 * (record.speed_m_s[k] + record.speed_m_s[k - 1])
            inflow = (record.speed_m_s / approach) ** (power - 2.0) * record.rudder_rad
            delta = np.interp(t, record.time_s, inflow)
            v, r, _ = x
            return [
                V * (hull.a11 * v + hull.a12 * r) + hull.b1 * V**2 * delta,
                V * (hull.a21 * v + hull.a22 * r) + hull.b2 * V**2 * delta,
                r,
            ]

        exact = solve_ivp(
            slope, (0.0, record.time_s[-1]), found.predicted[0], t_eval=record.time_s[::50], max_step=0.1, rtol=1e-9
        )
        np.testing.assert_allclose(found.predicted[::50], exact.y.T, atol=4e-5)


def test_in_still_water_the_true_ship_leaves_only_noise() -> None:
    trial = sailed("ferry", seed=3, environment=Environment(), duration_s=300.0)
    record = record_of(trial)
    found = free_run(record, Hull(*truth_of(trial)), ModelSpec())
    assert found.rms["yaw_rate"] == pytest.approx(np.deg2rad(0.03), rel=0.15)
    assert found.rms["lateral_speed"] < 0.06
    assert found.fit_percent["yaw_rate"] > 95.0
    slow = replace(Hull(*truth_of(trial)), b2=0.8 * trial.truth.parameters.b2)
    assert free_run(record, slow, ModelSpec()).rms["yaw_rate"] > 5.0 * found.rms["yaw_rate"]


def test_a_measurement_that_is_not_there_has_no_error() -> None:
    trial = sailed("ferry", seed=3, environment=Environment(), duration_s=300.0)
    found = free_run(record_of(trial, "yaw_rate"), Hull(*truth_of(trial)), ModelSpec())
    assert set(found.rms) == {"lateral_speed", "heading"}
