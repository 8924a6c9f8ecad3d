"""The error of a lateness that was undone moves a fit as a velocity does that is late by as much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.diagnose.late_velocity import covariance_of_lateness
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.effects import get
from tests.diagnose.sailing import WORKERS, sailed

LATE_S = 0.4
PLAIN = (EffectModel(), np.zeros(0))


def test_what_is_added_is_what_a_late_velocity_does_to_the_hull() -> None:
    ship = sailed()
    runs = [replace(run, velocity_late_std_s=LATE_S) for run in ship.runs[:3]]
    fit = fit_plain(runs, ship.spec, WORKERS).fit
    late = EffectModel((get("gnss_latency"),))
    moved = []
    for run in runs:
        start, measured = np.zeros(8), run.measured.copy()
        shown = [RunFilter(run, m, ship.spec).free(fit.hull, v, start) for m, v in ((late, np.array([LATE_S])), PLAIN)]
        measured[:, 0] += shown[0][:, 0] - shown[1][:, 0]
        moved.append(replace(run, measured=measured))
    off = fit_plain(moved, ship.spec, WORKERS).fit.hull - fit.hull
    added = covariance_of_lateness(fit, WORKERS)
    assert np.all(np.abs(np.sqrt(np.diag(added)) - np.abs(off)) < 0.3 * np.abs(off) + 0.2 * fit.std)
    # it moves the sway's damping and the rudder's side force by a good part of a standard error
    assert np.all(np.abs(off[[0, 4]]) > 0.5 * fit.std[[0, 4]])
    # all manoeuvres of one log are off to one side: a single error
    assert np.linalg.matrix_rank(added / np.sqrt(np.outer(np.diag(added), np.diag(added))), tol=1e-6) == 1


def test_two_logs_err_by_themselves_and_what_was_not_late_errs_by_nothing() -> None:
    ship = sailed()
    runs = [replace(run, velocity_late_std_s=LATE_S, day=k % 2) for k, run in enumerate(ship.runs[:4])]
    fit = fit_plain(runs, ship.spec, WORKERS).fit
    both, first, second = (covariance_of_lateness(_late_on(fit, days), WORKERS) for days in ((0, 1), (0,), (1,)))
    assert both == pytest.approx(first + second, rel=1e-9, abs=1e-12 * np.max(np.abs(both)))
    size = np.sqrt(np.diag(both))
    for one, rank in ((both, 2), (first, 1), (second, 1)):
        assert np.linalg.matrix_rank(one / np.outer(size, size), tol=1e-6) == rank
    assert not np.any(covariance_of_lateness(_late_on(fit, ()), WORKERS))


def _late_on(fit: PooledFit, days: tuple[int, ...]) -> PooledFit:
    """A fit whose velocities were late on some days only."""
    runs = [
        replace(one, run=replace(one.run, velocity_late_std_s=LATE_S if one.run.day in days else 0.0))
        for one in fit.runs
    ]
    return replace(fit, runs=tuple(runs))
