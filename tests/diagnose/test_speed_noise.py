"""Changes of the speed that may be noise of its log: no missing force is made of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.nuisance import nuisance
from kempf.pipeline.diagnose.screening.ridge_reference import ridge_reference_of
from kempf.pipeline.diagnose.screening.screen import score
from kempf.pipeline.diagnose.screening.speed_noise import SpeedNoise, speed_noise
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.steps.legs import candidate_in_std
from kempf.pipeline.diagnose.stretches.stretch import explain
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas import effects
from kempf.schemas.model_spec import N_HULL
from tests.diagnose.sailing import WORKERS, sailed

#: noise of the speed, part of it, and its correlation time, s
NOISE, LASTS_S = 0.03, 60.0


def noise_of(run: GridRun, seed: int) -> Float:
    """An error of the speed that wanders, m/s, on the instants of the input table."""
    random, time = np.random.default_rng(seed), run.fine_time_s
    decay = float(np.exp(-(time[1] - time[0]) / LASTS_S))
    error = np.empty(time.size)
    error[0] = random.standard_normal()
    for k in range(1, time.size):
        error[k] = decay * error[k - 1] + np.sqrt(1.0 - decay**2) * random.standard_normal()
    return NOISE * run.approach_m_s * error


@cache
def noisy() -> PooledFit:
    """A fit to manoeuvres without an effect whose speed is noisy, by an error that is stated."""
    ship, runs = sailed("none"), []
    for number, run in enumerate(ship.runs):
        inputs = run.inputs.copy()
        # she keeps her speed: what changes of it is noise
        inputs[:, 0] += noise_of(run, number)
        std = NOISE * run.approach_m_s
        runs.append(replace(run, inputs=inputs, speed_error_std_m_s=std, speed_error_rate_per_s=1.0 / LASTS_S))
    _, fits = staged(runs, ship.spec, [], WORKERS)
    return fits[-1]


def not_allowed_for(fit: PooledFit, monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = SpeedNoise(tuple(np.zeros(line.u.size) for line in fit.linearised))
    for room in ("ridge_reference", "screen"):
        monkeypatch.setattr(f"kempf.pipeline.diagnose.screening.{room}.speed_noise", lambda *_: nothing)


def test_noise_of_the_speed_is_not_taken_for_a_force(monkeypatch: pytest.MonkeyPatch) -> None:
    fit, effect = noisy(), effects.get("speed_exponent")
    gain, candidate = ridge_reference_of(fit, WORKERS).gain, score(fit, effect, WORKERS)
    not_allowed_for(fit, monkeypatch)
    assert ridge_reference_of(fit, WORKERS).gain > max(10.0, gain + 8.0)
    assert -8.0 < gain < 8.0
    assert score(fit, effect, WORKERS).score > 4.0 * candidate.score


def test_what_is_summed_over_stretches_is_the_score() -> None:
    fit = noisy()
    found = score(fit, effects.get("yaw_quadratic"), WORKERS)
    assert float(found.direction @ found.innovations) == pytest.approx(found.score, rel=1e-6)
    assert np.any(found.innovations != np.concatenate([line.u for line in fit.linearised]))
    assert np.isfinite(candidate_in_std(fit, found, 100.0))


def test_an_effect_is_seen_beside_the_noise() -> None:
    """Of a drag the noise of an ordinary log takes next to nothing."""
    ship = sailed("cross_flow_drag")
    _, fits = staged(ship.runs, ship.spec, [], WORKERS)
    noise = speed_noise(fits[-1], WORKERS)
    assert all(0.0 < float(column @ column) < 1.0 for column in noise.columns)
    found = score(fits[-1], effects.get("cross_flow_drag"), WORKERS)
    u = np.concatenate([line.u for line in fits[-1].linearised])
    known = nuisance(fits[-1].linearised, N_HULL)
    assert float(found.direction @ known.clean(u[:, None])[:, 0]) == pytest.approx(found.score, rel=0.02)
    assert found.score > 50.0


def test_a_stretch_of_everything_has_the_score_of_the_screen() -> None:
    fit, effect = noisy(), effects.get("yaw_quadratic")
    whole = score(fit, effect, WORKERS)
    every = [True] * len(fit.runs)
    inside = np.ones(fit.runs[0].run.measured.shape[0], dtype=bool)
    (found,) = explain(fit, every, 0, inside, {effect.name: effect}, WORKERS).effects
    assert found.everywhere.score == pytest.approx(whole.score, rel=1e-6)


def test_a_speed_without_an_error_changes_nothing() -> None:
    fit = noisy()
    sure = replace(fit, runs=tuple(replace(one, run=replace(one.run, speed_error_std_m_s=0.0)) for one in fit.runs))
    noise = speed_noise(sure, WORKERS)
    assert not any(column.any() for column in noise.columns)
    for line, same in zip(sure.linearised, noise.of(sure).linearised, strict=True):
        assert same.u is line.u and same.J is line.J


def test_innovations_are_freed_of_what_the_noise_correlates() -> None:
    random = np.random.default_rng(3)
    columns = (random.standard_normal(7), np.zeros(4), 1e3 * random.standard_normal(5))
    noise, of_all = SpeedNoise(columns), random.standard_normal((16, 2))
    twice, row = noise.beside(noise.beside(of_all)), 0
    for column in columns:
        part = slice(row, row + column.size)
        covariance = np.eye(column.size) + np.outer(column, column)
        np.testing.assert_allclose(twice[part], np.linalg.solve(covariance, of_all[part]), atol=1e-9)
        row += column.size
