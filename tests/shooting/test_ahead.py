"""Multiple shooting on ships of a plant that shares no code with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.pipeline.model.terms.ordinary import driven_by_noise
from kempf.pipeline.shooting import shooting_fit
from kempf.pipeline.shooting.ahead import Ahead, ShootingRange, shooting_range
from kempf.pipeline.shooting.left_out import LeftOut, left_out
from kempf.pipeline.shooting.paired import paired
from kempf.pipeline.shooting.reduced import reduce
from kempf.pipeline.shooting.shot_run import ShotRun
from kempf.pipeline.shooting.windows import noise_of, windows_of
from kempf.schemas import effects
from tests.diagnose.sailing import WORKERS, Sailed, sailed

DRAG = effects.get("cross_flow_drag")


@pytest.fixture(scope="module")
def dragged() -> tuple[Sailed, ShootingRange, Ahead]:
    ship = sailed("cross_flow_drag")
    shooting = shooting_range(ship.runs[:3], ship.runs[3:], ship.spec, WORKERS)
    found = shooting.with_effect(shooting.plain, DRAG)
    assert found is not None
    return ship, shooting, found


def test_what_is_screened_is_what_the_whole_model_says(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    """The screen runs the columns of a new effect alone; the others are those of the model without it."""
    _, shooting, found = dragged
    chosen = [effects.get(name) for name in ("yaw_v3", "wind_force", "heading_latency", "yaw_quadratic")]
    for cost, effect in shooting.screened(found, chosen):
        model = found.model.with_effect(effect)
        shots = [ShotRun(windows, model, shooting.spec) for windows in shooting.fitted]
        shared = np.concatenate([found.fit.shared, np.zeros(len(effect.parameters))])
        at = [replace(part.at, shared=shared) for part in found.fit.parts]
        here = shooting_fit.linearised(shots, at, shooting.scales, WORKERS)
        assert here is not None
        assert shooting_fit.foreseen(here) == pytest.approx(cost, rel=1e-12)


def test_a_window_runs_as_the_extended_filter_does_without_measurements() -> None:
    ship = sailed("cross_flow_drag")
    run, model = ship.runs[0], EffectModel((DRAG, effects.get("gnss_latency"), effects.get("rudder_lag")))
    values, hull = np.array([1.2, 0.7, 1.5]), mariner_like(run.ship.length_m).array()
    windows = replace(
        windows_of(run, 1e6), begins=np.array([0]), ends=np.array([run.measured.shape[0] - 1]), start=np.zeros((1, 3))
    )
    shot = ShotRun(windows, model, ship.spec)
    own, start = np.array([2e-3, 1e-6, 0.1, -0.2, 1e-4]), np.array([[0.2, 1e-3, 0.05]])
    shared = np.concatenate([hull, values])
    found = shot.predicted(shared[:, None], own[:, None], start[..., None])[..., 0]
    other = RunFilter(run, model, ship.spec).free(hull, values, np.concatenate([start[0], own]))
    # whole steps against the filter's two: a thousandth of the motion
    apart = np.sqrt(np.mean((found - other) ** 2, axis=0))
    assert np.all(apart < 1e-3 * np.std(other, axis=0))


@pytest.mark.parametrize("name", ["memory", "speed_loss"])
def test_what_an_effect_remembers_is_there_when_a_window_begins(name: str) -> None:
    """Windows begun anywhere go on as the whole manoeuvre does; begun with nothing remembered they would not."""
    ship = sailed("cross_flow_drag")
    model, hull = EffectModel((effects.get(name),)), mariner_like(ship.runs[0].ship.length_m).array()
    values = np.array([0.8] if name == "memory" else [1.0, 0.2])
    own = np.array([2e-3, 1e-6, 0.1, -0.2, 1e-4])
    n = ship.runs[0].measured.shape[0]
    run = replace(ship.runs[0], measured=np.zeros((n, 3)), offset_s=np.zeros((n, 3)))
    free = RunFilter(run, model, ship.spec).free(hull, values, np.concatenate([np.zeros(3), own]))
    run = replace(run, measured=free)
    windows = windows_of(run, 100.0)
    assert windows.begins.size > 5
    current = run.current_row @ own[2:4]
    starts = (free - np.column_stack([current, np.full(current.size, own[4]), np.zeros(current.size)]))[windows.begins]
    shared = np.concatenate([hull, values])[:, None]
    found = ShotRun(windows, model, ship.spec).predicted(shared, own[:, None], starts[..., None])[..., 0]
    apart = np.sqrt(np.mean((found - free[windows.rows]) ** 2, axis=0)) / np.std(free, axis=0)
    assert np.all(apart < 8e-3)

    class Forgetful(ShotRun):
        def _led(self, *given: np.ndarray) -> np.ndarray:
            return np.zeros_like(super()._led(*given))

    without = Forgetful(windows, model, ship.spec).predicted(shared, own[:, None], starts[..., None])[..., 0]
    forgotten = np.sqrt(np.mean((without - free[windows.rows]) ** 2, axis=0)) / np.std(free, axis=0)
    assert forgotten.max() > 5.0 * apart.max()


def test_windows_are_a_leg_long_and_overlap_by_half(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    ship, shooting, _ = dragged
    windows = shooting.fitted[0]
    length = windows.ends[0] - windows.begins[0]
    assert abs(length * ship.runs[0].step_s - shooting.horizon_s) < ship.runs[0].step_s
    assert np.all(np.diff(windows.begins) == length // 2)
    assert windows.ends[-1] == ship.runs[0].measured.shape[0] - 1
    # one execute a leg: the four legs and the approach
    assert 60.0 < shooting.horizon_s < 240.0


def test_the_start_of_a_window_is_as_good_as_its_error_says() -> None:
    time = np.arange(4000.0)
    noise = np.random.default_rng(4).normal(0.0, 0.3, time.size)
    assert noise_of(np.sin(time / 50.0) + noise) == pytest.approx(0.3, rel=0.1)


def test_the_drag_is_found_with_its_error(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    ship, shooting, found = dragged
    value, std = float(found.fit.values[0]), float(np.sqrt(found.fit.covariance[6, 6]))
    assert 0.0 < std < 0.3 * ship.c and abs(value - ship.c) < 3.5 * std
    beside = paired(shooting.plain.left_out, found.left_out)
    assert beside.in_std > 3.0 and beside.falls_by > 0.3 and beside.better == beside.of == 3
    assert paired(found.left_out, shooting.plain.left_out).in_std == pytest.approx(-beside.in_std)
    # fitted, left out and held out fall together
    assert found.own.mean < 0.7 * shooting.plain.own.mean
    assert found.held.mean < 0.7 * shooting.plain.held.mean
    assert np.all(found.percent(found.held) < shooting.plain.percent(shooting.plain.held))


def test_the_screen_foresees_what_a_refit_finds(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    _, shooting, found = dragged
    ranked = shooting.screened(shooting.plain, [effects.get("gyro_bias"), DRAG, effects.get("rudder_stall")])
    assert ranked[0][1].name == "cross_flow_drag"
    assert ranked[0][0] == pytest.approx(found.fit.cost, rel=0.2)


def test_what_only_noise_drives_is_not_screened_by_windows(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    _, shooting, _ = dragged
    noisy = [effect.name for effect in effects.catalogue().values() if driven_by_noise(effect)]
    assert noisy == ["waves"]
    assert shooting.screened(shooting.plain, [effects.get("waves")]) == []
    # it would have moved nothing
    made = shooting.with_effect(shooting.plain, effects.get("waves"))
    assert made is None or made.left_out.mean == pytest.approx(shooting.plain.left_out.mean, rel=1e-2)


def test_leaving_out_is_what_fitting_to_the_others_gives(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    _, shooting, found = dragged
    shots, parts = found.fit.shots, found.fit.parts
    rest = shooting_fit.fit(shots[1:], found.fit.shared, shooting.scales, WORKERS, [part.at for part in parts[1:]])
    error, _, _ = shooting_fit.alone(shots[0], rest.shared, shooting.scales, parts[0].at)
    assert found.left_out.misfits[0] == pytest.approx(error, rel=0.1)
    # what was not fitted is not predicted better than what was
    assert found.left_out.mean > found.own.mean


def test_a_model_that_runs_away_is_no_number_and_no_crash(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    _, shooting, found = dragged
    wild = found.fit.shared.copy()
    wild[:6] *= -300.0
    part = reduce(found.fit.shots[0], found.fit.shots[0].begin(wild), shooting.scales)
    assert part.cost == np.inf
    error, _, errors = shooting_fit.alone(found.fit.shots[0], wild, shooting.scales)
    assert error == np.inf
    away = LeftOut(np.full(3, np.inf), (errors, *found.left_out.errors[1:]))
    assert paired(found.left_out, away).in_std == -np.inf and paired(away, found.left_out).in_std == np.inf


def test_the_same_bits_twice(dragged: tuple[Sailed, ShootingRange, Ahead]) -> None:
    ship, _, found = dragged
    again = shooting_range(ship.runs[:3], ship.runs[3:], ship.spec, WORKERS)
    other = again.with_effect(again.plain, DRAG)
    assert other is not None
    assert np.array_equal(other.fit.shared, found.fit.shared)
    assert np.array_equal(left_out(other.fit, WORKERS).misfits, found.left_out.misfits)


def test_a_slow_instrument_on_a_fine_grid_has_its_noise_too() -> None:
    run = sailed("cross_flow_drag").runs[0]
    measured = run.measured.copy()
    measured[1::2, 0] = np.nan
    windows = windows_of(replace(run, measured=measured), 100.0)
    full = windows_of(run, 100.0)
    assert np.all(np.isfinite(windows.start)) and np.all(np.isfinite(windows.start_std))
    # of half of the readings it is of the same size
    ratio = np.median(windows.start_std[:, 0] / full.start_std[:, 0])
    assert 0.5 < ratio < 2.0
    # two readings in all say nothing of their noise, and no start is made up
    measured[2:, 0] = np.nan
    measured[1, 0] = measured[0, 0]
    assert np.all(np.isnan(windows_of(replace(run, measured=measured), 100.0).start[:, 0]))


def test_a_fit_that_diverges_has_no_covariance() -> None:
    ship = sailed("cross_flow_drag")
    runs = [windows_of(run, 100.0) for run in ship.runs[:2]]
    away = EffectModel((effects.get("yaw_cubic"),))
    hull = mariner_like(ship.runs[0].ship.length_m)
    shared = np.concatenate([hull.array() * [-1e6, 1.0, 1.0, -1e6, 1.0, 1.0], [0.0]])
    scales = shooting_range(ship.runs[:2], (), ship.spec, WORKERS).scales
    fit = shooting_fit.fit([ShotRun(windows, away, ship.spec) for windows in runs], shared, scales, WORKERS)
    assert not np.isfinite(fit.cost)
    assert fit.covariance.shape == (7, 7) and np.all(np.isnan(fit.covariance))
