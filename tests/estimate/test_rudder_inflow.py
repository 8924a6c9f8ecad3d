"""A rudder in the propeller's race."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed


def test_the_force_goes_with_the_power_asked_for_and_is_that_of_the_model_at_the_approach() -> None:
    record = record_of(sailed("mariner", seed=1))
    assert with_rudder_inflow(record, ModelSpec()) is record
    approach = float(np.median(record.speed_m_s[record.time_s <= 5.0]))
    for power in (0.0, 1.0, 1.5):
        found = with_rudder_inflow(record, ModelSpec(rudder_speed_exponent=power))
        force = record.speed_m_s**2 * found.rudder_rad
        expected = record.speed_m_s**power * approach ** (2.0 - power) * record.rudder_rad
        np.testing.assert_allclose(force, expected, rtol=1e-12)
        assert found.rudder_noise_rad_sqrt_s[0] == pytest.approx(record.rudder_noise_rad_sqrt_s[0], rel=0.02)


def test_a_ship_that_nearly_stops_keeps_a_finite_rudder() -> None:
    record = record_of(sailed("mariner", seed=1))
    speed = record.speed_m_s.copy()
    speed[-5:] = 1e-6
    found = with_rudder_inflow(replace(record, speed_m_s=speed), ModelSpec(rudder_speed_exponent=0.0))
    assert np.max(np.abs(found.rudder_rad)) < 101.0 * np.max(np.abs(record.rudder_rad))
