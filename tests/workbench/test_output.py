"""What a person sees first, and how wide a table becomes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from kempf.workbench.ranked_warnings import of_several, ranked
from kempf.workbench.terminal import WIDEST, print_table, short_ids
from tests.workbench.driving import kempf, one_of

WARNINGS = (
    "4 gross errors of heading left out",
    "2 gross errors of yaw_rate left out",
    "only 80 % of heading lie in their 95 % prediction interval",
    "the wind is taken to act without a moment",
    "not converged: the iterations allowed ran out",
    "b2 < 0: the rudder turns the ship the wrong way; check the sign of the rudder channel",
)


def test_the_gravest_come_first_and_those_alike_are_one() -> None:
    shown = ranked(WARNINGS)
    assert [one[:10] for one in shown] == ["not conver", "b2 < 0: th", "only 80 % ", "the wind i", "4 gross er"]
    assert shown[-1].endswith("left out (likewise yaw_rate)")


def test_a_channel_is_not_named_beside_itself() -> None:
    alike = [f"errors of {name} are not white (lag {lag})" for name, lag in (("heading", 1), ("heading", 2))]
    assert ranked(alike) == [f"{alike[0]} (and 1 alike)"]
    assert ranked([*alike, "errors of yaw_rate are not white (lag 3)"]) == [f"{alike[0]} (likewise yaw_rate)"]


def test_a_set_prints_three_warnings_and_all_of_them_where_asked(own: Path) -> None:
    warehouse = Warehouse(str(own))
    made = replace(parameter_sets.get(warehouse, one_of(own, "ml")), parameter_set_id="ps-0", warnings=WARNINGS)
    parameter_sets.insert(warehouse, [made])
    asked = ("params", "show", "ps-0", "--warehouse", own)
    short = kempf(*asked).out
    assert short.count("  warning: ") == 3 and "  warning: not converged" in short
    assert "  2 more warnings: --verbose" in short
    assert kempf(*asked, "--verbose").out.count("  warning: ") == len(WARNINGS)
    assert kempf(*asked, "--json").json["warnings"] == list(WARNINGS)
    steered = kempf("steer", "--vessel", "mariner", "--set", "ps-0", "--minutes", "8", "--warehouse", own).out
    assert steered.count("  warning: ") == 3 and "more warnings: --verbose" in steered


def test_one_note_of_many_logs_is_said_once() -> None:
    notes = {f"day{k}.csv": [f"heading: kept {k} of 9 rows", *(["alone"] if k == 2 else [])] for k in range(10)}
    assert of_several(notes) == ["in 10 logs, such as day0.csv: heading: kept 0 of 9 rows", "in day2.csv: alone"]
    assert of_several({"day.csv": ["alone"]}) == ["alone"]


def test_a_wide_table_folds_between_words(capsys: pytest.CaptureFixture[str]) -> None:
    head = ["manoeuvre", *["lateral speed fit %"] * 6, "why"]
    row = ["seg-283f2702bb8f33bf", *["0.0371"] * 6, "a reason of " + "many words " * 20]
    print_table(head, [row, row])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= WIDEST
    assert " ".join(lines).split().count("many") == 40, "nothing is lost"
    assert sum(line.startswith("seg-") for line in lines) == 2
    print_table(["a", "b"], [["1", "x"]])
    assert capsys.readouterr().out == "a  b\n1  x\n"


def test_ids_are_long_enough_to_tell_them_apart() -> None:
    alike = ["ps-0123456789abcdef", "ps-01234567ffffffff"]
    assert short_ids(alike) == {name: name for name in alike}


@pytest.mark.parametrize(
    "arguments",
    [
        ("segments",),
        ("logs", "list"),
        ("params", "list"),
        ("vessels", "list"),
        ("history", "--vessel", "mariner"),
        ("compare", "--vessel", "mariner"),
        ("effects", "list"),
        ("effects", "show", "--symbols"),
    ],
)
def test_no_table_is_wider_than_a_hundred_columns(filled: Path, arguments: tuple[str, ...]) -> None:
    output = kempf(*arguments, *(() if arguments[0] == "effects" else ("--warehouse", filled)))
    assert output.code == 0, output
    wide = [
        line for line in output.out.splitlines() if len(line) > WIDEST and not line.startswith(("initial ", "horizon"))
    ]
    assert wide == []
