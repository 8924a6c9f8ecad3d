"""What a manoeuvre is worth is what the fits of such manoeuvres say afterwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.next_trial.planned_run import as_predicted
from kempf.pipeline.next_trial.worth import Known, apart, information, narrowed, probability, times_to_halve
from kempf.schemas.effects import get
from kempf.schemas.model_spec import N_HULL
from tests.diagnose.sailing import WORKERS, sailed

HULL = tuple(range(N_HULL))


def test_the_information_of_runs_is_that_of_the_fit_to_them() -> None:
    ship = sailed()
    fit = fit_plain(ship.runs[:3], ship.spec, WORKERS).fit
    total = sum(information(one, fit.point(k)) for k, one in enumerate(fit.runs))
    std = np.sqrt(np.diag(np.linalg.inv(total)))
    np.testing.assert_allclose(std, fit.std, rtol=0.03)


def test_another_run_like_those_before_narrows_as_one_run_more() -> None:
    ship = sailed()
    fit = fit_plain(ship.runs[:3], ship.spec, WORKERS).fit
    shares = narrowed(Known(HULL, fit.covariance), information(fit.runs[1], fit.point(1)))
    again = fit_plain([*ship.runs[:3], replace(ship.runs[1], name="again")], ship.spec, WORKERS).fit
    np.testing.assert_allclose(shares, again.std / fit.std, rtol=0.1)
    assert np.all(shares < 1.0)


def test_a_model_that_lacks_an_effect_falls_behind_by_what_the_effect_is_worth() -> None:
    ship, effect, c = sailed(), get("sway_quadratic"), 0.02
    fit = fit_plain(ship.runs[:3], ship.spec, WORKERS).fit
    levels, known = fit.levels[0], Known(HULL, fit.covariance)
    with_it = RunFilter(fit.runs[0].run, EffectModel((effect,)), ship.spec)
    true = Point(fit.hull, np.array([c]), levels)
    run = as_predicted(with_it, true)
    assert apart(replace(with_it, run=run), true, Known((*HULL, 6), np.eye(7))) == pytest.approx(0.0, abs=1e-9)
    # locally: c^2 times the information on c, the hull unknown but for what is known of it
    whole = information(replace(with_it, run=run), true)
    hull = whole[:N_HULL, :N_HULL] + np.linalg.inv(fit.covariance)
    left = whole[6, 6] - whole[6, :N_HULL] @ np.linalg.solve(hull, whole[:N_HULL, 6])
    lacks = replace(fit.runs[0], run=run)
    D = apart(lacks, Point(fit.hull, np.zeros(0), levels), known)
    assert pytest.approx(c**2 * left, rel=0.1) == D
    # half the effect, a quarter of it
    half = as_predicted(with_it, replace(true, values=np.array([0.5 * c])))
    quarter = apart(replace(lacks, run=half), Point(fit.hull, np.zeros(0), levels), known)
    assert quarter == pytest.approx(0.25 * D, rel=0.05)


def test_three_times_what_is_known_halves_an_error() -> None:
    known = Known((0, 1), np.diag([4.0, 9.0]))
    gained = np.diag([3.0 / 4.0, 1.0 / 9.0])
    np.testing.assert_allclose(narrowed(known, gained), [0.5, np.sqrt(0.5)])
    assert times_to_halve(known, gained, 0) == 1 and times_to_halve(known, gained, 1) == 3
    assert times_to_halve(known, 1e-6 * gained, 1) is None


def test_models_are_parted_half_the_time_where_the_lead_expected_is_the_one_that_is_asked_for() -> None:
    assert probability(6.0, 6.0) == pytest.approx(0.5)
    assert probability(0.0, 6.0) == 0.0 and probability(60.0, 6.0) > 0.99
