"""``kempf reproduce-paper``: what the paper says of its experiment is found again, and what it leaves out is listed."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from kempf.flows.jobs.demo.reproduce_paper import ITERATIONS, Reproduction, reproduce_paper
from kempf.workbench.cli.reproduce_paper import draw
from tests.workbench.driving import HULL, kempf, refused


@lru_cache(maxsize=1)
def made() -> Reproduction:
    return reproduce_paper()


def test_the_first_approximation_leaves_the_current_at_half_its_value() -> None:
    shown = made().experiments[0].as_json()["disturbances_at_the_end"]
    current, force = shown["current_m_s"], shown["force_m_s2"]
    assert current["true"] == 0.3 and force["true"] == 5e-3
    assert 0.4 < current["first"] / current["true"] < 0.6
    # "hardly estimated" in the paper; here less than half
    assert force["first"] / force["true"] < 0.5


def test_after_25_iterations_the_disturbances_are_found_and_the_errors_are_of_the_paper_s_size() -> None:
    quiet = made().experiments[0]
    assert len(quiet.course.passes) == ITERATIONS + 1
    assert quiet.course.end == "converged"
    assert quiet.last[-1, 3] == pytest.approx(0.3, rel=0.02)
    assert quiet.last[-1, 2] == pytest.approx(5e-3, rel=0.1)
    worst = max(abs(e) for e in quiet.last_error.values())
    assert 5.0 < worst < 25.0
    assert max(abs(e) for e in quiet.first_error.values()) > 4.0 * worst


def test_maximum_likelihood_on_the_same_record_is_better_by_far() -> None:
    for one in made().experiments:
        assert one.maximum_likelihood.converged
        for name in HULL:
            assert abs(one.ml_error[name]) < 4.0 * one.ml_std[name]
        assert max(abs(e) for e in one.ml_error.values()) < 0.1 * max(abs(e) for e in one.last_error.values())


def test_with_usual_instruments_the_procedure_settles_on_no_ship() -> None:
    usual = made().experiments[1]
    assert usual.noise_factor == 1.0 and usual.course.end == "converged"
    assert max(abs(e) for e in usual.last_error.values()) > 100.0


def test_truth_and_measurements_stand_at_the_same_instants() -> None:
    quiet = made().experiments[0]
    residual = quiet.measured - quiet.true[:, :2] - np.outer(quiet.true[:, 3], [1.0, 0.0])
    np.testing.assert_allclose(np.std(residual, axis=0), [0.1 * 0.0504, 0.1 * np.deg2rad(0.03)], rtol=0.1)
    assert quiet.time_s[0] == -20.0 and np.all(np.diff(quiet.time_s) == 1.0)


def test_the_command_prints_the_same_and_draws_three_figures(tmp_path: Path) -> None:
    ran = kempf("reproduce-paper", "--folder", tmp_path / "a", "--json")
    assert ran.code == 0, ran
    document = ran.json
    assert set(document) == {"conditions", "truth", "discrete", "experiments", "figures"}
    assert {one["stated_by"] for one in document["conditions"].values()} == {"paper", "ours"}
    quiet = document["experiments"][0]
    assert list(quiet["accuracy"]) == HULL
    assert [quiet["accuracy"][n]["paper_percent"] for n in HULL] == [10.0, 10.0, 25.0, 20.0, 20.0, 5.0]
    assert len(quiet["iterations"]) == ITERATIONS + 1
    # the same bits again
    assert quiet["accuracy"] == made().experiments[0].as_json()["accuracy"]
    (tmp_path / "b").mkdir()
    again = draw(made(), tmp_path / "b")
    for one, other in zip(document["figures"], again, strict=True):
        data = Path(one).read_bytes()
        assert data.startswith(b"\x89PNG\r\n")
        assert hashlib.sha256(data).digest() == hashlib.sha256(other.read_bytes()).digest()


def test_a_folder_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    refused(kempf("reproduce-paper", "--folder", tmp_path / "file" / "x", "--json"), 2, "cannot_write")
