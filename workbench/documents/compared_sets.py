"""Two parameter sets beside each other."""

from __future__ import annotations

from typing import Any

from kempf.warehouse.parameter_set import ParameterSet, compare


def compared_sets(one: ParameterSet, other: ParameterSet) -> dict[str, Any]:
    """Return how the parameters of two sets differ, as JSON content."""
    return {
        "first": one.parameter_set_id,
        "second": other.parameter_set_id,
        "parameters": compare(one, other),
    }
