"""Noise that lasts is found where there is some, and nowhere else; it is no part of the ship."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.diagnose.hidden_effects import programme
from benchmarks.diagnose.hidden_effects.as_sold import RUDDER_OFF
from kempf.pipeline.diagnose.screening.instrument_noise import with_instrument_noise
from kempf.pipeline.diagnose.screening.joint_noise import with_joint_noise
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate import pooled_fit
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit, fit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.effects import get, require_free
from kempf.schemas.errors import UsageError
from kempf.schemas.instrument_noise import NAMES, lasting, lasting_noise
from tests.diagnose.sailing import WORKERS, sailed

#: Heading in the runs' measurements; standard deviation, rad, and duration, s, of what is put on it.
HEADING, STD, TAU = 2, 0.004, 6.0


def test_fresh_noise_is_left_as_it_is():
    ship = sailed()
    _, (fit,) = staged(ship.runs[:3], ship.spec, (), WORKERS)
    assert fit.model.effects == ()
    assert with_instrument_noise(fit, WORKERS) is fit


def test_a_heading_whose_errors_last_is_found_with_their_size_and_duration():
    ship = sailed()
    random = np.random.default_rng(5)
    runs = []
    for run in ship.runs[:3]:
        keeps = np.exp(-run.step_s / TAU)
        error = np.zeros(len(run.measured))
        for k in range(1, error.size):
            error[k] = keeps * error[k - 1] + STD * np.sqrt(1.0 - keeps**2) * random.standard_normal()
        measured = run.measured.copy()
        measured[:, HEADING] += error
        runs.append(replace(run, measured=measured))
    _, (fresh,) = staged(ship.runs[:3], ship.spec, (), WORKERS)
    _, (fit,) = staged(runs, ship.spec, (), WORKERS)
    found = dict(zip(fit.model.names, zip(fit.values, fit.std[6:], strict=True), strict=True))
    assert {name.partition(".")[0] for name in found} == {"heading_noise"}
    for name, truth in (("heading_noise.c", STD), ("heading_noise.tau", TAU)):
        value, std = found[name]
        assert abs(value - truth) < 4.0 * std < truth
    # the ship is hers as before
    assert fit.ship.model.effects == ()
    assert fit.ship.covariance.shape == (6, 6)
    assert np.all(np.abs(fit.hull - fresh.hull) < 4.0 * fit.ship.std)


def test_a_hull_that_bent_to_three_noises_is_left_for_the_higher_hill():
    # taken off one by one, noise of the heading gains nothing beside the hull that has bent to all three, or leaves a12
    # hundreds of times too large
    seed, name = 9, "tanker"
    ship = sailed(name=name, seed=seed, sold=True)
    _, (fit,) = staged(ship.runs[:2], ship.spec, (), WORKERS)
    assert {effect.name for effect in fit.model.effects} == set(NAMES)
    p = programme.ship(name, seed).parameters
    rudder = 1.0 + RUDDER_OFF
    truth = np.array([p.a11, p.a12, p.a21, p.a22, p.b1 / rudder, p.b2 / rudder])
    assert np.all(np.abs(fit.hull - truth) < 3.0 * fit.ship.std)


def test_joint_noise_on_the_same_hill_leaves_the_fit_as_it_is():
    ship = sailed(name="tanker", seed=6, sold=True)
    plain = fit_plain(ship.runs[:2], ship.spec, WORKERS).fit
    fit = with_instrument_noise(plain, WORKERS)
    assert fit.model.effects
    assert with_joint_noise(fit, 15.0, WORKERS) is fit


@pytest.mark.parametrize("higher", ["ship", "fit"])
def test_of_two_beginnings_the_higher_hill_is_taken(monkeypatch: pytest.MonkeyPatch, higher: str):
    ship = sailed()
    plain = fit_plain(ship.runs[:2], ship.spec, WORKERS).fit
    begun = []

    def climbed(runs, model, hull, levels, values, *_: Any, **__: Any) -> PooledFit:
        # the noises are asked one by one afterwards, with fewer of them
        if len(model.effects) < len(NAMES):
            return replace(plain, model=model, values=values, log_likelihood=plain.log_likelihood)
        begun.append("fit" if np.array_equal(hull, plain.hull) else "ship")
        gain = 200.0 if begun[-1] == higher else 100.0
        return replace(plain, model=model, hull=hull, values=values, log_likelihood=plain.log_likelihood + gain)

    monkeypatch.setattr("kempf.pipeline.diagnose.screening.joint_noise.refitted", climbed)
    made = with_joint_noise(plain, 15.0, WORKERS)
    assert begun == ["ship", "fit"]
    assert made.log_likelihood == plain.log_likelihood + 200.0
    assert np.array_equal(made.hull, plain.hull) == (higher == "fit")


#: what the two climbs gain, whether they reach their tops, and which one is taken
CLIMBS = [
    ((100.0, True), (200.0, True), "fit"),
    ((200.0, True), (100.0, True), "ship"),
    ((100.0, False), (80.0, True), "fit"),
    ((20.0, True), (100.0, False), None),
    ((20.0, True), (100.0, True), "fit"),
    ((20.0, True), (40.0, True), None),
]


@pytest.mark.parametrize(("ship_climb", "fit_climb", "taken"), CLIMBS)
def test_a_climb_that_counts_for_nothing_stands_in_no_ones_way(monkeypatch, ship_climb, fit_climb, taken):
    ship = sailed()
    plain = replace(fit_plain(ship.runs[:2], ship.spec, WORKERS).fit, converged=True)
    begun: list[str] = []

    def climbed(runs, model, hull, levels, values, *_: Any, **__: Any) -> PooledFit:
        if len(model.effects) < len(NAMES):
            return replace(plain, model=model, values=values)
        which = "fit" if np.array_equal(hull, plain.hull) else "ship"
        begun.append(which)
        gain, there = fit_climb if which == "fit" else ship_climb
        # one whose iterations ran out goes on, and rises further
        more = 50.0 * (begun.count(which) - 1)
        likely = plain.log_likelihood + gain + more
        return replace(plain, model=model, hull=hull, values=values, converged=there, log_likelihood=likely)

    monkeypatch.setattr("kempf.pipeline.diagnose.screening.joint_noise.refitted", climbed)
    made = with_joint_noise(plain, 15.0, WORKERS)
    if taken is None:
        assert made is plain
    else:
        assert np.array_equal(made.hull, plain.hull) == (taken == "fit") and made is not plain


def test_joint_noise_whose_iterations_run_out_next_to_the_top_goes_on(monkeypatch: pytest.MonkeyPatch):
    ship = sailed(name="tanker", seed=6, sold=True)
    plain = fit_plain(ship.runs[:2], ship.spec, WORKERS).fit
    whole, climbs = with_joint_noise(plain, 15.0, WORKERS), []
    assert whole is not plain and whole.converged

    def cut_short(*given: Any, **named: Any) -> PooledFit:
        made = fit(*given, **(named if climbs else named | {"max_iterations": 6}))
        climbs.append(made)
        return made

    monkeypatch.setattr(pooled_fit, "fit", cut_short)
    found = with_joint_noise(plain, 15.0, WORKERS)
    assert not climbs[0].converged and climbs[0].log_likelihood > plain.log_likelihood + 45.0
    assert found.converged and found.log_likelihood == pytest.approx(whole.log_likelihood, abs=0.05)


def test_the_ship_of_a_model_is_what_moves_her():
    model = EffectModel((lasting_noise()["yaw_rate_noise"], get("wind_force"), lasting_noise()["heading_noise"]))
    assert [effect.name for effect in model.ship.effects] == ["wind_force"]
    assert model.of_ship.tolist() == [False, False, True, True, False, False]


def test_noise_brings_its_states_beside_those_of_effects():
    own = (get("waves"), get("memory"))
    assert EffectModel((*own, *lasting_noise().values())).extra == 6


@pytest.mark.parametrize("name", NAMES)
def test_no_effect_bears_the_name_of_a_noise(name):
    assert lasting(lasting_noise()[name])
    with pytest.raises(UsageError, match="noise of instruments"):
        require_free(name)
