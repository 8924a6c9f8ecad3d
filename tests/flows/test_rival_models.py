"""Which stored sets count as rivals of a set: other effects, everything else alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from kempf.flows.jobs.diagnose import rival_models
from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses, parameter_sets
from kempf.warehouse.tables.diagnoses import StoredDiagnosis
from kempf.warehouse.tables.parameter_set import ParameterSet
from tests.warehouse.samples import inputs, parameter_set


def of_model(
    effects: tuple[str, ...], code: str = "c0de", estimator: str = "ml-pooled", search: Any = None, **model: Any
) -> ParameterSet:
    spec = ModelSpec(**model, effects=effects).model_dump(mode="json")
    settings = {"search": search} if search else {}
    return parameter_set(
        made_of=inputs(model_spec=spec, code_version=code, estimator=estimator, settings=settings), settings=settings
    )


@pytest.fixture
def drag(tmp_path: Path) -> tuple[Warehouse, ParameterSet]:
    """A vessel whose diagnosis does not distinguish drag from drift cubed."""
    warehouse, drag = Warehouse(str(tmp_path / "w")), of_model(("cross_flow_drag",))
    parameter_sets.insert(warehouse, [drag])
    content = {"sets": [{"effects": ["cross_flow_drag", "yaw_v3"]}]}
    made_of = drag.provenance["inputs"]
    diagnosis = StoredDiagnosis(
        *("dx-1", drag.vessel, drag.parameter_set_id, drag.start_utc_ns, "ambiguous", ("cross_flow_drag", "yaw_v3")),
        *(content, made_of, "c0de"),
    )
    assert diagnoses.insert(warehouse, diagnosis)
    return warehouse, drag


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """The effects of the models that are fitted, as no stored set is theirs."""
    asked: list[tuple[str, ...]] = []

    def noted(_: Warehouse, beside: ParameterSet, effects: tuple[str, ...], __: object) -> ParameterSet:
        asked.append(effects)
        return replace(beside, parameter_set_id="ps-fitted")

    monkeypatch.setattr(rival_models, "_made", noted)
    return asked


def test_a_stored_set_with_the_other_effect_is_read(
    drag: tuple[Warehouse, ParameterSet], fitted: list[tuple[str, ...]]
) -> None:
    warehouse, own = drag
    # of a file of another name, and above another parent
    cubed = of_model(("yaw_v3",), name="from a file", parent="ps-1")
    parameter_sets.insert(warehouse, [cubed])
    found = rival_models.rivals_of(warehouse, own)
    assert [rival.parameter_set_id for rival in found.sets] == [cubed.parameter_set_id]
    assert not fitted and not found.remarks


def test_a_diagnosis_of_the_model_with_its_effects_parts_nothing(
    drag: tuple[Warehouse, ParameterSet], fitted: list[tuple[str, ...]]
) -> None:
    warehouse, own = drag
    made_of = own.provenance["inputs"]
    # as `kempf report` stores one; its id may come before the other's or after it
    for name in ("dx-0", "dx-2"):
        about = (name, own.vessel, own.parameter_set_id, own.start_utc_ns, "unexplained", ())
        assert diagnoses.insert(warehouse, StoredDiagnosis(*about, {"sets": []}, made_of, "c0de"))
    rival_models.rivals_of(warehouse, own)
    assert fitted == [("yaw_v3",)]


def test_the_newest_diagnosis_of_a_fleet_is_of_the_plain_model(drag: tuple[Warehouse, ParameterSet]) -> None:
    warehouse, own = drag
    began = {"model": {"effects": ["cross_flow_drag"]}}
    about = ("dx-2", own.vessel, own.parameter_set_id, own.start_utc_ns, "unexplained", ())
    diagnoses.insert(warehouse, StoredDiagnosis(*about, {"sets": []}, began, "c0de"))
    plain = {**own.provenance["inputs"], "model": {"effects": []}}
    about = ("dx-1b", own.vessel, "ps-plain", own.start_utc_ns, "ambiguous", ("yaw_v3",))
    diagnoses.insert(warehouse, StoredDiagnosis(*about, {"sets": []}, plain, "c0de"))
    assert diagnoses.newest(warehouse)[own.vessel].diagnosis_id == "dx-1b"


@pytest.mark.parametrize(
    "otherwise",
    [
        *({"current": "none"}, {"rudder_speed_exponent": 1.0}, {"code": "0lder"}, {"estimator": "ml"}),
        {"search": {"starts": 3}},
    ],
    ids=["current", "rudder", "code", "estimator", "search"],
)
def test_one_that_differs_in_more_is_no_rival(
    drag: tuple[Warehouse, ParameterSet], fitted: list[tuple[str, ...]], otherwise: dict[str, Any]
) -> None:
    warehouse, own = drag
    parameter_sets.insert(warehouse, [of_model(("yaw_v3",), **otherwise)])
    found = rival_models.rivals_of(warehouse, own)
    assert [rival.parameter_set_id for rival in found.sets] == ["ps-fitted"]
    assert fitted == [("yaw_v3",)]


def test_where_other_manoeuvres_are_chosen_by_now_none_is_fitted(
    drag: tuple[Warehouse, ParameterSet], monkeypatch: pytest.MonkeyPatch
) -> None:
    warehouse, own = drag
    profile = own.provenance["inputs"]["profile_sha256"]
    nothing = Chosen(own.vessel, profile, "c0de", (), {}, {}, {})
    monkeypatch.setattr(rival_models, "choose", lambda *_: nothing)
    found = rival_models.rivals_of(warehouse, own)
    assert not found.sets and "would rest on other manoeuvres" in found.remarks[0]
    assert found.remarks[0].startswith("yaw_v3 fits as well and is not among the models")


@pytest.mark.parametrize(
    ("effects", "verdict", "says"),
    [
        ((), "partly_explained", "dx-9 found that the model lacks cross_flow_drag or yaw_v3 and wind_force"),
        (("yaw_v3",), "explained", "dx-9 found that the model lacks wind_force"),
        (("yaw_v3", "wind_force"), "partly_explained", "dx-9 says partly explained: what no known effect explains"),
        (("yaw_v3", "wind_force"), "explained", ""),
    ],
)
def test_what_diagnoses_of_it_or_of_less_say_against_a_model(
    tmp_path: Path, effects: tuple[str, ...], verdict: str, says: str, fitted: list[tuple[str, ...]]
) -> None:
    warehouse, own, plain = Warehouse(str(tmp_path / "w")), of_model(effects), of_model(())
    parameter_sets.insert(warehouse, [own])
    content = {"sets": [{"effects": ["cross_flow_drag", "yaw_v3"]}, {"effects": ["wind_force"]}]}
    about = ("dx-9", plain.vessel, plain.parameter_set_id, plain.start_utc_ns, verdict, ("wind_force",))
    assert diagnoses.insert(warehouse, StoredDiagnosis(*about, content, plain.provenance["inputs"], "c0de"))
    against = rival_models.rivals_of(warehouse, own).against
    assert len(against) == bool(says)
    assert all(sentence.startswith(says) for sentence in against)


@pytest.mark.parametrize(
    ("verdict", "more", "said"),
    [
        ("adequate", {}, ()),
        ("unexplained", {}, ("dx-1 says unexplained: what no known effect explains is in no interval",)),
        (
            *("insufficient_data", {"unresolved": {"channel": "rudder"}}),
            ("dx-1 says that readings are too far apart: what the model may lack is in no interval",),
        ),
    ],
)
def test_what_a_diagnosis_leaves_is_said_against_the_model(
    tmp_path: Path, verdict: str, more: dict[str, Any], said: tuple[str, ...]
) -> None:
    warehouse, own = Warehouse(str(tmp_path / "w")), of_model(())
    parameter_sets.insert(warehouse, [own])
    about = ("dx-1", own.vessel, own.parameter_set_id, own.start_utc_ns, verdict, ())
    assert diagnoses.insert(warehouse, StoredDiagnosis(*about, {"sets": [], **more}, own.provenance["inputs"], "c0de"))
    assert rival_models.rivals_of(warehouse, own).against == said
