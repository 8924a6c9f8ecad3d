"""The page of figures to reach reads every figure of ours off the pages that the benchmarks have written."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.aims.figures import FIGURES, Figure, shown
from benchmarks.aims.written_page import section, sections


@pytest.mark.parametrize("figure", FIGURES, ids=lambda one: one.what[:30])
def test_every_figure_is_on_its_page(figure: Figure) -> None:
    what, *_, ours, pages = shown(figure)
    assert what == figure.what and pages
    assert "not on its page" not in ours and any(letter.isdigit() for letter in ours)


def test_a_page_is_read_by_its_headings(tmp_path: Path) -> None:
    tables = "| a | b |\n| --- | --- |\n| 1 | -2.5 |\n\n| c |\n| --- |\n| x or y |\n"
    page = f"# All\n\nOf two, 40 % held.\n\n{tables}\n## Next\n"
    (tmp_path / "one.md").write_text(page, encoding="utf-8")
    first = section("one", "All", tmp_path)
    assert first.found(r"(\d+) %") == "40" and first.found("never (said)") == ""
    assert first.rows == [{"a": "1", "b": "-2.5"}, {"c": "x or y"}]
    assert section("one", "Next", tmp_path).rows == [] and len(sections("one", tmp_path)) == 2
    assert sections("another", tmp_path) == [] and section("another", "All", tmp_path).rows == []
