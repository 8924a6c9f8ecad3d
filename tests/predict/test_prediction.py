"""Predictions at every horizon: against the truth, against MATLAB's definition, against what was withheld."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.horizon import horizon_of
from kempf.pipeline.predict.prediction import predict
from kempf.pipeline.simulate.disturbances import Environment
from kempf.schemas.errors import DataRejected, UsageError
from tests.compare.seen import QUIET, SPEC, filtered_of, levels_of, run_of, sailed_by_model
from tests.estimate.simulated import sailed, truth_of

HORIZONS = ("1", "10s", "60s", "free")


@pytest.mark.parametrize("asked", HORIZONS)
def test_the_true_ship_without_noise_fits_to_nearly_100_percent(asked: str) -> None:
    trial = sailed("ferry", seed=3, noise_scale=1e-3, environment=Environment(), duration_s=400.0)
    filtered = filtered_of(trial, QUIET)
    found = predict(filtered, Point(truth_of(trial), np.zeros(0), levels_of()), horizon_of(asked))
    assert set(found.fit_percent()) == {"lateral_speed", "yaw_rate", "heading"}
    assert min(found.fit_percent().values()) > 99.0, found.fit_percent()
    slow = truth_of(trial) * np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.8])
    worse = predict(filtered, Point(slow, np.zeros(0), levels_of()), horizon_of(asked))
    assert worse.fit_percent()["yaw_rate"] < found.fit_percent()["yaw_rate"] - (0.0 if asked == "1" else 2.0)


def test_fit_percent_is_matlabs() -> None:
    trial = sailed("ferry", seed=3, duration_s=300.0)
    filtered = filtered_of(trial)
    found = predict(filtered, Point(truth_of(trial), np.zeros(0), levels_of()), horizon_of("free"))
    y, e = filtered.run.measured[:, 1], found.error[:, 1]
    good = np.isfinite(y)
    nrmse = np.linalg.norm(e[good]) / np.linalg.norm(y[good] - np.mean(y[good]))
    assert found.fit_percent()["yaw_rate"] == pytest.approx(100.0 * (1.0 - nrmse), rel=1e-12)
    assert found.rms()["yaw_rate"] == pytest.approx(np.sqrt(np.mean(e[good] ** 2)), rel=1e-12)
    assert found.inside_95() == {}


def test_errors_grow_with_the_horizon_as_their_intervals_say() -> None:
    trial = sailed("mariner", seed=5, duration_s=900.0)
    filtered = filtered_of(trial)
    F, V = trial.settings.environment.wind_force, trial.settings.environment.current_north
    assert F is not None and V is not None
    levels = np.log(np.array([2e-4, 1e-9, 3e-4, 0.05, 6e-4, 2e-3]))
    widths = []
    for asked in ("1", "10s", "60s"):
        found = predict(filtered, Point(truth_of(trial), np.zeros(0), levels), horizon_of(asked))
        widths.append(np.nanmedian(found.std, axis=0))
        for inside, of in found.inside_95().values():
            assert of > 200 and inside / of > 0.85
    assert np.all(np.diff(np.array(widths), axis=0) > 0.0)


def test_every_instant_is_predicted_once_and_from_what_lies_before() -> None:
    trial = sailed("ferry", seed=4, duration_s=400.0)
    filtered = filtered_of(trial)
    point = Point(truth_of(trial), np.zeros(0), levels_of())
    found = predict(filtered, point, horizon_of("20s"))
    steps = round(20.0 / filtered.run.step_s)
    made = np.isfinite(filtered.run.measured[:, 1])
    made[: 2 * steps] = False
    assert np.all(np.isfinite(found.error[made, 1]))
    assert not np.any(np.isfinite(found.error[:steps]))
    # what is measured in the last three quarters of a horizon, and later, does not move a prediction
    at = 4 * steps
    spoilt = filtered.run.measured.copy()
    spoilt[at - 3 * steps // 4 + 1 :] += 1.0
    other = predict(replace(filtered, run=replace(filtered.run, measured=spoilt)), point, horizon_of("20s"))
    np.testing.assert_allclose(other.predicted[at], found.predicted[at], rtol=1e-12)


def test_a_run_of_the_model_keeps_its_intervals_at_every_horizon() -> None:
    trial = sailed("ferry", seed=3, duration_s=600.0)
    hull = truth_of(trial)
    filtered = sailed_by_model(run_of(trial, QUIET), hull)
    for asked in ("1", "10s", "60s"):
        found = predict(filtered, Point(hull, np.zeros(0), levels_of()), horizon_of(asked))
        for inside, of in found.inside_95().values():
            assert abs(inside / of - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / of), (asked, inside, of)


@pytest.mark.parametrize("text", ["", "0s", "-5s", "10", "nan", "1e3s", "forever", "10m"])
def test_a_horizon_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(UsageError) as refused:
        horizon_of(text)
    assert refused.value.code == "horizon_unknown"


def test_a_horizon_longer_than_the_run_is_refused() -> None:
    trial = sailed("ferry", seed=4, duration_s=400.0)
    with pytest.raises(DataRejected) as refused:
        predict(filtered_of(trial), Point(truth_of(trial), np.zeros(0), levels_of()), horizon_of("300s"))
    assert refused.value.code == "horizon_too_long"


def test_a_ship_that_runs_away_is_reported() -> None:
    trial = sailed("ferry", seed=4, duration_s=400.0)
    wild = truth_of(trial) * np.array([-400.0, 1.0, 1.0, -400.0, 1.0, 1.0])
    for asked in HORIZONS:
        with pytest.raises(DataRejected) as refused:
            predict(filtered_of(trial, SPEC), Point(wild, np.zeros(0), levels_of()), horizon_of(asked))
        assert refused.value.code == "prediction_diverges"
