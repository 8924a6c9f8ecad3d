"""The likelihood against the same state space in statsmodels: another filter, other steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.search.starts import starting_points
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed, truth_of

pytest.importorskip("statsmodels", reason="statsmodels is not installed; it is a development dependency")

LEVELS = np.log([2e-3, np.exp(-400.0), 0.03, 0.05, 5e-4, np.exp(-400.0)])


def kept(record: Record) -> Record:
    """Instants at which lateral speed or yaw rate was measured, some values taken out, no heading measurement."""
    rows = np.isfinite(record.measured[:, :2]).any(axis=1)
    measured = record.measured[rows].copy()
    measured[:, 2] = np.nan
    measured[100:130, 0] = np.nan
    measured[120:140, 1] = np.nan
    names = ("time_s", "speed_m_s", "rudder_rad", "heading_rad", "rudder_noise_rad_sqrt_s")
    error = record.speed_error.at(rows)
    return replace(
        record, measured=measured, speed_error=error, **{name: getattr(record, name)[rows] for name in names}
    )


def test_log_likelihood_is_that_of_statsmodels() -> None:
    from benchmarks.baselines.statsmodels_likelihood import ShipLikelihood

    trial = sailed("mariner", seed=1, duration_s=400.0)
    record, arm = kept(record_of(trial)), trial.truth.wind_arm_per_m
    spec = ModelSpec().with_arm(arm)
    own = MaximumLikelihoodSettings().bind(record, spec, arm)
    truth = np.concatenate([truth_of(trial), LEVELS])
    other = ShipLikelihood(record, spec, arm, np.abs(truth[:6]))
    starts = [theta for name, theta in starting_points(record) if "164.9" in name]
    for theta in (truth, *starts):
        np.testing.assert_allclose(other.ours(other.theirs(theta))[:6], theta[:6], rtol=1e-14)
        assert own.value(other.ours(other.theirs(theta))) == pytest.approx(
            other.loglike(other.theirs(theta)), rel=1e-10
        )
    assert len(starts) == 1
