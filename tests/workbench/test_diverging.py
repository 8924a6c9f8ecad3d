"""A model whose free run diverges: a word in every table and sentence, never an error or a number."""

from __future__ import annotations

from math import isnan
from typing import Any

import numpy as np

from kempf.pipeline.diagnose.verdicts.sentences import _share
from kempf.pipeline.predict.free_run import FreeRun
from kempf.workbench.rungs import compared, in_words, remarks


def test_a_free_run_that_diverges_has_no_error() -> None:
    measured = np.array([[0.1, np.nan, 0.2], [0.2, np.nan, 0.4]])
    run = FreeRun("run", np.full((2, 3), np.nan), np.where(np.isfinite(measured), np.inf, np.nan), np.zeros(8))
    assert isnan(run.relative_error)
    finite = FreeRun("run", 0.5 * measured, 0.5 * measured, np.zeros(8))
    assert 0.0 < finite.relative_error < 10.0


def test_it_is_called_so() -> None:
    runs: dict[str, object] = {"seg-1": {}}
    rung = {"added": None, "effects": {}, "in_sample_error": 0.125, "in_sample": runs, "held_out_error": None}
    diverging, alone = compared([{**rung, "held_out": runs}, {**rung, "held_out": {}}])
    assert [in_words(one.free.held_out) for one in (diverging, alone)] == ["diverges", "-"]
    assert in_words(alone.free.fitted) == "12.5"
    assert (_share(float("nan")), _share(0.125)) == ("divergence", "12.5")


def test_what_is_not_known_of_a_rung_stops_no_table() -> None:
    ahead = {
        "better_than_one_step": {"falls_by": 0.5},
        "covariance": [[0.01]],
        "fitted_misfit": 1.0,
        "left_out_misfit": 4.0,
        "parameters": {"rudder_lag.tau": {"value": 2.0, "std": None}},
        **{f"{sample}_percent": {"seg-1": None} for sample in ("fitted", "left_out", "held_out")},
    }
    rung: dict[str, Any] = {
        "added": "rudder_lag",
        "effects": {"rudder_lag.tau": {"value": 1.0, "std": 0.1, "unit": "s"}},
        "in_sample": {"seg-1": {}, "seg-2": {}},
        "in_sample_error": 0.5,
        "held_out": {},
        "held_out_error": None,
        "one_leg_ahead": ahead,
        "free_run_fitted_to_legs": {"seg-1": 0.25},
    }
    (one,) = compared([rung])
    (tau,) = one.sizes
    assert one.by_legs and (tau.value, tau.std) == (2.0, None)
    # of a manoeuvre that came after the fit to legs there is none
    assert (in_words(one.free.fitted), in_words(one.leg.fitted), in_words(one.free.held_out)) == ("25", "diverges", "-")
    assert one.off == (0, 1) and len(remarks([one])) == 1
    (lost,) = compared([{**rung, "free_run_fitted_to_legs": {"seg-1": 2.5, "seg-2": None, "seg-3": 0.2}}])
    assert remarks([lost])[1].startswith("2 of 3 free runs")
    # predictions do not take what has no covariance, so that it is not shown
    (plain,) = compared([{**rung, "one_leg_ahead": {**ahead, "covariance": [[None]]}}])
    assert not plain.by_legs and (plain.sizes[0].value, in_words(plain.free.fitted)) == (1.0, "50")
