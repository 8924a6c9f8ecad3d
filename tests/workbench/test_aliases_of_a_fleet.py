"""Two vessels, both with a `current` set: --vessel says whose is meant, in every command that takes a set."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from typing import Any

import pytest
import yaml

from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets
from kempf.workbench.documents.compared_sets import without_dimension
from tests.conftest import Ship
from tests.workbench.driving import kempf, refused
from tests.workbench.web.conftest import client_of

#: two vessels, and which log of the one simulated ship is hers
FLEET = {"cutter": "csv", "sloop": "nmea"}
COMMANDS = (
    ("params", "show"),
    ("params", "steering"),
    ("params", "export"),
    *(("export", f) for f in ("yaml", "csv", "control")),
)


@pytest.fixture(scope="module")
def fleet(ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("fleet")
    place = ("--warehouse", folder / "w", "--json")
    for name, ending in FLEET.items():
        log, profile = folder / f"{name}.{ending}.gz", folder / f"{name}.yaml"
        log.write_bytes(getattr(ferry, ending))
        profile.write_text(yaml.safe_dump({**ferry.profile, "vessel": name}), encoding="utf-8")
        assert kempf("ingest", log, "--profile", profile, *place).code == 0
        (made, *_) = kempf("identify", "--vessel", name, "--estimator", "least-squares", *place).json
        assert kempf("params", "alias", "current", made["parameter_set_id"], *place).code == 0
    return place


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_vessel_says_whose_current_set_is_meant(fleet: Any, words: tuple[str, ...]) -> None:
    refused(kempf(*words, *fleet), 2, "alias_ambiguous")
    refused(kempf(*words, "current", *fleet), 2, "alias_ambiguous")
    pointed = aliases.of_vessel(Warehouse(str(fleet[1])), "sloop")
    for given in (("current",), ()):
        shown = kempf(*words, *given, "--vessel", "sloop", *fleet)
        assert shown.code == 0, shown
        assert pointed["current"] in str(shown.out)


def test_the_others_take_a_vessel_too(fleet: Any) -> None:
    wanted = kempf("params", "show", "current", "--vessel", "cutter", *fleet).json["parameter_set_id"]
    pointed = kempf("params", "alias", "as-built", "current", "--vessel", "cutter", *fleet).json
    assert (pointed["vessel"], pointed["parameter_set_id"]) == ("cutter", wanted)
    compared = kempf("params", "diff", "current", "as-built", "--vessel", "cutter", *fleet).json
    assert (compared["first"], compared["second"]) == (wanted, wanted)
    assert kempf("rerun", "current", "--vessel", "cutter", *fleet).json["parameter_set_id"] == wanted
    refused(kempf("params", "show", "as-built", "--vessel", "sloop", *fleet), 4, "no_parameter_set")
    refused(kempf("rerun", "current", "--vessel", "cutter", "--vessel", "sloop", *fleet), 2, "only_with_all")


def test_two_vessels_are_compared_without_dimension_too(fleet: Any) -> None:
    warehouse = Warehouse(str(fleet[1]))
    one, other = (aliases.of_vessel(warehouse, name)["current"] for name in FLEET)
    found = kempf("params", "diff", one, other, *fleet).json["nondimensional"]
    assert list(found) == ["a11'", "a12'", "a21'", "a22'", "b1'", "b2'", "K'", "T'"]
    said = kempf("params", "steering", one, *fleet).json["nomoto"]["constants"]
    for name in ("K'", "T'"):
        assert found[name]["first"] == pytest.approx(said[name]["value"], rel=1e-9)
        assert found[name]["difference"] / found[name]["in_std"] == pytest.approx(
            hypot(
                said[name]["std"], kempf("params", "steering", other, *fleet).json["nomoto"]["constants"][name]["std"]
            )
        )
    printed = kempf("params", "diff", one, other, *fleet[:-1]).out
    assert "Without their dimension" in printed and "K'" in printed
    assert "K'" not in kempf("params", "diff", one, one, *fleet[:-1]).out
    with client_of(fleet[1], fleet[1].parent / "state") as client:
        page = client.get(f"/compare?a={one}&b={other}").text
        assert "K&#39;" in page and "ships of one form" in page


def test_a_ship_twice_as_long_of_the_same_form_is_the_same_without_dimension(fleet: Any) -> None:
    warehouse = Warehouse(str(fleet[1]))
    one = parameter_sets.get(warehouse, aliases.of_vessel(warehouse, "cutter")["current"])
    # a21 and b2 go with the second power of the length, a12 with none
    by = {name: 2.0**-power for name, power in zip(one.covariance_names, (1, 0, 2, 1, 1, 2), strict=False)}
    long = replace(
        one,
        parameters=tuple(
            replace(p, value=by[p.name] * p.value, std=None if p.std is None else by[p.name] * p.std)
            for p in one.parameters
        ),
        covariance=tuple(
            tuple(by[a] * by[b] * v for b, v in zip(one.covariance_names, row, strict=True))
            for a, row in zip(one.covariance_names, one.covariance, strict=True)
        ),
    )
    short, other = without_dimension(one, 60.0), without_dimension(long, 120.0)
    assert short is not None and other is not None and len(short) == 8
    for p, q in zip(short, other, strict=True):
        assert (p.value, p.std) == pytest.approx((q.value, q.std), rel=1e-9)
    assert without_dimension(one, None) is None
