"""kempf effects: the catalogue on the terminal and as JSON."""

from __future__ import annotations

from pathlib import Path

from kempf.schemas.effects import catalogue
from kempf.schemas.symbols import SYMBOLS, TARGETS
from tests.workbench.driving import kempf, refused

DOCUMENT = Path(__file__).parents[2] / "docs" / "effects.md"


def test_list() -> None:
    output = kempf("effects", "list")
    assert output.code == 0
    lines = [line for line in output.out.splitlines()[1:] if not line.startswith(" ")]
    assert [line.split()[0] for line in lines] == list(catalogue())
    assert max(map(len, output.out.splitlines())) <= 100
    hull = kempf("effects", "list", "--group", "hull")
    rows = [line for line in hull.out.splitlines() if not line.startswith(" ")]
    assert len(rows) == 1 + sum(e.group == "hull" for e in catalogue().values())


def test_list_as_json_says_everything() -> None:
    output = kempf("effects", "list", "--json").json
    assert [one["name"] for one in output] == list(catalogue())
    assert {"title", "group", "plain", "equation", "reference", "parameters", "terms", "needs", "sha256"} <= set(
        output[0]
    )


def test_the_table_of_the_document() -> None:
    assert kempf("effects", "list", "--markdown").out in DOCUMENT.read_text(encoding="utf-8")


def test_show() -> None:
    output = kempf("effects", "show", "rudder_lag")
    assert output.code == 0
    for words in ("first-order rudder lag", "distinguished by:", "dead_time", "tau", "time constant of the lag"):
        assert words in output.out
    assert kempf("effects", "show", "rudder_lag", "--json").json["parameters"][0]["unit"] == "s"
    assert "not looked for" not in output.out
    assert "not looked for where the logs have: speed_through_water" in kempf("effects", "show", "speed_loss").out


def test_show_symbols() -> None:
    output = kempf("effects", "show", "--symbols")
    assert output.code == 0
    listed = {line.split()[0] for line in output.out.splitlines() if line.strip()}
    assert {*SYMBOLS, *TARGETS} <= listed
    as_json = kempf("effects", "show", "--symbols", "--json").json
    assert set(as_json["symbols"]) == set(SYMBOLS)
    assert as_json["functions"]["max"] == 2


def test_what_is_not_there_is_reported() -> None:
    refused(kempf("effects", "show", "yaw_quadratics", "--json"), 4, "effect_unknown")
    refused(kempf("effects", "show", "--json"), 2, "usage")
    refused(kempf("effects", "list", "--group", "colour", "--json"), 2, "usage")
