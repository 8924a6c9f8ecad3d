"""An effect that makes predictions worse is stored and does not become the current model by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from kempf.flows.jobs import add_effect as job
from kempf.pipeline.diagnose import matters
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.parameter_set import ParameterSet
from kempf.warehouse.store import Warehouse


def made(**samples: tuple[float | None, float | None]) -> ParameterSet:
    """A set whose rung compares so with the one below: part by which the misfit falls, and that in standard errors."""
    beside = {name: {"falls_by": f, "in_std": t, "better": 1, "of": 9} for name, (f, t) in samples.items()}
    rung: dict[str, Any] = {"one_leg_ahead": {"beside_the_rung_below": beside}}
    return cast("ParameterSet", SimpleNamespace(fit={"rung": rung}, parameter_set_id="ps-1"))


def test_what_is_worse_is_said_with_its_figure() -> None:
    assert job.worsening(made(fitted=(0.3, 4.0), left_out=(0.2, 3.0), held_out=(-0.5, -1.0))) == []
    # sure, and by less than anybody would notice
    assert job.worsening(made(fitted=(-0.004, -6.0))) == []
    (said,) = job.worsening(made(fitted=(0.3, 4.0), held_out=(-0.5, -2.5)))
    assert "held out" in said and "50 %" in said and "2.5 standard errors" in said
    (said,) = job.worsening(made(left_out=(-1.0, None)))
    assert "diverges" in said


def test_bounds_are_those_of_the_diagnosis() -> None:
    assert (job.WORSE, job.LEAST_RISE) == (matters.WORSE, matters.LEAST_RISE)


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
