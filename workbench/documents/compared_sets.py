"""Two parameter sets beside each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.nomoto import nomoto
from kempf.schemas.errors import KempfError
from kempf.warehouse import vessels
from kempf.warehouse.covariance import covariance_of
from kempf.warehouse.parameter_set import ParameterSet, StoredValue, compare, differences
from kempf.warehouse.store import Warehouse

#: powers of the length by which the six parameters have no dimension
_POWERS = {"a11": 1, "a12": 0, "a21": 2, "a22": 1, "b1": 1, "b2": 2}


def compared_sets(warehouse: Warehouse, one: ParameterSet, other: ParameterSet) -> dict[str, Any]:
    """Return how the parameters of two sets differ, as JSON content.

    Returns
    -------
    dict
        ``first``, ``second``; ``parameters``, see `kempf.warehouse.parameter_set.compare`; ``nondimensional``, the same
        of the hull's six without their dimension and of its K' = K L/V and T' = T V/L, by which ships of other sizes
        are compared; None where a profile states no length, or a set has no hull.
    """
    here, there = (without_dimension(one_set, _length_m(warehouse, one_set)) for one_set in (one, other))
    return {
        "first": one.parameter_set_id,
        "second": other.parameter_set_id,
        "parameters": compare(one, other),
        "nondimensional": None if here is None or there is None else differences(here, there),
    }


def without_dimension(one: ParameterSet, length_m: float | None) -> tuple[StoredValue, ...] | None:
    """Return the hull of a set without its dimension, with K' and T' of the hull alone; None where that cannot be."""
    values = {p.name: p for p in one.parameters}
    if length_m is None or not _POWERS.keys() <= values.keys():
        return None
    found = [
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
        constants = nomoto(hull, covariance_of(one, list(_POWERS)), 1.0, length_m).constants
    except KempfError:
        return tuple(found)
    of_steering = (constants[name] for name in ("K'", "T'"))
    found += [StoredValue(c.name, c.value, c.std if np.isfinite(c.std) else None, "1") for c in of_steering]
    return tuple(found)


def _length_m(warehouse: Warehouse, one: ParameterSet) -> float | None:
    return vessels.get(warehouse, str(one.provenance["inputs"]["profile_sha256"])).length_m
