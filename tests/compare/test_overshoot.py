"""Overshoots, levels and what is said of a run."""

from __future__ import annotations

import json

import numpy as np
import pytest

from kempf.pipeline.compare.compared_run import compare_run
from kempf.pipeline.compare.comparison import judged, summary
from kempf.pipeline.compare.overshoot import StoredOvershoot, compare_overshoots, turns_of
from kempf.pipeline.estimate.levels import fit_levels
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.horizon import horizon_of
from tests.compare.seen import NOISE, QUIET, levels_of, run_of, sailed_by_model
from tests.estimate.simulated import sailed, truth_of

TIME = np.arange(0.0, 100.0, 1.0)


def swing(gain_deg: float, period_s: float = 80.0) -> np.ndarray:
    return np.deg2rad(gain_deg) * np.sin(2.0 * np.pi * TIME / period_s)


def test_the_overshoot_is_what_the_heading_gains_after_the_execute() -> None:
    # the peak is at 20 s; executed at 10 s the heading still gains gain (1 - sin 45)
    (turn,) = turns_of([(1, 1, 20.0, 3.0)], [10.0, 50.0], 90.0)
    (found,) = compare_overshoots(TIME, swing(20.0), swing(24.0), [turn])
    assert found.error_deg == pytest.approx(4.0 * (1.0 - np.sqrt(0.5)), abs=0.01)
    assert found.predicted_deg == pytest.approx(3.0 + found.error_deg)
    (same,) = compare_overshoots(TIME, swing(20.0), swing(20.0) + 0.3, [turn])
    assert same.error_deg == pytest.approx(0.0, abs=1e-9)
    (port,) = compare_overshoots(TIME, -swing(20.0), -swing(18.0), [StoredOvershoot(1, -1, 10.0, 50.0, 3.0)])
    assert port.error_deg == pytest.approx(-2.0 * (1.0 - np.sqrt(0.5)), abs=0.01)


def test_a_prediction_that_does_not_turn_back_has_no_overshoot() -> None:
    turn = StoredOvershoot(1, 1, 10.0, 40.0, 3.0)
    (found,) = compare_overshoots(TIME, swing(20.0), np.deg2rad(0.5) * TIME, [turn])
    assert found.measured_deg == 3.0 and found.predicted_deg is None and found.error_deg is None


def test_a_gap_in_the_measured_heading_is_bridged() -> None:
    measured = swing(20.0)
    measured[[5, 15, 30]] = np.nan
    (found,) = compare_overshoots(TIME, measured, swing(20.0), [StoredOvershoot(1, 1, 10.0, 50.0, 3.0)])
    assert found.error_deg == pytest.approx(0.0, abs=0.01)


def test_levels_come_back_from_a_run_of_the_model() -> None:
    trial = sailed("ferry", seed=3, duration_s=600.0)
    hull = truth_of(trial)
    filtered = sailed_by_model(run_of(trial, QUIET), hull)
    found = fit_levels(filtered, hull, np.zeros(0), levels_of(NOISE * np.array([4.0, 0.3, 3.0])))
    assert found.converged
    n = filtered.run.measured.shape[0]
    np.testing.assert_allclose(found.levels[3:], np.log(NOISE), atol=4.0 / np.sqrt(2.0 * n))
    wild = hull * np.array([-400.0, 1.0, 1.0, -400.0, 1.0, 1.0])
    lost = fit_levels(filtered, wild, np.zeros(0), levels_of())
    assert not lost.converged and lost.log_likelihood == -np.inf


def test_the_summary_of_runs_keeps_the_samples_apart() -> None:
    trial = sailed("ferry", seed=3, duration_s=400.0)
    hull = truth_of(trial)
    point = Point(hull, np.zeros(0), levels_of())
    filtered = [sailed_by_model(run_of(trial, QUIET, f"seg-{k}"), hull, seed=k, scale=k) for k in (1, 2, 3)]
    runs = [
        compare_run(one, point, horizon_of("10s"), held_out=k == 2, turns=[StoredOvershoot(1, 1, 60.0, 120.0, 5.0)])
        for k, one in enumerate(filtered)
    ]
    shown = [run.as_json() for run in runs]
    json.dumps(shown, allow_nan=False)
    assert [one["held_out"] for one in shown] == [False, False, True]
    assert [one["sample"] for one in shown] == ["fitted", "fitted", "held_out"]
    assert list(shown[0]["fit_percent"]) == ["yaw_rate", "heading", "lateral_speed"]
    assert shown[0]["rms_display"]["yaw_rate"]["value"] == pytest.approx(np.rad2deg(shown[0]["rms"]["yaw_rate"]))
    means = summary(runs)
    assert (means["fitted"]["runs"], means["held_out"]["runs"]) == (2, 1)
    fits = [one["fit_percent"]["heading"] for one in shown]
    assert means["fitted"]["fit_percent"]["heading"]["mean"] == pytest.approx(np.mean(fits[:2]))
    assert means["fitted"]["fit_percent"]["heading"]["std_error"] == pytest.approx(abs(fits[0] - fits[1]) / 2.0)
    assert means["held_out"]["fit_percent"]["heading"] == {"mean": fits[2], "std_error": None}
    assert judged(runs) == ("held_out", runs[2].free_run_error_percent)
    assert judged(runs[:2])[0] == "fitted"
    free = runs[2].free.fit_percent()
    assert runs[2].free_run_error_percent == pytest.approx(100.0 - np.mean(list(free.values())))
    assert runs[2].free_run_error_percent > runs[0].free_run_error_percent
    assert summary(runs[:2])["held_out"] is None


@pytest.mark.parametrize(("asked", "key"), [("1", "every measurement before"), ("10s", "7.5 to 10 s before")])
def test_what_a_prediction_started_from_is_stated(asked: str, key: str) -> None:
    trial = sailed("ferry", seed=3, duration_s=400.0)
    hull = truth_of(trial)
    filtered = sailed_by_model(run_of(trial, QUIET), hull)
    run = compare_run(filtered, Point(hull, np.zeros(0), levels_of()), horizon_of(asked), held_out=True)
    assert key in run.as_json()["started_from"]["initial_state"]
    free = compare_run(filtered, Point(hull, np.zeros(0), levels_of()), horizon_of("free"), held_out=True).as_json()
    assert set(free["started_from"]["initial_state"]) == {
        *("lateral_speed_m_s", "yaw_rate_deg_s", "heading_from_first_deg"),
    }
    # still water: nothing else was fitted
    assert free["started_from"]["disturbances"] == {}
    assert free["started_from"]["initial_state"]["lateral_speed_m_s"] == pytest.approx(0.0, abs=0.05)
