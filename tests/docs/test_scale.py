"""docs/scale.md: its figures are those of the last measurement, computed and not typed."""

import json

import pytest

from benchmarks import fleet_page, result_page


def test_the_figures_are_computed_from_the_last_measurement() -> None:
    text = fleet_page.SCALE.read_text(encoding="utf-8")
    if not fleet_page.FIGURES.is_file():
        pytest.skip("no fleet was measured: python -m benchmarks.fleet")
    figures = json.loads(fleet_page.FIGURES.read_text(encoding="utf-8"))
    assert fleet_page.with_figures(text, figures) == text
    page = (result_page.RESULTS / "fleet.md").read_text(encoding="utf-8")
    assert "\n".join(fleet_page.lines(figures)) in page
