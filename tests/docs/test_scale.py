"""docs/scale.md: its figures are those of the last measurement, computed and not typed."""

import copy
from typing import Any

import pytest

from benchmarks import result_page
from benchmarks.fleet import fleet_figures, fleet_page, fleet_scale
from kempf.flows.fleet import plan


def _figures() -> dict[str, Any]:
    """A made-up measurement with round figures: 8 batches of 5 vessels, one core second a vessel."""
    cost = {"wall_s": 0.2, "cpu_s": 0.1}
    writers = {"1": {"a_second": 4.0, "cpu_s": 0.1}, "2": {"a_second": 5.0, "cpu_s": 0.125}}
    run = {"wall_s": 25.0, "cpu_s": 40.0, "plan_s": 0.1, "changed": 1, "sets": 40, "reread": 160, "vessels": 40}
    whole = {**run, "batches": 8, "engine_share": 0.04, "commits": {"parameter_sets": 16, "runs": 8, "vessels": 0}}
    size = {"vessels": 1000, "files": 1000, "read": cost, "one": cost, "together": cost, "writers": writers}
    return {
        "vessels": 40,
        "logs": 4,
        "cores": 2,
        "steps": [{"vessels": n, "new": 20, "take_in_s": 1.0, "first": run, "again": run} for n in (20, 40)],
        "whole": whole,
        "again": run,
        "one": run,
        "subset": 24,
        "pairs": [
            {"engine": {"wall_s": 2.0, "cpu_s": 1.0}, "plain": {"wall_s": plain, "cpu_s": 0.98}}
            for plain in (1.8, 2.4, 1.9)
        ],
        "dask_s": {"1": 2.0, "2": 1.0},
        "dask_of": 4,
        "commits": {"table": "parameter_sets", "together": 20, "times": 7, "shared": 12, "sizes": [size]},
        "bytes": {"raw": 1, "runs": 1},
    }


def test_the_figures_are_computed_from_the_last_measurement() -> None:
    text = fleet_scale.SCALE.read_text(encoding="utf-8")
    figures = fleet_figures.stored()
    assert fleet_scale.with_figures(text, figures) == text
    page = (result_page.RESULTS / "fleet.md").read_text(encoding="utf-8")
    assert "\n".join(fleet_page.lines(figures)) in page
    assert figures["commits"]["sizes"][-1]["vessels"] == 10_000  # the fleet that the words around them are about


def test_a_large_fleet_costs_its_work_and_its_commits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan, "LOGS_A_BATCH", 20)
    whole = fleet_scale.large(_figures(), 1000)
    # 4,000 logs, twenty a batch: 200 batches of five and a few more, since the last ones are smaller; three commits
    # each, two of them to one table
    assert 200 < whole.batches < 210
    assert (whole.most, whole.busiest, whole.commits) == (5, "parameter_sets", 2.0 * whole.batches)
    assert whole.core_s == pytest.approx(1000.0)
    assert whole.commit_core_s == pytest.approx(whole.batches * 3 * 0.125)
    assert whole.serial_s == pytest.approx(2 * whole.batches / 5)
    assert whole.full_from == pytest.approx((1000.0 + whole.commit_core_s) / whole.serial_s)
    assert whole.cores_a_night == 1


@pytest.mark.parametrize(("a_second", "cpu_s", "first"), [(5.0, 0.1, "the cores"), (0.002, 100.0, "the commits")])
def test_what_is_full_first_comes_out_of_the_figures(a_second: float, cpu_s: float, first: str) -> None:
    figures = copy.deepcopy(_figures())
    figures["commits"]["sizes"][-1] |= {"writers": {"1": {"a_second": a_second, "cpu_s": cpu_s}}}
    assert fleet_scale.lines(figures)[0].startswith(f"**First full: {first}")


def test_a_share_comes_with_its_spread() -> None:
    assert fleet_page.against_threads(_figures(), "wall_s") == "5.0 % (-20.0 to 10.0)"
    assert "5.0 % (-20.0 to 10.0)" in "\n".join(fleet_page.lines(_figures()))


def test_threads_are_held_against_dask_workers_of_the_same_run_only() -> None:
    stated = "threads of one process over two Dask workers, 24 vessels, on the clock | 2.00 |"
    assert stated in "\n".join(fleet_page.lines({**_figures(), "dask_of": 40}))
    assert "over two Dask workers" not in "\n".join(fleet_page.lines(_figures()))


def test_figures_of_an_older_form_are_refused_in_one_sentence(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet_figures, "FIGURES", tmp_path / "fleet.json")
    old = {key: value for key, value in _figures().items() if key != "commits"}
    fleet_figures.store(old)
    with pytest.raises(fleet_figures.OldFigures, match=r"^fleet.json lacks commits: measure anew by `[^`]*`\.$"):
        fleet_figures.stored()
    fleet_figures.store(_figures())
    assert fleet_figures.stored() == _figures()
