"""The parameters of a set that predict best: those fitted to legs, where they predict better than the likelihood's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.shooting.inflation import inflation
from kempf.warehouse.tables.parameter_set import ParameterSet


def fitted_to_legs(parameter_set: ParameterSet) -> tuple[Float, Float, Float, float] | None:
    """Return hull, effects, covariance and its factor of the fit one leg ahead.

    None where that a step ahead predicts as well. The factor is `kempf.pipeline.shooting.inflation.inflation`.
    """
    ahead = _ahead(parameter_set)
    if ahead is None or not taken_by_predictions(ahead):
        return None
    # by name, as JSON keeps no order; the covariance is in that of the set
    values = np.array([ahead["parameters"][name]["value"] for name in _names(parameter_set, ahead)], dtype=np.float64)
    covariance = np.array(ahead["covariance"], dtype=np.float64)
    factor = inflation(ahead.get("fitted_misfit"), ahead.get("left_out_misfit"))
    return values[:6], values[6:], covariance, factor


def taken_by_predictions(ahead: Mapping[str, Any] | None) -> bool:
    """Return whether predictions take the parameters fitted to legs.

    Parameters
    ----------
    ahead : mapping or None
        ``one_leg_ahead`` of a rung; None where it has none.
    """
    if ahead is None or ahead.get("better_than_one_step") is None:
        return False
    # what is not known is null in JSON
    return bool(np.all(np.isfinite(np.array(ahead["covariance"], dtype=np.float64))))


def by_name(parameter_set: ParameterSet) -> dict[str, tuple[float, float]]:
    """Return value and standard error of what `fitted_to_legs` gives, by parameter; empty where that is None."""
    ahead, fitted = _ahead(parameter_set), fitted_to_legs(parameter_set)
    if ahead is None or fitted is None:
        return {}
    hull, effects, covariance, factor = fitted
    stds = factor * np.sqrt(np.diag(covariance))
    pairs = zip((*hull.tolist(), *effects.tolist()), stds.tolist(), strict=True)
    return dict(zip(_names(parameter_set, ahead), pairs, strict=True))


def shown_by_legs(parameter_set: ParameterSet) -> bool:
    """Return whether free runs of a set are shown with the parameters fitted to legs, as in a ladder that ends there.

    A plain model is shown by the likelihood's, as effects that are added later are compared with these.
    """
    return bool(parameter_set.model_spec.get("effects")) and bool(by_name(parameter_set))


def _ahead(parameter_set: ParameterSet) -> Mapping[str, Any] | None:
    ahead: Mapping[str, Any] | None = ((parameter_set.fit or {}).get("rung") or {}).get("one_leg_ahead")
    return ahead


def _names(parameter_set: ParameterSet, ahead: Mapping[str, Any]) -> list[str]:
    """Return the parameters of the ship that a fit to legs has, in the order of the set."""
    return [p.name for p in parameter_set.parameters if p.name in ahead["parameters"]]
