"""A model whose free run diverges: a word in every table and sentence, never an error or a number."""

from __future__ import annotations

from math import isnan

import numpy as np

from kempf.pipeline.diagnose.sentences import _share
from kempf.pipeline.predict.free_run import FreeRun
from kempf.workbench.rungs import compared, in_words


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
