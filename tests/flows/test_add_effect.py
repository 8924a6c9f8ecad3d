"""An effect that makes predictions worse is stored and does not become the current model by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from kempf.flows.jobs.diagnose import add_effect as job
from kempf.flows.jobs.identify import vessel_model
from kempf.pipeline.diagnose.steps import improves_prediction
from kempf.pipeline.estimate.pooled_fit import ShipPart
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.shooting.ahead import Ahead
from kempf.schemas.effects import get
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet


def made(**samples: tuple[float | None, float | None]) -> ParameterSet:
    """A set whose rung compares so with the one below: part by which the misfit falls, and that in standard errors."""
    beside = {name: {"falls_by": f, "in_std": t, "better": 1, "of": 9} for name, (f, t) in samples.items()}
    rung: dict[str, Any] = {"one_leg_ahead": {"beside_the_rung_below": beside}}
    return cast(
        "ParameterSet",
        SimpleNamespace(fit={"rung": rung}, parameter_set_id="ps-1", convergence={"converged": True}, parent="ps-0"),
    )


def test_what_is_worse_is_said_with_its_figure() -> None:
    assert job.worsening(made(fitted=(0.3, 4.0), left_out=(0.2, 3.0), held_out=(-0.5, -1.0))) == []
    # sure, and by less than anybody would notice
    assert job.worsening(made(fitted=(-0.004, -6.0))) == []
    (said,) = job.worsening(made(fitted=(0.3, 4.0), held_out=(-0.5, -2.5)))
    assert "held out" in said and "50 %" in said and "2.5 standard errors" in said
    (said,) = job.worsening(made(left_out=(-1.0, None)))
    assert "diverges" in said


def test_an_effect_that_may_as_well_not_be_there_is_said_by_the_fit_that_predictions_take() -> None:
    model = EffectModel((get("cross_flow_drag"), get("wind_force")))
    std = np.array([*np.full(6, 0.1), 0.1, 1e-4, 1e-4])
    ship = cast(ShipPart, SimpleNamespace(model=model, values=np.array([1.0, 1e-5, 5e-4]), std=std))
    # one of its two numbers is enough
    assert vessel_model._of_nothing(None, ship) == ()
    ship.values[2] = 1e-4
    (said,) = vessel_model._of_nothing(None, ship)
    assert "within 2 standard errors of nothing" in said
    assert "wind_force.c = 1e-05 ± 0.0001" in said and "cross_flow_drag" not in said
    fit = SimpleNamespace(values=np.array([0.1, 1e-3, 0.0]))
    ahead = cast(Ahead, SimpleNamespace(disagrees=object(), model=model, fit=fit, std=std))
    (said,) = vessel_model._of_nothing(ahead, ship)
    assert "cross_flow_drag.c = 0.1 ± 0.1" in said and "wind_force" not in said


def test_bounds_are_those_of_the_diagnosis() -> None:
    assert (job.WORSE, job.LEAST_RISE) == (improves_prediction.WORSE, improves_prediction.LEAST_RISE)


def test_a_worse_model_is_pointed_to_by_force_only(monkeypatch: pytest.MonkeyPatch) -> None:
    pointed: list[ParameterSet] = []
    worse = made(fitted=(-0.5, -4.0))
    monkeypatch.setattr(job, "choose_refreshed", lambda *_: None)
    monkeypatch.setattr(job, "stored_model", lambda *_: worse)
    monkeypatch.setattr(job, "require_current", lambda *_: None)
    monkeypatch.setattr(job, "point", lambda _, one, expected: pointed.append(one))
    place, begin = cast("Warehouse", None), (ModelSpec(), job.NONE_OF_ONES_OWN)
    with pytest.raises(DataRejected) as caught:
        job.add_effect(place, "late", "gyro_scale", begin=begin)
    assert caught.value.code == "effect_worsens" and "ps-1" in str(caught.value) and pointed == []
    assert job.add_effect(place, "late", "gyro_scale", begin=begin, force=True) is worse
    assert pointed == [worse]


@pytest.mark.parametrize("parents_too", [False, True])
def test_a_model_that_lost_its_top_is_pointed_to_by_force_only(
    monkeypatch: pytest.MonkeyPatch, *, parents_too: bool
) -> None:
    pointed: list[ParameterSet] = []
    lost = made(fitted=(0.3, 4.0))
    lost.convergence.update({"converged": False, "reason": "the iterations allowed ran out"})
    parent = SimpleNamespace(convergence={"converged": not parents_too})
    monkeypatch.setattr(job, "choose_refreshed", lambda *_: None)
    monkeypatch.setattr(job, "stored_model", lambda *_: lost)
    monkeypatch.setattr(job, "require_current", lambda *_: None)
    monkeypatch.setattr(job.parameter_sets, "get", lambda *_: parent)
    monkeypatch.setattr(job, "point", lambda _, one, expected: pointed.append(one))
    place, begin = cast("Warehouse", None), (ModelSpec(), job.NONE_OF_ONES_OWN)
    if parents_too:
        # of a ship that lacks more than one effect none of the models may converge
        assert job.add_effect(place, "late", "gyro_scale", begin=begin) is lost
        return
    with pytest.raises(DataRejected, match=r"did not converge \(the iterations allowed ran out\)"):
        job.add_effect(place, "late", "gyro_scale", begin=begin)
    assert pointed == []
