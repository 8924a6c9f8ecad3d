"""The covariance of a stored parameter set, by the names of its parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kempf.warehouse.tables.parameter_set import ParameterSet


def covariance_of(parameter_set: ParameterSet, parameters: Sequence[str]) -> NDArray[np.float64]:
    """Pick parameters out of a set's covariance, shape (n, n); NaN for what it does not hold."""
    covariance = np.full((len(parameters), len(parameters)), np.nan)
    names = list(parameter_set.covariance_names)
    held = [(i, names.index(name)) for i, name in enumerate(parameters) if name in names]
    for i, row in held:
        for j, column in held:
            covariance[i, j] = parameter_set.covariance[row][column]
    return covariance
