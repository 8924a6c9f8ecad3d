"""A fit reports every iteration, rising within a climb and ending where the fit does, and is the same to the bit."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from kempf.pipeline.diagnose.screening.screen import screen
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.schemas.effects import catalogue, get
from tests.diagnose.heard import Heard
from tests.diagnose.sailing import SOME, WORKERS, sailed


def test_every_iteration_of_a_staged_fit_is_told_and_moves_nothing():
    ship, heard = sailed("rudder_lag"), Heard()
    runs, effects = ship.runs[:2], [get("rudder_lag")]
    _, quiet = staged(runs, ship.spec, effects, WORKERS)
    _, fits = staged(runs, ship.spec, effects, WORKERS, listener=heard)
    for before, after in zip(quiet, fits, strict=True):
        assert before.log_likelihood == after.log_likelihood
        for name in ("hull", "values", "levels", "covariance"):
            assert np.array_equal(getattr(before, name), getattr(after, name), equal_nan=True)
    assert heard.pieces == ["fitting the plain model", "fitting rudder_lag"]
    assert heard.counts[:2] == [(1, 2), (2, 2)]  # each manoeuvre by itself
    for climb in heard.climbs:
        assert [one.number for one in climb] == list(range(len(climb)))
        assert all(a.log_likelihood < b.log_likelihood for a, b in pairwise(climb))
        assert all(0.0 < one.error < 2.0 and one.runs == 2 for one in climb)
    assert [one.log_likelihood for one in heard.ends] == [fit.log_likelihood for fit in fits]
    top = max(one.log_likelihood for climb in heard.climbs for one in climb)
    assert top == fits[-1].log_likelihood
    plain = heard.climbs[0][-1]
    assert plain.log_likelihood == heard.ends[0].log_likelihood
    assert plain.error == heard.ends[0].error
    # the lag that was missing makes the next reading better foreseen
    assert heard.ends[1].error < heard.ends[0].error


def test_the_screen_counts_what_it_has_tried():
    ship, heard = sailed("rudder_lag"), Heard()
    _, (fit,) = staged(ship.runs[:2], ship.spec, (), WORKERS)
    known = catalogue()
    effects = {name: known[name] for name in SOME}
    stated = screen(fit, effects, WORKERS, heard)
    assert [one.score for one in stated] == [one.score for one in screen(fit, effects, WORKERS)]
    done, totals = zip(*heard.counts, strict=True)
    assert list(done) == sorted(set(done)) and set(totals) == {done[-1]} and len(done) > 1
