from __future__ import annotations

import json
from dataclasses import asdict, replace

import pytest

from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, provenance
from kempf.warehouse.tables.agreement import content_digest, differences, verdict
from kempf.warehouse.tables.parameter_set import Bounds, ParameterSet, StoredValue, ids_of_each, parameter_set_id
from tests.warehouse.samples import START_NS, inputs, parameter_set


def as_text(one: ParameterSet) -> str:
    return canonical_json(asdict(one), name_non_finite=True)


def nudged(one: ParameterSet, factor: float) -> ParameterSet:
    first = one.parameters[0]
    return replace(one, parameters=(replace(first, value=first.value * factor), *one.parameters[1:]))


def test_it_comes_back_bit_for_bit(warehouse: Warehouse) -> None:
    given = parameter_set()
    assert parameter_sets.insert(warehouse, [given]) == (given.parameter_set_id,)
    stored = parameter_sets.get(warehouse, given.parameter_set_id)
    assert as_text(stored) == as_text(given)
    assert content_digest(stored) == content_digest(given)
    assert verdict(given, stored) == ("bit-identical", [])


def test_inserting_again_makes_no_commit(warehouse: Warehouse) -> None:
    given = parameter_set()
    parameter_sets.insert(warehouse, [given, given])
    version = delta.versions(warehouse)
    later = replace(given, parent="ps-other", provenance={**given.provenance, "flow_run": "run-2"})
    assert parameter_sets.insert(warehouse, [later]) == ()
    assert delta.versions(warehouse) == version == {"parameter_sets": 1}
    assert parameter_sets.get(warehouse, given.parameter_set_id).parent is None


def test_another_content_under_one_id_is_refused(warehouse: Warehouse) -> None:
    given = parameter_set()
    parameter_sets.insert(warehouse, [given])
    other = nudged(replace(given, provenance={"packages": {"numpy": "9"}}), 1 + 1e-15)
    fresh = parameter_set(made_of=inputs("d" * 64))
    with pytest.raises(KempfError) as caught:
        parameter_sets.insert(warehouse, [fresh, other])
    assert caught.value.code == "parameter_set_differs"
    assert "parameters.a11.value" in caught.value.message
    assert "numpy" in caught.value.message
    assert caught.value.details["differences"][0]["field"] == "parameters.a11.value"
    assert parameter_sets.summaries(warehouse).height == 1  # the fresh one waits for the quarrel to end
    json.dumps(caught.value.as_json(), allow_nan=False)


def test_the_id_is_a_function_of_every_input() -> None:
    same = parameter_set_id(inputs())
    assert same == parameter_set_id(inputs())
    assert len(same) == 19
    bounds = (Bounds("a" * 64, 5, 6), Bounds("a" * 64, 1, 2))
    assert parameter_set_id(inputs(bounds=bounds)) == parameter_set_id(inputs(bounds=bounds[::-1]))
    others = [
        inputs("e" * 64),
        inputs(start_utc_ns=START_NS + 1),
        inputs(profile_sha256="x"),
        inputs(model_spec={"name": "linear", "effects": ["drag"]}),
        inputs(estimator="paper"),
        inputs(settings={"tolerance": 1e-9, "upper": None}),
        inputs(settings={"tolerance": 1.0000000000000002e-9, "upper": float("inf")}),
        inputs(code_version="other"),
    ]
    assert len({same, *(parameter_set_id(one) for one in others)}) == len(others) + 1


def test_ids_of_many_segments_are_those_of_each() -> None:
    """What they have in common may name anything, and bounds may be any whole numbers."""
    common = replace(
        inputs(), log_ids=(), bounds=(), settings={"own": {"x": 'named "\0log" or \0segment, é'}, "bound": float("inf")}
    )
    bounds = [Bounds("a" * 64, 0, 1), Bounds("b" * 64, -1, 2**62), Bounds("named é", START_NS, START_NS + 1)]
    each = [parameter_set_id(replace(common, log_ids=(one.log_id,), bounds=(one,))) for one in bounds]
    assert ids_of_each(common, bounds) == each and len(set(each)) == 3
    assert ids_of_each(common, []) == []


def test_ids_may_be_shortened_while_they_are_unique(warehouse: Warehouse) -> None:
    ids = [parameter_sets.insert(warehouse, [parameter_set(made_of=inputs(c * 64))])[0] for c in "abcde"]
    assert parameter_sets.get(warehouse, ids[0][:-2]).parameter_set_id == ids[0]
    with pytest.raises(UsageError) as ambiguous:
        parameter_sets.get(warehouse, "ps-")
    assert ambiguous.value.code == "ambiguous_parameter_set"
    for name in ("", "ps-zz", "' OR '1'='1"):
        with pytest.raises(NotFound) as caught:
            parameter_sets.get(warehouse, name)
        assert caught.value.code == "no_parameter_set"


def test_it_shows_itself_as_json(warehouse: Warehouse) -> None:
    shown = parameter_set().as_json()
    keys = {"parameter_set_id", "vessel", "model", "estimator", "parameters", "noise", "fit", "provenance"}
    assert keys <= shown.keys()
    assert shown["parameters"]["a11"] == {"value": -0.1, "std": 0.01, "unit": "1/m"}
    assert shown["parameters"]["b2"]["std"] is None
    assert shown["covariance"]["values"][1][1] is None
    json.dumps(shown, allow_nan=False)


def test_malformed_ones_cannot_be_made() -> None:
    with pytest.raises(ValueError, match="share a name"):
        parameter_set(parameters=(StoredValue("a", 1.0, None, "1"), StoredValue("a", 2.0, None, "1")))
    with pytest.raises(ValueError, match="covariance of 2"):
        parameter_set(covariance=((1.0,), (2.0,)))
    with pytest.raises(TypeError, match="set"):
        parameter_set(fit={"x": {1, 2}})


def test_the_verdict_separates_bits_tolerance_and_difference() -> None:
    one = parameter_set()
    close, far = nudged(one, 1 + 1e-12), nudged(one, 1.5)
    assert verdict(one, close, 1e-9)[0] == "equal within tolerance"
    assert [d.field for d in verdict(one, close, 1e-9)[1]] == ["parameters.a11.value"]
    assert verdict(one, far, 1e-9)[0] == "different"
    assert verdict(one, close, 0.0)[0] == "different"
    (found,) = differences(one, far, 1e-9)
    assert found.relative == pytest.approx(1 / 3)
    assert differences(one, far, 0.4) == []


def test_sizes_are_those_of_the_errors() -> None:
    one = parameter_set(covariance=((1e-4, 1e-20), (1e-20, 1e-4)))
    noisy = replace(one, covariance=((1e-4, 5e-20), (5e-20, 1e-4)))
    assert verdict(one, noisy, 1e-9)[0] == "equal within tolerance"  # against 1e-4, not against 1e-20
    zero = parameter_set(parameters=(StoredValue("a11", 0.0, 0.01, "1/m"),))
    tiny = replace(zero, parameters=(StoredValue("a11", 1e-14, 0.01, "1/m"),))
    assert verdict(zero, tiny, 1e-9)[0] == "equal within tolerance"


def test_numbers_on_the_path_count_for_bits_only() -> None:
    one = parameter_set()
    path = replace(one, convergence={"converged": True, "gradient": 7e-11})
    assert verdict(one, path)[0] == "equal within tolerance"
    assert differences(one, path) != []
    assert verdict(one, replace(one, convergence={"converged": False, "gradient": 1e-13}))[0] == "different"


@pytest.mark.parametrize(
    "change",
    [
        {"warnings": ()},
        {"covariance": ((1e-4, 0.0), (-0.0, float("nan")))},
        {"noise": (StoredValue("sigma_r", 5e-4, 1e-5, "deg/s"),)},
        {"parameters": (StoredValue("b2", 1 / 3, None, "1/m^2"), StoredValue("a11", -0.1, 0.01, "1/m"))},
        {"fit": {"yaw_rate": {"fit_percent": 91}}},
        {"segment_ids": ("seg-1", "seg-2")},
        {"start_utc_ns": START_NS + 1},
    ],
)
def test_every_change_of_content_changes_the_digest(change) -> None:
    one = parameter_set()
    other = replace(one, **change)
    assert content_digest(one) != content_digest(other)
    assert differences(one, other) != []


def test_digest_and_differences_agree_on_where_it_came_from() -> None:
    one = parameter_set()
    elsewhere = replace(one, provenance={"git_commit": "abc"}, parent="ps-0", parameter_set_id="ps-1")
    assert content_digest(one) == content_digest(elsewhere)
    assert differences(one, elsewhere) == []


def test_provenance_says_what_a_rerun_needs(warehouse: Warehouse) -> None:
    made_of = inputs()
    parameter_sets.insert(warehouse, [parameter_set()])
    found = provenance.collect(warehouse, made_of, ["b", "a", "a"], flow_run="run-1")
    assert parameter_set_id(made_of) == parameter_set().parameter_set_id
    assert found["ingest_ids"] == ["a", "b"]
    assert found["table_versions"] == {"parameter_sets": 1}
    assert found["packages"].keys() == {"deltalake", "numba", "numpy", "polars", "pyarrow", "scipy"}
    assert found["inputs"]["settings"]["upper"] == "inf"
    assert provenance.collect(None, made_of, [])["table_versions"] == {}
    stored = replace(parameter_set(), provenance=found)
    assert stored.provenance == found  # nothing in it that JSON does not know


def test_an_alias_moves_and_the_sets_stay(warehouse: Warehouse) -> None:
    first, second = parameter_set(), parameter_set(made_of=inputs("d" * 64))
    parameter_sets.insert(warehouse, [first, second])
    assert aliases.point(warehouse, "aurora", first.parameter_set_id)
    version = delta.versions(warehouse)
    assert not aliases.point(warehouse, "aurora", first.parameter_set_id[:12])
    assert delta.versions(warehouse) == version
    assert aliases.point(warehouse, "aurora", second.parameter_set_id)
    assert aliases.point(warehouse, "aurora", first.parameter_set_id, "as-built")
    assert aliases.of_vessel(warehouse, "aurora") == {
        "as-built": first.parameter_set_id,
        "current": second.parameter_set_id,
    }
    assert aliases.holders(warehouse, "as-built") == {"aurora": first.parameter_set_id}
    for name in ("best ' of all", "ps-0123", ""):
        with pytest.raises(UsageError) as refused:
            aliases.point(warehouse, "aurora", first.parameter_set_id, name)
        assert refused.value.code == "alias_invalid"
    assert aliases.of_vessel(warehouse, "boreas") == {}
    assert delta.versions(warehouse)["parameter_sets"] == version["parameter_sets"]
    with pytest.raises(NotFound):
        aliases.point(warehouse, "aurora", "ps-nowhere")
    with pytest.raises(UsageError) as caught:
        aliases.point(warehouse, "boreas", first.parameter_set_id)
    assert caught.value.code == "set_of_another_vessel"


def test_the_profile_json_of_the_id_is_the_one_stored() -> None:
    profile = VesselProfile(length_m=58.0)
    assert parameter_set_id(inputs(profile_sha256=profile.sha256)) != parameter_set_id(inputs())
