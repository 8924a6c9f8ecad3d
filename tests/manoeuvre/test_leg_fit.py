"""Which parameters of a stored set predictions take."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kempf.flows.jobs.identify.leg_fit import fitted_to_legs
from kempf.flows.jobs.identify.ship_model import ship_of_set
from kempf.flows.jobs.identify.standing_model import standing
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.workbench.export import as_control, as_text, linear
from tests.late import VESSEL

NAMES = ("a11", "a12", "a21", "a22", "b1", "b2", "wind_force.c", "wind_force.k", "cross_flow_drag.c")


def stored(better: dict[str, float] | None) -> ParameterSet:
    """A set whose parameters fitted to legs count up, stored as JSON stores them: by name."""
    ahead: dict[str, Any] = {
        "parameters": {
            name: {"value": float(k), "std": 0.1} for k, name in sorted(enumerate(NAMES), key=lambda p: p[1])
        },
        "covariance": np.diag(np.arange(1.0, 10.0)).tolist(),
        "better_than_one_step": better,
        "fitted_misfit": 1.0,
        "left_out_misfit": 4.0,
    }
    made = SimpleNamespace(fit={"rung": {"one_leg_ahead": ahead}}, parameters=[SimpleNamespace(name=n) for n in NAMES])
    return cast("ParameterSet", made)


def test_parameters_fitted_to_legs_are_in_the_order_of_the_set_and_its_covariance() -> None:
    found = fitted_to_legs(stored({"falls_by": 0.5}))
    assert found is not None
    hull, values, covariance, factor = found
    assert hull.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert values.tolist() == [6.0, 7.0, 8.0]
    assert covariance[8, 8] == 9.0 and factor == 2.0


def test_where_the_likelihood_predicts_as_well_there_are_none() -> None:
    assert fitted_to_legs(stored(None)) is None


def test_steering_and_exports_take_what_predictions_take(late_added: Path) -> None:
    warehouse = Warehouse(str(late_added / "w"))
    with_lag = standing(warehouse, VESSEL)
    assert with_lag is not None and with_lag.parent is not None
    plain = parameter_sets.get(warehouse, with_lag.parent)
    legs = fitted_to_legs(plain)
    assert legs is not None and fitted_to_legs(with_lag) is None
    hull, _, covariance, factor = legs
    ship = ship_of_set(warehouse, plain)
    assert np.array_equal(ship.hull.array(), hull)
    assert np.array_equal(ship.covariance, factor**2 * covariance)
    assert "fitted to legs" in ship.of_parameters[0] and ship.warnings[0] == ship.of_parameters[0]
    assert [p.value for p in ship.parameters] == hull.tolist()
    assert [p.std for p in ship.parameters] == pytest.approx(np.sqrt(np.diag(ship.covariance)).tolist())
    # what the file says of the parameters is what its matrices were made of
    module: dict[str, Any] = {}
    exec(as_control(linear(ship, 1.0, 0.0)), module)  # noqa: S102 - our own
    assert list(module["PARAMETERS"].values()) == hull.tolist()
    assert module["continuous"].A[0, 0] == pytest.approx(module["PARAMETERS"]["a11"] * ship.speed_m_s)
    errors = list(module["STANDARD_ERRORS"].values())
    assert np.sqrt(np.diag(module["COVARIANCE"])).tolist() == pytest.approx(errors)
    # what the instruments did is no matter of the hull's parameters
    assert set(plain.warnings) - set(ship.of_parameters) <= {
        w for w in plain.warnings if "not determined" in w or ">" in w
    }
    rows = list(csv.DictReader(io.StringIO(as_text(plain, "csv"))))
    exported = {row["name"]: float(row["value"]) for row in rows if row["group"] == "fitted_to_legs"}
    assert exported == module["PARAMETERS"]
    right = ship_of_set(warehouse, with_lag)
    values = {p.name: p.value for p in with_lag.parameters}
    assert right.hull.array().tolist() == [values[name] for name in HULL_PARAMETERS]
    assert right.of_parameters == with_lag.warnings
    (tau,) = right.effect_parameters
    assert tau == next(p for p in with_lag.parameters if p.name == "rudder_lag.tau")
