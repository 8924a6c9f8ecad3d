"""Gross errors are taken out, honest noise is not, and a wrong model is not hidden by calling its misfit errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate import maximum_likelihood as ml
from kempf.pipeline.estimate.gating import gate
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed

SETTINGS = ml.MaximumLikelihoodSettings()


@pytest.fixture(scope="module")
def clean() -> tuple[Record, float]:
    trial = sailed(seed=5, duration_s=600.0)
    return record_of(trial), trial.truth.wind_arm_per_m


def test_honest_noise_passes_the_gate(clean: tuple[Record, float]) -> None:
    record, arm = clean
    assert ml.identify(record, ModelSpec(), arm, SETTINGS).report["gross_errors"] == {}


def test_gross_errors_do_not_bend_the_estimate(clean: tuple[Record, float]) -> None:
    record, arm = clean
    plain = ml.identify(record, ModelSpec(), arm, SETTINGS)
    measured = record.measured.copy()
    rows = np.flatnonzero(np.isfinite(measured[:, 0]))[7::29]
    jumps = np.where(np.arange(rows.size) % 2, 2.5, -4.5)
    measured[rows, 0] += jumps
    bent = ml.identify(replace(record, measured=measured), ModelSpec(), arm, SETTINGS)
    assert bent.report["gross_errors"] == {"lateral_speed": rows.size}
    assert any("gross errors of lateral_speed" in warning for warning in bent.warnings)
    for one, other in zip(plain.parameters, bent.parameters, strict=True):
        assert abs(one.value - other.value) < 0.7 * one.std, one.name
    without = ml.identify(replace(record, measured=measured), ModelSpec(), arm, replace(SETTINGS, gate_rounds=0))
    worst = max(abs(a.value - b.value) / a.std for a, b in zip(plain.parameters, without.parameters, strict=True))
    assert worst > 0.7, "the jumps would not have mattered: this test shows nothing"


def test_a_tenth_outside_is_the_model_not_the_measurements(clean: tuple[Record, float]) -> None:
    record, _ = clean
    innovation, variance = np.full_like(record.measured, np.nan), np.ones_like(record.measured)
    rows = np.flatnonzero(np.isfinite(record.measured[:, 1]))
    innovation[rows, 1] = np.random.default_rng(0).standard_normal(rows.size)
    innovation[rows[::8], 1] = 40.0
    found = gate(record, innovation, variance, 5.0, 0.1)
    assert found.taken_out == {}
    assert found.heavy == ("yaw_rate",)
    np.testing.assert_array_equal(found.record.measured, record.measured)
