"""Instants that are not quite known are found beside the hull, as far as the manoeuvres show them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from kempf.pipeline.channels.instant_errors import IN_THE_LOG, InstantErrors
from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening import unsure_instants
from kempf.pipeline.diagnose.screening.nuisance import columns_of
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.screening.unsure_instants import row_around, with_instants, within_rows
from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json
from kempf.pipeline.diagnose.verdicts.sizes import row_around_size, stated
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.level_bounds import level_bounds
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.estimate.posterior import posterior_of
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.updated import updated
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.shooting.ahead import Ahead
from kempf.schemas.effects import get
from tests.diagnose.sailing import WORKERS, Sailed, sailed

#: what an instrument is late by, s, and which measurement shows it
LATE_S = 0.2
LATE = {
    "heading_latency": InstantErrors(heading_s=LATE_S),
    "gyro_latency": InstantErrors(yaw_rate_s=LATE_S),
    "dead_time": InstantErrors(rudder_s=LATE_S),
}
PLAIN = (EffectModel(), np.zeros(0))


def late(ship: Sailed, fit: PooledFit, effect: str, run: GridRun) -> GridRun:
    """A run as the instruments show it where one of them is late."""
    model = EffectModel((get(effect),))
    start, measured = np.zeros(8), run.measured.copy()
    shown = [RunFilter(run, m, ship.spec).free(fit.hull, v, start) for m, v in ((model, np.array([LATE_S])), PLAIN)]
    return replace(run, measured=measured + (shown[0] - shown[1])[:, :3])


def test_a_hull_is_as_if_the_instants_were_right() -> None:
    effect = "heading_latency"
    ship = sailed()
    runs = ship.runs[:3]
    right = fit_plain(runs, ship.spec, WORKERS).fit
    off = fit_plain([late(ship, right, effect, run) for run in runs], ship.spec, WORKERS).fit
    found = with_instants(_unsure(off, LATE[effect], (0,)), WORKERS)
    before, after = (np.abs(hull - right.hull) / right.std[:6] for hull in (off.hull, found.fit.hull))
    # a lateness of which the fit knows nothing moves the hull by more than its errors
    assert np.max(before) > 2.0
    assert np.max(after) < 0.35 * np.max(before)
    # and what is left lies in what is stated for it
    assert np.all(np.abs(found.fit.hull - right.hull) < 2.0 * np.sqrt(np.diag(found.covariance)) + 0.1 * right.std[:6])


def test_a_further_run_is_brought_in_as_all_at_once_would_have_it() -> None:
    ship = sailed()
    right = fit_plain(ship.runs[:3], ship.spec, WORKERS).fit
    own = LATE["heading_latency"]
    runs = [
        replace(late(ship, right, "heading_latency", run), day=day, instant_errors=own)
        for day, run in enumerate(ship.runs[:4])
    ]
    first, whole = (fit_plain(some, ship.spec, WORKERS).fit for some in (runs[:3], runs))
    freed, at_once = (with_instants(fit, WORKERS) for fit in (first, whole))
    known = uncertainty_of(first)
    before = posterior_of(first, freed.fit, known, agreement_of(first), first.log_likelihood, freed.covariance)
    made = updated(before, EffectModel(), runs[3:], ship.spec, WORKERS)
    assert made is not None
    found, without = with_instants(made.fit, WORKERS, made.step), with_instants(made.fit, WORKERS)
    std = np.sqrt(np.diag(whole.covariance + at_once.covariance))
    off, off_without = (np.max(np.abs(one.fit.hull - at_once.fit.hull) / std) for one in (found, without))
    assert off < 0.25 and off_without > 4.0 * off
    stated = np.diag(made.fit.covariance + found.covariance) / np.diag(whole.covariance + at_once.covariance)
    np.testing.assert_allclose(stated, 1.0, atol=0.15)


def test_a_lateness_of_smoothing_is_considered_and_moves_nothing() -> None:
    """A hull fitted to velocities from which too little was taken is off by what is stated for it."""
    ship = sailed(name="usv")
    runs = [with_slope(run) for run in ship.runs[:3]]
    right = fit_plain(runs, ship.spec, WORKERS).fit
    missed_s, off = 0.02, []
    for by in (-missed_s, missed_s):
        late_runs = [replace(run, measured=run.measured + by * slope_of(run)) for run in runs]
        off.append(fit_plain(late_runs, ship.spec, WORKERS).fit.hull)
    found = with_instants(_unsure(right, InstantErrors(smoothing_s=missed_s), (0,)), WORKERS)
    assert found.fit.hull == pytest.approx(right.hull, abs=0.0)
    moved, stated = 0.5 * np.abs(off[1] - off[0]), np.sqrt(np.diag(found.covariance))
    # all logs late by as much: the covariance has one direction, and its size is the move
    seen = moved > 0.3 * right.std[:6]
    assert np.count_nonzero(seen) >= 3
    assert stated[seen] == pytest.approx(moved[seen], rel=0.25)
    assert np.linalg.matrix_rank(found.covariance / np.outer(stated, stated), tol=1e-6) == 1


def with_slope(run: GridRun) -> GridRun:
    """A run whose lateral speed may be late: what a second more takes from it, as the means of her readings show it."""
    lateral = run.measured[:, 0]
    seen = np.isfinite(lateral)
    slope = np.full(lateral.size, np.nan)
    slope[seen] = np.gradient(lateral[seen], run.time_s[seen])
    return replace(run, lateral_by_late=slope)


def slope_of(run: GridRun) -> Float:
    assert run.lateral_by_late is not None
    return np.column_stack([np.nan_to_num(run.lateral_by_late), np.zeros((run.lateral_by_late.size, 2))])


def test_what_is_known_is_left_alone() -> None:
    ship = sailed()
    fit = fit_plain(ship.runs[:2], ship.spec, WORKERS).fit
    found = with_instants(fit, WORKERS)
    assert found.fit is fit and not np.any(found.covariance)


def test_every_log_errs_by_itself() -> None:
    ship = sailed()
    runs = [replace(run, day=k % 2) for k, run in enumerate(ship.runs[:4])]
    fit = fit_plain(runs, ship.spec, WORKERS).fit
    added = {days: with_instants(_unsure(fit, LATE["heading_latency"], days), WORKERS) for days in ((0, 1), (0,), (1,))}
    for days, one in added.items():
        size = np.sqrt(np.diag(one.covariance))
        assert np.linalg.matrix_rank(one.covariance / np.outer(size, size), tol=1e-6) == len(days)
    # each log adds its part, and one says nothing of the instants of the other but through the hull
    assert np.all(np.diag(added[0, 1].covariance) > np.diag(added[0,].covariance))


def test_levels_pressed_against_a_bound_are_known() -> None:
    """As the search has it: at a bound, and the likelihood rises beyond it."""
    ship = sailed()
    fit = fit_plain(ship.runs[:2], ship.spec, WORKERS).fit
    (line, _), (least, most) = fit.linearised, level_bounds(ship.spec)
    own = [i - 6 for i in line.index if i >= 6]
    _, by_level = columns_of(line, 6)
    assert least[own[0]] < fit.levels[0, own[0]] < most[own[0]]
    assert unsure_instants._unbound(fit, 0, line.u @ by_level).all()
    for bound, outward in ((least, -1.0), (most, 1.0)):
        levels = fit.levels.copy()
        levels[0, own[0]] = bound[own[0]]
        for slope, known in ((outward, True), (-outward, False)):
            # innovations along the first column alone: its slope is that of the likelihood by its level
            turned = replace(line, u=slope * by_level[:, 0])
            at_bound = replace(fit, levels=levels, linearised=(turned, fit.linearised[1]))
            found = unsure_instants._unbound(at_bound, 0, turned.u @ by_level)
            assert found[0] == (not known) and found[1:].all()


def test_a_latency_of_the_model_is_known_no_better_than_the_instants() -> None:
    ship = sailed("heading_latency")
    fit = ship.diagnosis(("heading_latency",)).steps[1].fit
    own = fit.model.names.index("heading_latency.tau") + 6
    unsure = _unsure(fit, LATE["heading_latency"], tuple(run.day for run in ship.runs))
    found = with_instants(unsure, WORKERS)
    assert found.covariance[own, own] == pytest.approx(LATE_S**2, rel=0.2)
    assert found.fit.values[own - 6] == pytest.approx(fit.values[own - 6], abs=1e-3)
    effect = get("heading_latency")
    assert within_rows(unsure, effect, found) == bool(abs(fit.values[-1]) < 12.0**0.5 * LATE_S)
    exact = with_instants(fit, WORKERS)
    assert not within_rows(fit, effect, exact) and not within_rows(unsure, get("gyro_latency"), exact)


def test_a_rudder_lag_that_unsure_instants_can_make_is_within_them() -> None:
    """A rudder read too early looks like one that lags by as little; a lag of seconds has a shape of its own."""
    ship, lag = sailed(), get("rudder_lag")
    right = fit_plain(ship.runs[:3], ship.spec, WORKERS).fit
    early = staged([late(ship, right, "dead_time", run) for run in ship.runs[:3]], ship.spec, [lag], WORKERS)[1][-1]
    slow = sailed("rudder_lag").diagnosis(("rudder_lag",)).steps[1].fit
    for fit, within in ((early, True), (slow, False)):
        assert fit.values[-1] > 2.0 * agreement_of(fit).widened * fit.std[-1]
        unsure = _unsure(fit, LATE["dead_time"], tuple(filtered.run.day for filtered in fit.runs))
        assert within_rows(unsure, lag, with_instants(unsure, WORKERS)) == within
        assert not within_rows(fit, lag, with_instants(fit, WORKERS))


def test_a_latency_of_less_than_a_row_may_be_how_the_table_was_written() -> None:
    ship = sailed("heading_latency")
    found = ship.diagnosis(("heading_latency",))
    effect, (tau,) = get("heading_latency"), found.sizes["heading_latency"].values
    for row_s, around in ((2.0 * abs(tau), True), (0.5 * abs(tau), False)):
        table = tuple(replace(run, instant_errors=InstantErrors(row_s=row_s)) for run in found.fitted)
        said = as_json(replace(found, fitted=table))
        (claimed,) = said["sets"]
        assert claimed["within_rows_of_s"] == (row_s if around else None)
        words = f"; this is less than the {row_s:.2g} s between rows: a table whose rows hold the last reading of each"
        assert any(words in one for one in said["sentences"]) == around
        assert row_around(table, get("yaw_quadratic"), 0.0) is None
    # messages
    assert row_around(found.fitted, effect, 0.0) is None
    # the size that is stated counts: three times as large, fitted to legs
    fit, std = SimpleNamespace(values=np.array([3.0 * tau])), np.full(7, 0.01)
    ahead = SimpleNamespace(disagrees=object(), model=SimpleNamespace(own=lambda _: slice(0, 1)), fit=fit, std=std)
    legs = replace(found, steps=(found.steps[0], replace(found.steps[1], ahead=cast(Ahead, ahead))))
    for row_s, around in ((4.0 * abs(tau), True), (2.0 * abs(tau), False)):
        table = tuple(replace(run, instant_errors=InstantErrors(row_s=row_s)) for run in found.fitted)
        other = replace(legs, fitted=table)
        assert row_around_size(other, other.steps[1], effect) == (row_s if around else None)
        assert ("between rows" in stated(other, other.steps[1], effect)) == around
        assert "fitted to legs" in stated(other, other.steps[1], effect)


def _unsure(fit: PooledFit, errors: InstantErrors, days: tuple[int, ...]) -> PooledFit:
    """A fit of whose instants not all are known, on some days."""
    return replace(
        fit,
        runs=tuple(
            replace(one, run=replace(one.run, instant_errors=errors if one.run.day in days else IN_THE_LOG))
            for one in fit.runs
        ),
    )


def test_a_column_that_is_not_tried_moves_nothing() -> None:
    """Instants of an instrument that no run has are free, and move no hull."""
    ship = sailed()
    runs = [replace(run, measured=_without_yaw(run.measured)) for run in ship.runs[:2]]
    fit = fit_plain(runs, ship.spec, WORKERS).fit
    found = with_instants(_unsure(fit, LATE["gyro_latency"], (0,)), WORKERS)
    assert found.fit.hull == pytest.approx(fit.hull, rel=1e-12)
    assert np.max(np.abs(found.covariance)) < 1e-12


def _without_yaw(measured: Float) -> Float:
    made = measured.copy()
    made[:, 1] = np.nan
    return made


def test_instants_of_rows_follow_a_lateness_that_is_only_considered() -> None:
    """Beside the one joint inverse of hull, rows and lateness, the lateness held at what is known of it."""
    ship = sailed(name="usv")
    fit = fit_plain([with_slope(run) for run in ship.runs[:2]], ship.spec, WORKERS).fit
    unsure = _unsure(fit, InstantErrors(heading_s=0.05, smoothing_s=0.03), (0,))
    found = with_instants(unsure, WORKERS)
    (row,), (smoothed,) = unsure_instants._rows(unsure, WORKERS), unsure_instants._smoothed(unsure, WORKERS)
    assert row.logs == smoothed.logs == [0]
    parts = []
    first = 0
    least, most = level_bounds(ship.spec)
    for filtered, line, at in zip(unsure.runs, unsure.linearised, unsure.levels, strict=True):
        late = [one.column[first : first + line.u.size] * (filtered.run.day == 0) for one in (row, smoothed)]
        own = np.column_stack([line.J, *late])
        levels = [k for k, i in enumerate(line.index) if i >= 6]
        # one at its bound is known, as in the covariance of the fit
        unknown = [k for k in levels if least[line.index[k] - 6] < at[line.index[k] - 6] < most[line.index[k] - 6]]
        basis = np.linalg.qr(own[:, unknown])[0]
        parts.append((own - basis @ (basis.T @ own))[:, [k for k in range(own.shape[1]) if k not in levels]])
        first += line.u.size
    J = np.concatenate(parts)
    estimated = J[:, :7].T @ J[:, :7] + np.diag([0.0] * 6 + [row.std_s[0] ** -2.0])
    estimated[:6, :6] = np.linalg.inv(unsure.covariance)
    # of parameters that are estimated: their own errors, and what the considered one makes of them
    own = np.linalg.inv(estimated)
    moved = own @ (J[:, :7].T @ J[:, 7])
    wanted = (own + np.outer(moved, moved))[:6, :6] - unsure.covariance
    size = np.sqrt(np.abs(np.diag(wanted)))
    np.testing.assert_allclose(found.covariance / np.outer(size, size), wanted / np.outer(size, size), atol=1e-5)
