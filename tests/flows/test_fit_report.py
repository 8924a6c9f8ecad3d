"""The job that fits a model reports every iteration, counted on, and ends at what it stores."""

from __future__ import annotations

from itertools import pairwise

import pytest

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN
from kempf.flows.jobs.identify.vessel_model import errors_in_words, store_model
from kempf.flows.process.fit_report import FitReport, reported_to
from kempf.flows.process.progress import Figures, silent
from kempf.pipeline.estimate.iteration import SILENT, Iteration
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from tests.flows.content import fresh
from tests.flows.test_brought_forward import take_in


class Kept:
    """A `FitProgress` that keeps what it is reported_to."""

    def __init__(self) -> None:
        self.lines: list[tuple[int, int, str]] = []
        self.figures: list[tuple[str, Figures]] = []

    def __call__(self, done: int, total: int, what: str) -> None:
        self.lines.append((done, total, what))

    def iterated(self, done: int, total: int, what: str, figures: Figures) -> None:
        assert done <= total
        self.figures.append((what, figures))


@pytest.fixture(scope="module")
def two_days(tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    warehouse = fresh(tmp_path_factory.mktemp("two") / "w")
    for day in range(2):
        take_in(warehouse, day)
    return warehouse


def test_a_model_is_seen_being_fitted_and_its_last_figures_are_those_stored(two_days: Warehouse):
    kept = Kept()
    spec = ModelSpec().model_copy(update={"effects": ("gyro_bias",)})
    made, new = store_model(two_days, choose(two_days, "ferry"), spec, NONE_OF_ONES_OWN, kept)
    assert new
    figures = [one for _, one in kept.figures]
    assert [one.iteration for one in figures] == list(range(1, len(figures) + 1))
    assert all(b.climb in (a.climb, a.climb + 1) for a, b in pairwise(figures))
    ends = [(what, one.log_likelihood) for what, one in kept.figures if one.fitted]
    assert made.parent is not None
    parent = parameter_sets.get(two_days, made.parent)
    assert ends == [
        ("fitting the plain model", parent.convergence["log_likelihood"]),
        ("fitting gyro_bias", made.convergence["log_likelihood"]),
    ]
    assert figures[-1].fitted and len(figures) > 4
    whats = [what for _, _, what in kept.lines]
    assert "predicting one leg ahead" in whats
    assert whats[-1].startswith("gyro_bias: free-run error ")
    assert kept.lines[-1][0] == kept.lines[-1][1]


def test_a_rung_that_runs_away_is_said_to_diverge() -> None:
    rung = {"added": None, "in_sample_error": None, "held_out_error": 0.1234, "held_out": {"seg-1": {}}}
    assert errors_in_words(rung) == "the plain model: free-run error diverges fitted, 12.3 % held out"
    assert errors_in_words({**rung, "held_out_error": float("nan"), "in_sample_error": 0.05, "added": "gyro_bias"}) == (
        "gyro_bias: free-run error 5 % fitted, diverges held out"
    )
    assert errors_in_words({**rung, "held_out": {}}) == "the plain model: free-run error diverges fitted"


def test_who_takes_no_figures_is_told_in_words_and_who_listens_to_nothing_costs_nothing():
    lines: list[tuple[int, int, str]] = []
    report = FitReport(lambda done, total, what: lines.append((done, total, what)), 2)
    report.begins("fitting the plain model")
    report.iterated(Iteration(0, 1100.0, 0.045, 3))
    report.iterated(Iteration(0, 300.0, 0.05, 2))  # of a part of the runs: to be compared with nothing
    report.fitted(Iteration(1, 1234.52, float("nan"), 3))
    assert lines == [
        (0, 2, "fitting the plain model"),
        (0, 2, "fitting the plain model, iteration 1: log-likelihood 1100.0, error one step ahead 4.5 %"),
        (0, 2, "fitting the plain model, iteration 2: log-likelihood 1234.5"),
    ]
    assert reported_to(silent) is SILENT
