"""Runs as comparison takes them: of simulated ships, and such as the model itself would sail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.record.average import step_of
from kempf.pipeline.estimate.record.grid_run import GridRun, ShipConstants, make_run
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.predict.free_run import free_run_of
from kempf.pipeline.predict.run_residuals import PhaseInterval, RunResiduals
from kempf.pipeline.simulate.trial import Trial
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import instruments_of, record_of

#: the disturbance model of the simulator with its arm known, and still water
SPEC = ModelSpec(moment="none", rate_bias=False)
QUIET = SPEC.model_copy(update={"wind": "none", "current": "none"})
#: standard deviations of lateral speed, yaw rate, heading, SI
NOISE = np.array([0.03, 5e-4, 2e-3])
LENGTH_M = 160.0


def run_of(trial: Trial, spec: ModelSpec = SPEC, name: str = "seg-1") -> GridRun:
    record = record_of(trial)
    ship = ShipConstants(LENGTH_M, 8.0, trial.truth.wind_arm_per_m)
    return make_run(name, record, instruments_of(trial), spec, ship, step_of([record], LENGTH_M))


def filtered_of(trial: Trial, spec: ModelSpec = SPEC, name: str = "seg-1") -> RunFilter:
    return RunFilter(run_of(trial, spec, name), EffectModel(), spec)


def levels_of(noise: np.ndarray = NOISE) -> np.ndarray:
    """Logarithms of levels: hardly a disturbance, this noise."""
    return np.log(np.array([1e-7, 1e-9, 1e-5, *noise]))


def sailed_by_model(
    run: GridRun, hull: np.ndarray, *, seed: int = 1, late_s: float = 0.0, scale: float = 1.0
) -> RunFilter:
    """The run with measurements that the model in still water makes, every instant and channel, with white noise.

    ``late_s``: by how much the rudder reaches the hull later than it is logged.
    """
    line, n = run.rudder_line, run.measured.shape[0]
    late = replace(line, angle_rad=np.interp(line.time_s - late_s, line.time_s, line.angle_rad))
    exact = replace(run, rudder_noise=np.zeros(n), offset_s=np.zeros((n, 3)), measured=np.zeros((n, 3)))
    clean = RunFilter(replace(exact, rudder_line=late), EffectModel(), QUIET).free(hull, np.zeros(0), np.zeros(8))
    noise = scale * NOISE * np.random.default_rng(seed).standard_normal((n, 3))
    return RunFilter(replace(exact, measured=clean + noise), EffectModel(), QUIET)


def looked_at(filtered: RunFilter, hull: np.ndarray, phases: tuple[PhaseInterval, ...] = ()) -> RunResiduals:
    point = Point(hull, np.zeros(0), levels_of())
    free = free_run_of(filtered, hull, np.zeros(0))
    return RunResiduals(filtered, sensitivity.passed(filtered, point), free, phases)
