"""Every estimator by name: those of the command line, and three that a user would try elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from benchmarks.baselines import multiple_models, prediction_error, smoothed_regression
from kempf.pipeline.estimate import estimators, names
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.estimate.result import Estimate
from kempf.schemas.model_spec import ModelSpec

_BASELINES: dict[str, tuple[Callable[..., Any], Callable[..., Estimate]]] = {
    "prediction-error": (prediction_error.PredictionErrorSettings, prediction_error.identify),
    "multiple-models": (multiple_models.MultipleModelsSettings, multiple_models.identify),
    "ekf-ols": (smoothed_regression.SmoothedRegressionSettings, smoothed_regression.identify),
}
NAMES: tuple[str, ...] = (*names.NAMES, *_BASELINES)


def default_settings(name: str) -> dict[str, Any]:
    """Return the settings of an estimator as JSON content, all defaults."""
    return asdict(_BASELINES[name][0]()) if name in _BASELINES else estimators.default_settings(name)


def estimate(name: str, record: Record, spec: ModelSpec, arm_per_m: float, settings: dict[str, Any]) -> Estimate:
    """Run one estimator on one record."""
    if name not in _BASELINES:
        return estimators.estimate(name, record, spec, arm_per_m, settings)
    make, identify = _BASELINES[name]
    return identify(with_rudder_inflow(record, spec), spec, arm_per_m, make(**settings))
