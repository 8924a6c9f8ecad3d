"""The covariance of a stored parameter set, by the names of its parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kempf.warehouse.parameter_set import ParameterSet


def covariance_of(one: ParameterSet, wanted: Sequence[str]) -> NDArray[np.float64]:
    """Pick parameters out of a set's covariance, shape (n, n); NaN for what it does not hold."""
    found = np.full((len(wanted), len(wanted)), np.nan)
    names = list(one.covariance_names)
    held = [(i, names.index(name)) for i, name in enumerate(wanted) if name in names]
    for i, row in held:
        for j, column in held:
            found[i, j] = one.covariance[row][column]
    return found
