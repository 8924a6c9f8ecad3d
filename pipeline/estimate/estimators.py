"""The estimators by the names that a person calls them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.classical import output_error, subspace
from kempf.pipeline.estimate.no_log.identify import NoLogSettings, identify_without_log
from kempf.pipeline.estimate.paper import least_squares, ship
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.estimate.result import Estimate
from kempf.schemas.model_spec import ModelSpec

#: record, model, l of eq. (16) in 1/m, the estimator's own settings
Identify = Callable[[Record, ModelSpec, float, Any], Estimate]


@dataclass(frozen=True)
class _Estimator:
    settings: Callable[..., Any]
    identify: Identify


def _least_squares(record: Record, spec: ModelSpec, arm_per_m: float, settings: Any) -> Estimate:
    """Eq. (14) knows neither disturbances nor their arm."""
    return least_squares.identify(record, settings)


_ESTIMATORS: dict[str, _Estimator] = {
    "ml": _Estimator(maximum_likelihood.MaximumLikelihoodSettings, maximum_likelihood.identify),
    "paper": _Estimator(ship.PaperSettings, ship.identify),
    "least-squares": _Estimator(least_squares.LeastSquaresSettings, _least_squares),
    "output-error": _Estimator(output_error.OutputErrorSettings, output_error.identify),
    "subspace": _Estimator(subspace.SubspaceSettings, subspace.identify),
}


def default_settings(name: str) -> dict[str, Any]:
    """Return the settings of an estimator as JSON content, all defaults."""
    return asdict(_ESTIMATORS[name].settings())


def estimate_without_log(
    record: Record,
    spec: ModelSpec,
    arm_per_m: float,
    settings: dict[str, Any],
    no_log: dict[str, Any],
    companions: tuple[Record, ...] = (),
) -> Estimate:
    """Run ``ml`` on one record without a log, see `kempf.pipeline.estimate.no_log.identify.identify_without_log`.

    Parameters
    ----------
    arm_per_m : float
        l of eq. (16), 1/m.
    settings : dict
        Of ``ml``, as `default_settings` gives them.
    no_log : dict
        Fields of `kempf.pipeline.estimate.no_log.identify.NoLogSettings`.
    """
    lateral = maximum_likelihood.MaximumLikelihoodSettings(**_with_tuples(settings))
    return identify_without_log(record, spec, arm_per_m, lateral, NoLogSettings(**no_log), companions)


def _with_tuples(settings: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()}


def estimate(
    name: str,
    record: Record,
    spec: ModelSpec,
    arm_per_m: float,
    settings: dict[str, Any],
    length_m: float | None = None,
) -> Estimate:
    """Run one estimator on one record.

    Parameters
    ----------
    name : str
        One of `kempf.pipeline.estimate.names.NAMES`.
    arm_per_m : float
        l of eq. (16), 1/m.
    settings : dict
        As `default_settings` gives them; JSON has no tuples, so lists stand for them.
    length_m : float, optional
        Of the ship, for the step over which ``ml`` averages readings.
    """
    chosen = _ESTIMATORS[name]
    given = chosen.settings(**_with_tuples(settings))
    ready = with_rudder_inflow(record, spec)
    if name == "ml":
        return maximum_likelihood.identify(ready, spec, arm_per_m, given, length_m)
    return chosen.identify(ready, spec, arm_per_m, given)
