"""The estimators by the names that a person calls them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from pipeline.identify import least_squares, maximum_likelihood, paper
from pipeline.identify.estimate import Estimate
from pipeline.identify.least_squares import LeastSquaresSettings
from pipeline.identify.maximum_likelihood import MaximumLikelihoodSettings
from pipeline.identify.paper import PaperSettings
from pipeline.identify.record import Record
from schemas.model_spec import ModelSpec

_SETTINGS: dict[str, type[MaximumLikelihoodSettings] | type[PaperSettings] | type[LeastSquaresSettings]] = {
    "ml": MaximumLikelihoodSettings,
    "paper": PaperSettings,
    "least-squares": LeastSquaresSettings,
}


def default_settings(name: str) -> dict[str, Any]:
    """Return the settings of an estimator as JSON content, all defaults."""
    return asdict(_SETTINGS[name]())


def estimate(name: str, record: Record, spec: ModelSpec, arm_per_m: float, settings: dict[str, Any]) -> Estimate:
    """Run one estimator on one record.

    Parameters
    ----------
    name : str
        One of `pipeline.identify.names.NAMES`.
    record : Record
    spec : ModelSpec
    arm_per_m : float
        l of eq. (16), 1/m.
    settings : dict
        As `default_settings` gives them; JSON has no tuples, so lists stand for them.

    Returns
    -------
    Estimate
    """
    given: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()}
    chosen = _SETTINGS[name](**given)
    if isinstance(chosen, MaximumLikelihoodSettings):
        return maximum_likelihood.identify(record, spec, arm_per_m, chosen)
    if isinstance(chosen, PaperSettings):
        return paper.identify(record, spec, arm_per_m, chosen)
    return least_squares.identify(record, chosen)
