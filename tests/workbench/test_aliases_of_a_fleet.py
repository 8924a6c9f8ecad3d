"""Two vessels, both with a `current` set: --vessel says whose is meant, in every command that takes a set."""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from kempf.warehouse import aliases
from kempf.warehouse.store import Warehouse
from tests.conftest import Ship
from tests.workbench.driving import kempf, refused

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
