"""A loss of speed in the turns that the log does not show: no missing force is made of it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.ridge_reference import ridge_reference_of
from kempf.pipeline.diagnose.screening.screen import score
from kempf.pipeline.diagnose.screening.speed_lost import SpeedLost, speed_lost
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas import effects
from tests.diagnose.sailing import WORKERS, sailed

#: of the speed, in the turns
LOST = 0.03


def lost_in_turns(run: GridRun) -> Float:
    """What turning costs, on the instants of the input table: it follows the square of the yaw rate within 20 s."""
    time = run.fine_time_s
    rate = np.gradient(np.interp(time, run.time_s, run.heading_rad), time)
    slow, decay = np.zeros(time.size), np.exp(-(time[1] - time[0]) / 20.0)
    for k in range(1, time.size):
        slow[k] = decay * slow[k - 1] + (1.0 - decay) * rate[k] ** 2
    return run.approach_m_s * LOST * (slow - slow.mean()) / np.std(slow)


@cache
def fitted(*, known: bool) -> PooledFit:
    """A fit to manoeuvres whose logs do not show the loss; what they do not show is known, or held for nothing."""
    ship = sailed("none")
    runs = []
    for run in ship.runs:
        unseen, inputs = lost_in_turns(run), run.inputs.copy()
        inputs[:, 0] += unseen
        runs.append(replace(run, inputs=inputs, speed_by_turning_m_s=unseen if known else None))
    _, fits = staged(runs, ship.spec, [], WORKERS)
    return fits[-1]


def test_what_a_log_does_not_show_is_not_taken_for_a_force() -> None:
    unknown, known = (ridge_reference_of(fitted(known=known), WORKERS) for known in (False, True))
    assert unknown.gain > 20.0 and unknown.repeats
    assert known.gain < 4.0


def test_an_effect_of_the_speed_is_scored_beside_it() -> None:
    effect = effects.get("speed_exponent")
    unknown, known = (score(fitted(known=known), effect, WORKERS) for known in (False, True))
    assert known.score < 0.5 * unknown.score
    # what is summed over stretches is the score
    fit = fitted(known=True)
    whole = float(known.direction @ np.concatenate([line.u for line in fit.linearised]))
    assert whole == pytest.approx(known.score, rel=1e-6)


def test_a_log_that_shows_the_loss_changes_nothing() -> None:
    fit = fitted(known=False)
    lost = speed_lost(fit, WORKERS)
    assert not any(column.any() for column in lost.columns)
    for line, same in zip(fit.linearised, lost.lines(fit.linearised), strict=True):
        assert same.u is line.u and same.J is line.J


def test_innovations_are_weighed_by_their_covariance() -> None:
    random = np.random.default_rng(3)
    columns = (random.standard_normal(7), np.zeros(4), 1e3 * random.standard_normal(5))
    lost, of_all = SpeedLost(columns), random.standard_normal((16, 2))
    twice, row = lost.beside(lost.beside(of_all)), 0
    for column in columns:
        part = slice(row, row + column.size)
        covariance = np.eye(column.size) + np.outer(column, column)
        np.testing.assert_allclose(twice[part], np.linalg.solve(covariance, of_all[part]), atol=1e-9)
        row += column.size
