"""``kempf compare --horizon legs``: free runs with the parameters that predictions of manoeuvres take."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.late import VESSEL, run


def _error(document: Mapping[str, Any], sample: str) -> float:
    """Return 100 - fit %, mean over channels and manoeuvres, as what is drawn has it."""
    runs = [one for one in document["runs"] if one["sample"] == sample]
    return float(np.mean([100.0 - np.mean(list(one["fit_percent"].values())) for one in runs]))


def test_a_model_that_lacks_something_is_drawn_as_it_predicts(late_added: Path) -> None:
    plain, _ = run(late_added, "ladder", "--vessel", VESSEL, "--json").json
    asked = ("compare", "--vessel", VESSEL, "--set", plain["parameter_set_id"], "--json")
    free = run(late_added, *asked).json
    legs = run(late_added, *asked, "--horizon", "legs").json
    assert (legs["horizon"], legs["horizon_words"]) == ("legs", "free run, fitted to legs")
    for sample in ("fitted", "held_out"):
        known = free["summary"][sample]
        # both figures are in either document, and what is drawn is the one that was asked for
        assert known["free_run_error_percent"] == legs["summary"][sample]["free_run_error_percent"]
        assert _error(free, sample) == pytest.approx(known["free_run_error_percent"]["mean"])
        assert _error(legs, sample) == pytest.approx(known["free_run_error_percent_fitted_to_legs"]["mean"])
    assert _error(legs, "held_out") < _error(free, "held_out")
    # a threshold is put to what is drawn
    assert free["judged"]["free_run_error_percent"] == pytest.approx(_error(free, "held_out"))
    assert legs["judged"]["free_run_error_percent"] == pytest.approx(_error(legs, "held_out")), "one run is its median"
    horizons = [{one["overshoot_horizon"] for one in document["runs"]} for document in (free, legs)]
    assert horizons == [{"free"}, {"legs"}]


def test_of_a_model_that_predicts_by_likelihood_it_is_the_free_run(late_added: Path) -> None:
    asked = ("compare", "--vessel", VESSEL, "--json")
    legs = run(late_added, *asked, "--horizon", "legs").json
    assert legs == run(late_added, *asked).json
    assert legs["horizon"] == "free"
