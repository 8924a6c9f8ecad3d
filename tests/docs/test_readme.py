"""README, first logs and tables are true: the commands of each run in an empty folder and print what the page shows."""

from pathlib import Path

import pytest

from tests.docs.console import Names, blocks, difference, follow, sailed, same_line

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("page", "commands"), [("README", 7), ("docs/first_logs", 16), ("docs/tables", 3)])
def test_pages_show_what_their_commands_print(page: str, commands: int, late_ingested: Path, tmp_path: Path) -> None:
    text = (ROOT / f"{page}.md").read_text(encoding="utf-8")
    before = [f"export PYTHONPATH='{ROOT}'", "unset KEMPF_WAREHOUSE"]
    if page != "README":  # which sails the ship, as one page has to
        before.append(sailed(late_ingested))
    assert follow(text, tmp_path, *before) == commands


def test_readme_fits_its_page_and_its_tour_a_screen() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.count("\n") <= 130
    assert sum(len(lines) for kind, _, lines in blocks(text) if kind == "console") <= 45


@pytest.mark.parametrize(
    ("shown", "found", "same"),
    [
        ("b2  6.315e-05  6.6e-07", "b2  6.316e-05   6.6e-07", True),
        ("b2  6.315e-05", "b2  6.317e-05", False),
        ("K0 264", "K0 263.9", True),
        ("a 0.0003", "a 0.00031", True),
        ("error -0.0", "error +0.1", True),
        ("48645 records", "48646 records", False),
        ("2 zigzags", "3 zigzags", False),
        ("converged", "NOT CONVERGED", False),
        ("1/m^2", "1/m", False),
        ("-0.004754406747221156", "-0.004754406747333156", True),
        ("-0.004754406747221156", "-0.004754506747221156", False),
    ],
)
def test_numbers_may_move_by_their_last_digit_and_nothing_else(shown: str, found: str, same: bool) -> None:
    assert same_line(shown, found, Names()) is same


def test_an_id_stands_for_one_thing_only() -> None:
    names = Names()
    assert same_line("set ps-0123456789abcdef", "set ps-fedcba9876543210", names)
    assert names.resolved("kempf rerun ps-0123456789abcdef") == "kempf rerun ps-fedcba9876543210"
    assert not same_line("set ps-0123456789abcdef", "set ps-0000000000000000", names)


def test_left_out_lines_may_be_any() -> None:
    assert difference(("a", "...", "z"), ["a", "b", "c", "z"], Names()) is None
    assert difference(("a", "...", "z"), ["a", "b", "c"], Names()) is not None
    assert difference((), ["a"], Names()) is not None
    assert difference(("a", ""), ["a"], Names()) is None
    assert difference(("a",), ["a", "b"], Names()) is not None
