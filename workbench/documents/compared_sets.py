"""Two parameter sets beside each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.nomoto import nomoto
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from kempf.warehouse.tables.covariance import covariance_of
from kempf.warehouse.tables.parameter_set import ParameterSet, StoredValue, compare, differences

#: powers of the length by which the six parameters have no dimension
_POWERS = {"a11": 1, "a12": 0, "a21": 2, "a22": 1, "b1": 1, "b2": 2}


def compared_sets(warehouse: Warehouse, first: ParameterSet, second: ParameterSet) -> dict[str, Any]:
    """Return how the parameters of two sets differ, as JSON content.

    Returns
    -------
    dict
        ``first``, ``second``; ``parameters``, see `tables.parameter_set.compare`; ``nondimensional``, the same of the
        hull's six without their dimension and of its K' = K L/V and T' = T V/L, by which ships of other sizes are
        compared; None where a profile states no length, or a set has no hull.
    """
    here, there = (
        without_dimension(parameter_set, _length_m(warehouse, parameter_set)) for parameter_set in (first, second)
    )
    return {
        "first": first.parameter_set_id,
        "second": second.parameter_set_id,
        "parameters": compare(first, second),
        "nondimensional": None if here is None or there is None else differences(here, there),
    }


def without_dimension(parameter_set: ParameterSet, length_m: float | None) -> tuple[StoredValue, ...] | None:
    """Return the hull of a set without its dimension, with K' and T' of the hull alone; None where that cannot be."""
    values = {p.name: p for p in parameter_set.parameters}
    if length_m is None or not _POWERS.keys() <= values.keys():
        return None
    nondimensional = [
        StoredValue(
            f"{name}'",
            length_m**power * values[name].value,
            None if values[name].std is None else length_m**power * (values[name].std or 0.0),
            "1",
        )
        for name, power in _POWERS.items()
    ]
    try:
        hull = Hull(*(float(values[name].value) for name in _POWERS))
        # neither depends on the speed
        constants = nomoto(hull, covariance_of(parameter_set, list(_POWERS)), 1.0, length_m).constants
    except KempfError:
        return tuple(nondimensional)
    of_steering = (constants[name] for name in ("K'", "T'"))
    nondimensional += [StoredValue(c.name, c.value, c.std if np.isfinite(c.std) else None, "1") for c in of_steering]
    return tuple(nondimensional)


def _length_m(warehouse: Warehouse, parameter_set: ParameterSet) -> float | None:
    return vessels.get(warehouse, str(parameter_set.provenance["inputs"]["profile_sha256"])).length_m
