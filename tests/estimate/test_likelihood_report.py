"""What an estimate says of itself: too short a record, weak directions, disturbances that do not change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.likelihood_report import slowest_s
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.trial import Trial
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import STEADY, bounds, changed, instruments_of, record_of, sailed, truth_of

SETTINGS = MaximumLikelihoodSettings()


def worst(found_hull: np.ndarray, std: np.ndarray, trial: Trial) -> float:
    return float(np.max(np.abs(found_hull - truth_of(trial)) / std))


def test_the_slowest_time_constant_is_that_of_the_matrix() -> None:
    # two eigenvalues chosen, one decaying and one growing, at a speed of 5 m/s
    vectors = np.array([[1.0, 0.5], [-0.02, 0.03]])
    A = vectors @ np.diag([-0.08, 0.01]) @ np.linalg.inv(vectors) / 5.0
    assert slowest_s(np.array([*A.ravel(), 0.0, 0.0]), 5.0) == pytest.approx(100.0)


def test_a_record_of_few_time_constants_is_flagged() -> None:
    trial = sailed("tanker", seed=5)
    found = identify(record_of(trial), ModelSpec(), trial.truth.wind_arm_per_m, SETTINGS)
    own = slowest_s(found.hull.array(), found.report["speed_m_s"])
    short = [w for w in found.warnings if "slowest motion" in w]
    assert bool(short) == (record_of(trial).time_s[-1] < 5.0 * own)
    quick = sailed("ferry", seed=3)
    ferry = identify(record_of(quick), ModelSpec(), quick.truth.wind_arm_per_m, SETTINGS)
    assert not any("slowest motion" in w for w in ferry.warnings)
    cut = sailed("mariner", seed=2, duration_s=240.0)
    hasty = identify(record_of(cut), ModelSpec(), cut.truth.wind_arm_per_m, SETTINGS)
    assert any("slowest motion" in w and "pool several" in w for w in hasty.warnings)


def test_a_stream_that_does_not_change_is_no_fault() -> None:
    trial = sailed("ferry", seed=3, environment=STEADY)
    found = identify(record_of(trial), ModelSpec(), trial.truth.wind_arm_per_m, SETTINGS)
    assert found.converged
    assert found.report["changes"]["sigma_V"]["value"] < 0.01
    assert found.report["changes"]["sigma_V"]["within_s"] == 600.0
    assert not any("at a bound" in warning for warning in found.warnings)
    # how large it could be is said all the same, and holds the truth: nothing
    level = next(one for one in found.noise if one.name == "sigma_V")
    assert 0.0 < level.std < 2.0
    north, east = found.report["at_the_end"]["current_north"], found.report["at_the_end"]["current_east"]
    for one, truth in ((north, 0.15), (east, 0.2598)):
        assert abs(one["value"] - truth) < 4.0 * one["std"]


def test_a_direction_that_is_hardly_determined_says_what_would_help() -> None:
    # one execute and a half, what turns her beside the rudder not known: hardly anything separates sway's parameters
    trial = sailed("mariner", seed=1)
    record = record_of(trial)
    short = record.time_s < 60.0
    rows = ("time_s", "speed_m_s", "rudder_rad", "rudder_noise_rad_sqrt_s", "measured", "heading_rad")
    cut = replace(
        record, speed_error=record.speed_error.at(short), **{name: getattr(record, name)[short] for name in rows}
    )
    found = identify(cut, ModelSpec(moment="gauss-markov"), 0.0, SETTINGS)
    assert found.report["weak_directions"]
    said = [warning for warning in found.warnings if "hardly determine a direction" in warning]
    assert said and all("other angles" in warning and "pool" in warning for warning in said)


def test_a_direction_weak_beside_the_others_but_known_well_is_in_the_report_alone() -> None:
    environment = Environment(wind_force=Disturbance(5e-3))
    trial = sailed("mariner", seed=4, noise_scale=0.1, environment=environment)
    found = identify(record_of(trial), ModelSpec(current="lateral"), trial.truth.wind_arm_per_m, SETTINGS)
    assert found.converged and max(p.std / abs(p.value) for p in found.parameters) < 0.05
    assert not any("hardly determine a direction" in warning for warning in found.warnings)


@pytest.mark.parametrize("hull", ["mariner", "ferry"])
def test_a_yaw_rate_without_a_heading_measurement_is_enough(hull: str) -> None:
    # as the paper has it: y_v and y_r alone
    trial = sailed(hull, seed=2)
    record = record_of(trial)
    measured = record.measured.copy()
    measured[:, 2] = np.nan
    found = identify(replace(record, measured=measured), ModelSpec(), trial.truth.wind_arm_per_m, SETTINGS)
    assert found.converged
    assert worst(found.hull.array(), np.array([p.std for p in found.parameters]), trial) < 3.5
    assert "sigma_psi" not in {level.name for level in found.noise}


def test_a_sparse_heading_serves_beside_the_yaw_rate() -> None:
    trial = sailed("mariner", seed=2)
    instruments = instruments_of(trial)
    heading = instruments.series["heading"]
    # every 2 s in place of five times a second
    slow = changed(instruments, "heading", Series(heading.time_utc_ns[::10], heading.value[::10]))
    record = make_record(slow, *bounds(trial))
    assert np.count_nonzero(np.isfinite(record.measured[:, 2])) < 0.12 * heading.value.size
    found = identify(record, ModelSpec(), trial.truth.wind_arm_per_m, SETTINGS)
    assert found.converged
    assert worst(found.hull.array(), np.array([p.std for p in found.parameters]), trial) < 3.5
