"""Diagnoses of a ship with a hidden effect, made by a plant of its own: none, a lag, a drag, one of no catalogue."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from kempf.pipeline.diagnose.screening.forward_selection import added, is_ship
from kempf.pipeline.diagnose.screening.ridge_reference import ridge_reference_of
from kempf.pipeline.diagnose.screening.screen import Candidate, score
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.screening.unsure_instants import WithInstants
from kempf.pipeline.diagnose.settings import DiagnosisSettings
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.diagnose.steps import by_likelihood
from kempf.pipeline.diagnose.steps.by_likelihood import only_fitted
from kempf.pipeline.diagnose.steps.by_prediction import _stands
from kempf.pipeline.diagnose.steps.confirm import Confirmation, Unseen
from kempf.pipeline.diagnose.steps.ladder import Ladder
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis, diagnose
from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json
from kempf.pipeline.diagnose.verdicts.effect_finding import finding, refusal
from kempf.pipeline.diagnose.verdicts.remainder import something_left
from kempf.pipeline.diagnose.verdicts.sentences import sentences
from kempf.pipeline.diagnose.verdicts.verdict import verdict
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.iteration import SILENT
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.model.terms.own import from_expression
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.left_out import LeftOut
from kempf.schemas import effects
from kempf.schemas.errors import DataRejected
from tests.diagnose.heard import Heard
from tests.diagnose.sailing import SOME, WORKERS, Sailed, sailed

LAG = ("rudder_lag", "cross_flow_drag")


@pytest.fixture(scope="module")
def calm() -> tuple[Sailed, Diagnosis]:
    ship = sailed("none")
    return ship, ship.diagnosis((*SOME, "heading_misalignment", "heading_latency", "gyro_latency"))


@pytest.fixture(scope="module")
def late() -> tuple[Sailed, Diagnosis]:
    # of most seeds such a lag bends the plain hull to no ship, which has no error to fall
    ship = sailed("rudder_lag", strength=1, seed=10)
    return ship, ship.diagnosis(LAG)


@pytest.fixture(scope="module")
def dragged() -> tuple[Sailed, Diagnosis]:
    ship = sailed("cross_flow_drag")
    return ship, ship.diagnosis(("cross_flow_drag", "sway_quadratic", "gyro_bias"))


def value_of(diagnosis: Diagnosis, name: str) -> tuple[float, float]:
    fit = diagnosis.steps[-1].fit
    at = fit.model.names.index(name)
    return float(fit.values[at]), float(agreement_of(fit).widened * fit.std[6 + at])


def test_nothing_is_claimed_of_a_ship_without_an_effect(calm: tuple[Sailed, Diagnosis]) -> None:
    ship, found = calm
    assert verdict(found) == "adequate"
    assert len(found.steps) == 1
    assert len(found.fitted) == 3 and len(found.held) == 1
    shown = as_json(found)
    assert shown["sets"] == [] and {c["verdict"] for c in shown["candidates"]} <= {"absent", "not_testable"}
    assert shown["ladder"][0]["held_out_error"] < 0.1
    said, noise, place = sentences(found)
    assert said == "No effect of the catalogue improves the prediction of manoeuvres that were not fitted."
    # her zigzags are each on a heading of its own: nothing repeats itself
    assert noise.startswith("How much of the misfit one leg ahead is noise of the experiment is not known: ")
    assert place.startswith("The misfit one leg ahead is largest in ")
    remaining = shown["remaining_misfit"]
    assert remaining["noise_share"] is None and remaining["pairs"] < 10
    assert sum(remaining["channels"].values()) == pytest.approx(1.0)
    assert {one["name"] for one in remaining["places"] if one["by"] == "manoeuvre"} == {run.name for run in ship.runs}


def test_a_lag_is_found_with_its_size_and_the_held_out_error_falls(late: tuple[Sailed, Diagnosis]) -> None:
    ship, found = late
    assert verdict(found) == "explained"
    assert [step.added.name for step in found.steps[1:] if step.added] == ["rudder_lag"]
    tau, std = value_of(found, "rudder_lag.tau")
    assert 0.0 < std < 0.2 and abs(tau - ship.c) < 3.0 * std
    first, last = found.steps[0], found.steps[-1]
    assert first.held_out_error is not None and last.held_out_error is not None
    assert last.held_out_error < 0.5 * first.held_out_error
    # what the wind had to explain is the rudder's now
    assert last.intensities[0] < 0.2 * first.intensities[0]
    assert found.before is not None and found.after is not None
    assert found.after.gain < 0.2 * found.before.gain
    said = sentences(found)
    assert f"tau = {tau:.3f} ± {std:.3f} s (1 s.e.)" in said[0] and "held-out" in said[5]
    assert "noise of the experiment" in said[3] and said[4].startswith("What is left is largest in ")
    # fitted to legs, as predictions take it, the plain model hides most of the lag
    assert first.predicts_by_legs and not last.predicts_by_legs
    (by_legs,) = first.free_runs(by_legs=True)[1]
    assert by_legs.relative_error < 0.5 * first.held_out_error
    assert f"is {100.0 * by_legs.relative_error:.1f} % in held-out manoeuvres" in said[5]


def test_a_lag_that_leaves_no_ship_without_it_is_found_with_its_size() -> None:
    """Five seconds: fitted without it, sway feeds itself and the rudder turns her the wrong way."""
    ship = sailed("rudder_lag", seed=5)
    chosen, _ = split(ship.runs)
    plain = fit_plain([ship.runs[i] for i in chosen], ship.spec, WORKERS)
    bent = plain.fit
    assert not is_ship(bent)
    # some top of several, none of which is a ship; runs by themselves may have no quicker hulls
    assert bent.log_likelihood > 9300.0
    assert plain.agreement.statistic < 10.0
    found = added(bent, score(bent, effects.get("rudder_lag"), WORKERS), WORKERS)
    assert is_ship(found)
    assert found.log_likelihood > bent.log_likelihood + 300.0
    assert abs(found.values[0] - ship.c) < 3.0 * found.std[6]


def test_a_drag_is_in_the_named_set(dragged: tuple[Sailed, Diagnosis]) -> None:
    ship, found = dragged
    assert verdict(found) in ("explained", "ambiguous")
    named = [c.effect.name for c, _ in found.steps[1].chosen_from]
    assert "cross_flow_drag" in named
    if found.steps[1].added is not None and found.steps[1].added.name == "cross_flow_drag":
        c, std = value_of(found, "cross_flow_drag.c")
        assert abs(c - ship.c) < 3.0 * std
    last = {one["effect"]: one for one in as_json(found)["candidates"]}
    assert last["cross_flow_drag"]["verdict"] == "present" and last["gyro_bias"]["verdict"] == "absent"


def test_an_effect_that_no_catalogue_names_is_not_given_a_wrong_name() -> None:
    found = sailed("kick_at_executes").diagnosis(("yaw_quadratic", "gyro_bias"))
    assert verdict(found) == "unexplained"
    shown = as_json(found)
    assert any(said.startswith("None of the known effects explains") for said in shown["sentences"])
    assert all(one["verdict"] != "present" for one in shown["candidates"])
    assert shown["left_over"]["gain_after"] > 12.0 and len(shown["left_over"]["runs"]) == 3
    assert "{" not in "".join(shown["sentences"])


def test_a_force_by_a_harmonic_of_the_heading_is_left_over() -> None:
    ship = sailed("heading_harmonic")
    _, fits = staged(ship.runs, ship.spec, [], WORKERS)
    found = ridge_reference_of(fits[-1], WORKERS)
    assert found.repeats and found.gain > 40.0
    other = sailed("none")
    _, fits = staged(other.runs, other.spec, [], WORKERS)
    assert ridge_reference_of(fits[-1], WORKERS).gain < 8.0


def test_a_small_rest_of_a_strong_effect_is_no_sign_of_another(late: tuple[Sailed, Diagnosis]) -> None:
    _, found = late
    assert found.before is not None and found.after is not None
    gains = np.full_like(found.after.gains, 1.0)

    def left(before: float, after: float, gains: np.ndarray = gains) -> bool:
        assert found.before is not None and found.after is not None
        first, last = replace(found.before, gain=before), replace(found.after, gain=after, gains=gains)
        there = with_direction(found, np.sqrt(before / found.before.gain))
        return something_left(there.steps, first, last)

    # a hundredth of what it was, eight and more as that is; a tenth; little of little; in one run of three alone
    assert not left(1300.0, 13.0) and not left(20.0, 7.0)
    assert left(1300.0, 130.0) and left(20.0, 9.0)
    assert not left(1300.0, 130.0, np.array([131.0, -0.5, -0.5]))


def with_direction(found: Diagnosis, times: float) -> Diagnosis:
    """The same diagnosis, the effect it found of so many times the size."""
    (candidate, refit), *others = found.steps[1].chosen_from
    larger = replace(candidate, direction=candidate.direction * times)
    return replace(found, steps=(found.steps[0], replace(found.steps[1], chosen_from=((larger, refit), *others))))


def test_what_the_reference_should_see_and_does_not_is_no_effect(
    dragged: tuple[Sailed, Diagnosis], calm: tuple[Sailed, Diagnosis]
) -> None:
    _, found = dragged
    assert found.before is not None
    direction = found.steps[1].chosen_from[0][0].direction
    foreseen = found.before.foreseen(direction)
    # a drag is made of what the reference is made of: it sees all of it, half the score, and in truth it did
    assert 0.4 < foreseen / float(direction @ direction) < 0.55
    assert found.before.gain > 0.8 * foreseen
    assert not something_left(found.steps, found.before, found.after)
    unseen = replace(found.before, gain=0.3 * foreseen)
    by_likelihood = (found.steps[0], replace(found.steps[1], stability=None))
    assert something_left(by_likelihood, unseen, found.after)
    # what predictions of legs chose is there all the same
    assert not something_left((found.steps[0], replace(found.steps[1], stability=1.0)), unseen, found.after)
    # of little that it should see chance takes all away, of much it does not
    small = with_direction(replace(found, steps=by_likelihood), np.sqrt(3.0 / foreseen))
    assert not something_left(small.steps, replace(found.before, gain=-5.0), found.after)
    assert something_left(by_likelihood, replace(found.before, gain=-5.0), found.after)
    # and beside a hull that is no ship the reference is no measure
    hull = found.steps[0].fit.hull * np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
    bent = replace(found.steps[0], fit=replace(found.steps[0].fit, hull=hull))
    assert not something_left((bent, by_likelihood[1]), unseen, found.after)
    # a bias of the gyro does nothing that drift, turn, rudder or heading do
    _, quiet = calm
    bias = score(quiet.steps[0].fit, effects.get("gyro_bias"), WORKERS).direction
    assert quiet.before is not None and quiet.before.foreseen(bias) < 0.05 * float(bias @ bias)


def test_an_antenna_is_not_claimed_off_the_ship() -> None:
    """A shear along a bank looks like an antenna three quarters of her length from its place."""
    found = sailed("bank_shear", strength=1).diagnosis(("antenna_lever", "gyro_bias"))
    ((candidate, refit),) = found.steps[0].refused
    assert candidate.effect.name == "antenna_lever" and refit.likelihood_ratio > 50.0
    assert 0.6 * found.fitted[0].ship.length_m < abs(float(refit.fit.values[0])) < 200.0
    assert refusal(refit) == "its size is at the limit of what is physical"
    assert len(found.steps) == 1


def test_a_constant_moment_is_seen_by_the_reference_too() -> None:
    """The rudder's neutral angle: what acts all the time alike is made of no drift, turn, order or heading."""
    ship = sailed("neutral_angle", strength=1)
    found = ship.diagnosis(("neutral_angle", "yaw_quadratic", "gyro_bias"))
    assert verdict(found) == "explained"
    c, std = value_of(found, "neutral_angle.c")
    assert abs(c - ship.c) < 3.0 * std
    assert found.before is not None
    foreseen = found.before.foreseen(found.steps[1].chosen_from[0][0].direction)
    assert found.before.gain > 0.8 * foreseen > 10.0


def test_what_the_logs_lack_or_zigzags_cannot_tell_is_not_testable(calm: tuple[Sailed, Diagnosis]) -> None:
    _, found = calm
    findings = {one.effect.name: finding(found, one) for one in found.steps[0].screened}
    assert findings["heading_misalignment"].verdict in ("absent", "not_testable")
    lacking = replace(found.steps[0].screened[0], missing=("water_depth",))
    said = finding(found, lacking)
    assert said.verdict == "not_testable" and "water_depth" in said.why


def test_held_out_runs_change_no_fitted_bit(late: tuple[Sailed, Diagnosis]) -> None:
    ship, found = late
    (out,) = split(ship.runs)[1]
    measured = ship.runs[out].measured + np.random.default_rng(1).normal(0.0, 0.05, ship.runs[out].measured.shape)
    runs = tuple(replace(run, measured=measured) if k == out else run for k, run in enumerate(ship.runs))
    again = replace(ship, runs=runs).diagnosis(LAG, settings=DiagnosisSettings(most_steps=0))
    first, other = found.steps[0], again.steps[0]
    assert np.array_equal(other.fit.hull, first.fit.hull) and np.array_equal(other.fit.levels, first.fit.levels)
    assert other.fit.log_likelihood == first.fit.log_likelihood
    assert [c.score for c in other.screened] == [c.score for c in first.screened]
    assert other.held_out_error != first.held_out_error


def test_what_the_effects_bring_that_a_model_has_already_is_said_first(late: tuple[Sailed, Diagnosis]) -> None:
    ship, found = late
    none = DiagnosisSettings(most_steps=0)
    again = ship.diagnosis(LAG, settings=none, given=[effects.get("rudder_lag")])
    share = as_json(found)["share_explained"]
    assert as_json(found)["share_explained_before"] is None
    # as much as the step of it explains
    assert as_json(again)["share_explained_before"] == pytest.approx(share, abs=0.02)
    assert as_json(again)["share_explained"] is None
    first = sentences(again)[0]
    assert (
        first.startswith("Already in the model: first-order rudder lag.") and f"explains {100 * share:.0f} %" in first
    )


def test_zigzags_to_one_side_alone_claim_no_asymmetry() -> None:
    """Twenty and fifteen degrees, both first to starboard: what is one side's and what is a bias is hardly seen."""
    ship = sailed("none")
    numbers = [0, 2]
    found = replace(ship, runs=tuple(ship.runs[k] for k in numbers)).diagnosis(
        ("rudder_asymmetry", "neutral_angle", "gyro_bias")
    )
    assert verdict(found) == "insufficient_data" and not found.held
    assert {one["verdict"] for one in as_json(found)["candidates"]} <= {"absent", "not_testable"}


def test_an_effect_that_runs_away_is_no_crash() -> None:
    """A division by what the ship's own motion takes through zero."""
    ship = sailed("none")
    wild = from_expression(("yaw: c*V/(v - 0.31)",), "wild")
    found = diagnose(
        *(ship.runs[:2], ship.spec, {"wild": wild}, WORKERS),
        settings=DiagnosisSettings(level=1.0, refits=1, most_steps=1),
    )
    assert len(found.steps) == 1 and verdict(found) in ("adequate", "insufficient_data")
    (one,) = as_json(found)["candidates"]
    assert one["verdict"] != "present" and one["why"]


def test_one_manoeuvre_is_not_enough() -> None:
    ship = sailed("none")
    found = replace(ship, runs=ship.runs[:1]).diagnosis(("gyro_bias",))
    assert verdict(found) == "insufficient_data"
    assert not found.held and found.steps[0].held_out_error is None
    assert "sail at least three zigzags" in sentences(found)[-1]


def test_the_speed_lost_in_a_turn_is_looked_for_only_where_no_log_shows_it() -> None:
    ship, effect = sailed("none"), effects.get("speed_loss")
    none = DiagnosisSettings(most_steps=0)
    (one,) = as_json(ship.diagnosis(("speed_loss",), settings=none))["candidates"]
    assert one["verdict"] == "not_testable" and np.isnan(one["score"])
    assert one["why"] == "the logs have speed_through_water, which measures it already"
    with pytest.raises(DataRejected, match="speed_through_water") as caught:
        staged(ship.runs[:1], ship.spec, [effect], WORKERS)
    assert caught.value.code == "effect_not_testable"
    # one run without a log is enough to ask
    runs = (*ship.runs[:1], *(replace(run, channels=run.channels - {"speed_through_water"}) for run in ship.runs[1:]))
    (one,) = as_json(replace(ship, runs=runs).diagnosis(("speed_loss",), settings=none))["candidates"]
    assert np.isfinite(one["score"])


def test_what_legs_show_of_an_instrument_must_hold_by_likelihood_too(calm: tuple[Sailed, Diagnosis]) -> None:
    """A disturbance may carry a force that is missing, one step ahead; it never carries a reading."""
    _, found = calm
    for name, stands in (("gyro_bias", False), ("cross_flow_drag", True)):
        candidate = next(one for one in found.steps[0].screened if one.effect.name == name)
        assert _stands(candidate, refitted(1.0)) is stands
        assert _stands(candidate, refitted())
        assert not _stands(candidate, replace(refitted(), at_bound=True))


def test_a_channel_that_the_runs_lack_is_named() -> None:
    ship = sailed("none")
    runs = tuple(replace(run, channels=run.channels - {"water_depth"}) for run in ship.runs)
    found = replace(ship, runs=runs).diagnosis(("shallow_water",), settings=DiagnosisSettings(most_steps=0))
    (one,) = as_json(found)["candidates"]
    assert one["verdict"] == "not_testable" and one["why"] == "not in the logs: water_depth"
    assert np.isnan(one["score"])


def refitted(likelihood_ratio: float = 500.0) -> Confirmation:
    """A refit that gains so much everywhere, worth two parameters."""
    fit = cast(PooledFit, SimpleNamespace(log_likelihood=100.0))
    return Confirmation(
        fit=fit,
        stated=WithInstants(fit, np.zeros((7, 7))),
        likelihood_ratio=likelihood_ratio,
        bic_change=10.0 - likelihood_ratio,
        fold_gains=np.ones(3),
        held_out_gains=np.ones(1),
        at_bound=False,
        absent=False,
        unseen=Unseen(np.ones(3), np.ones(1)),
    )


def test_an_effect_that_the_refit_leaves_nothing_of_is_not_claimed() -> None:
    """From a hull at a lower maximum a refit may gain much by the hull alone."""
    sound = refitted()
    assert sound.holds
    nothing = replace(sound, absent=True)
    assert not nothing.holds and refusal(nothing) == "the refit leaves nothing of it"


@pytest.mark.parametrize(
    ("folds", "held_out", "why"),
    [
        ([5.0, -1.0, -1.0], [-1.0], "it predicts only 1 of 4 manoeuvres better that it was not fitted to"),
        (
            *([1.0, 1.0, 1.0], [-9.0]),
            "of 4 manoeuvres that it was not fitted to it predicts 3 better and 1 worse by more",
        ),
    ],
)
def test_what_only_improves_the_fit_is_suspected(folds: list[float], held_out: list[float], why: str) -> None:
    found = replace(refitted(), fold_gains=np.array(folds), held_out_gains=np.array(held_out))
    assert not found.holds and refusal(found) == why
    candidate = cast(Candidate, SimpleNamespace(effect=effects.get("rudder_lag")))
    assert only_fitted([(candidate, found)]) == {"rudder_lag": f"it improves the fit; {why}"}
    # one that holds is claimed, one that is not worth its parameters is absent
    assert only_fitted([(candidate, refitted()), (candidate, replace(found, bic_change=-1.0))]) == {}


def test_one_manoeuvre_alone_confirms_nothing_and_refutes_nothing() -> None:
    """What it was fitted to is none that it was not fitted to."""
    found = replace(refitted(), fold_gains=np.zeros(1), held_out_gains=np.zeros(0))
    assert not found.predicts and found.gains_left_out.size == 0 and found.gained_in == (0, 0)
    assert refusal(found) == "one manoeuvre alone does not confirm it"


def with_left_out(misfits: list[float], values: tuple[float, ...] = (), disagrees: object = None) -> Ahead:
    """One leg ahead: errors of three manoeuvres left out, and the size of an effect beside a standard error of 1."""
    errors = tuple(np.full((8, 1), misfit) for misfit in misfits)
    return cast(
        Ahead,
        SimpleNamespace(
            left_out=LeftOut(np.array(misfits), errors),
            disagrees=disagrees,
            model=SimpleNamespace(own=lambda _: slice(0, len(values))),
            fit=SimpleNamespace(values=np.array(values)),
            std=np.ones(6 + len(values)),
        ),
    )


@pytest.mark.parametrize(("after", "raises"), [([1.0, 1.0, 1.01], False), ([1.0, 1.0, 2.0], True), ([0.5] * 3, False)])
def test_what_raises_the_misfit_of_manoeuvres_left_out_is_not_claimed(after: list[float], raises: bool) -> None:
    """Also where it rises in one alone, so that two standard errors do not show it."""
    assert by_likelihood._raises(with_left_out([1.0, 1.0, 1.0]), with_left_out(after)) == raises
    assert not by_likelihood._raises(None, with_left_out(after))


@pytest.mark.parametrize(
    ("effect", "size", "disagrees", "nothing"),
    [
        ("earth_current", (1.5, -0.5), object(), True),
        ("earth_current", (1.5, -2.5), object(), False),
        # predictions go by the likelihood's parameters
        ("earth_current", (1.5, -0.5), None, False),
        # legs say little of an instrument
        ("gyro_bias", (0.5,), object(), False),
    ],
)
def test_an_effect_that_is_nothing_by_the_fit_that_predicts_is_not_claimed(
    effect: str, size: tuple[float, ...], disagrees: object, nothing: bool
) -> None:
    ahead = with_left_out([1.0] * 3, size, disagrees)
    last = cast(Step, SimpleNamespace(fit=object()))
    shooting = SimpleNamespace(beside=lambda ahead, _: ahead)
    ladder = cast(Ladder, SimpleNamespace(shooting=shooting, probe=last.fit))
    pair = (cast(Candidate, SimpleNamespace(effect=effects.get(effect))), refitted())
    assert by_likelihood._is_nothing_by_legs(ladder, last, ahead, pair) == nothing


def test_legs_are_held_against_the_refit_without_what_is_immaterial() -> None:
    """They are not fitted with it: the refit beside it has parameters that they lack."""
    ahead, last, alone = (
        with_left_out([1.0] * 3, (0.5,), object()),
        cast(Step, SimpleNamespace(fit=object())),
        refitted(),
    )
    asked = []

    def beside(ahead: Ahead, fit: object) -> Ahead:
        asked.append(fit)
        return ahead

    ladder = SimpleNamespace(
        shooting=SimpleNamespace(beside=beside),
        probe=object(),
        refitted=lambda rung, effect: (effect, alone) if rung is last else None,
    )
    pair = (cast(Candidate, SimpleNamespace(effect=effects.get("rudder_lag"))), refitted())
    assert by_likelihood._is_nothing_by_legs(cast(Ladder, ladder), last, ahead, pair)
    assert asked == [alone.fit] and alone.fit is not pair[1].fit


def test_a_model_whose_fits_disagree_is_not_adequate(calm: tuple[Sailed, Diagnosis]) -> None:
    """The flexible reference may see nothing left one step ahead, where disturbances carry what is missing."""
    found = calm[1]
    (first,) = found.steps
    assert first.ahead is not None and first.ahead.disagrees is None and verdict(found) == "adequate"
    own = first.ahead.own
    windows = tuple(errors * np.linspace(9.0, 11.0, len(errors))[:, None] for errors in own.errors)
    worse = LeftOut(10.0 * own.misfits, windows)
    apart = replace(found, steps=(replace(first, ahead=replace(first.ahead, one_step=worse)),))
    assert verdict(apart) == "unexplained" and not as_json(apart)["sets"]
    said = " ".join(sentences(apart))
    assert "Fits one step and one leg ahead disagree: with parameters fitted to legs the misfit is 90 % smaller" in said
    assert "No effect of the catalogue improves" not in said


@pytest.mark.parametrize("wrong", range(6))
def test_a_hull_of_which_a_sign_is_wrong_is_no_ship(wrong: int) -> None:
    run = SimpleNamespace(ship=SimpleNamespace(length_m=1.0))
    hull = np.array([-0.7, -0.3, -3.8, -4.0, -0.36, 2.7])
    fit = cast(PooledFit, SimpleNamespace(hull=hull, runs=[SimpleNamespace(run=run)]))
    assert is_ship(fit)
    # of the same numbers a longer one would answer faster than vessels do
    run.ship.length_m = 3.0
    assert not is_ship(fit)
    run.ship.length_m = 1.0
    hull[wrong] *= -1.0
    # a12 may have either sign
    assert is_ship(fit) == (wrong == 1)


def test_what_raced_in_vain_races_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    ratios, raced = {"dead_time": -3.0, "backlash": 8.0}, []

    def confirmed(_base: object, _alone: object, candidate: Candidate, *_: object, race: bool) -> SimpleNamespace:
        raced.append((candidate.effect.name, race))
        return SimpleNamespace(likelihood_ratio=ratios[candidate.effect.name], outdone=False)

    monkeypatch.setattr("kempf.pipeline.diagnose.steps.ladder.confirm", confirmed)
    ladder = Ladder(None, {}, (), WORKERS, DiagnosisSettings(), SILENT, cast(PooledFit, None))
    alone = cast(Unseen, None)
    for base in (cast(PooledFit, object()), cast(PooledFit, object())):
        for name in ratios:
            candidate = cast(Candidate, SimpleNamespace(effect=effects.get(name)))
            ladder.confirmed(base, alone, candidate)
    assert raced == [("dead_time", True), ("backlash", True), ("dead_time", False), ("backlash", True)]


def test_an_effect_that_races_no_more_climbs_from_the_hull_at_hand(late: tuple[Sailed, Diagnosis]) -> None:
    base = late[1].steps[-1].fit
    candidate = score(base, effects.get("dead_time"), WORKERS)

    def climbs(*, race: bool) -> list[int]:
        heard = Heard()
        added(base, candidate, WORKERS, listener=heard, race=race)
        return [climb[0].runs for climb in heard.climbs]

    few = min(len(base.runs), 3)
    assert climbs(race=True)[:7] == [few] * 7
    assert climbs(race=False) == [len(base.runs)]


@pytest.mark.parametrize("stability", [None, 1.0])
def test_what_was_taken_for_the_true_effect_goes_when_that_is_added(
    stability: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lag_first(ladder: Ladder, steps: list[Step]) -> list[Step]:
        (lag,) = (one for one in steps[0].screened if one.effect.name == "rudder_lag")
        made = ladder.confirmed(steps[0].fit, ladder.unseen(steps[0]), lag)
        step = ladder.stepped(((lag, made),), (), ladder.ahead(steps[0], lag.effect), stability)
        ladder.probe = step.fit
        return [*steps, replace(step, together=("rudder_lag", "wind_force") if stability else ())]

    # the lag keeps several standard errors beside the dead time
    ship = sailed("dead_time", strength=1, seed=4)
    monkeypatch.setattr("kempf.pipeline.diagnose.verdicts.diagnosis.predicting_better", lag_first)
    found = ship.diagnosis(("rudder_lag", "dead_time"))
    (step,) = found.steps[1:]
    assert step.added is not None and step.added.name == "dead_time"
    # in the place of what predictions chose, which stays in the set: the claim is not lost with the name
    assert step.stability == stability
    assert step.together == (("dead_time", "wind_force") if stability else ())
    others = [candidate.effect.name for candidate, _ in step.chosen_from[1:]]
    assert ("rudder_lag" in others) is (stability is not None)
    tau, std = value_of(found, "dead_time.tau")
    assert abs(tau - ship.c) < 3.0 * std
