"""Readings that are too far apart for a ship: what she lacks is not testable, whatever the misfit."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from kempf.pipeline.diagnose.screening.found_instants import at_found_instants, fitted_runs
from kempf.pipeline.diagnose.screening.resolution import MAY_IMITATE, unresolved
from kempf.pipeline.diagnose.settings import DiagnosisSettings
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json
from kempf.pipeline.diagnose.verdicts.sentences import sentences
from kempf.pipeline.diagnose.verdicts.verdict import verdict
from tests.diagnose.sailing import Sailed, sailed

NOT_TESTABLE = "cannot be tested with these data"


def read_every(ship: Sailed, period_s: float) -> Sailed:
    return replace(ship, runs=tuple(replace(run, rudder_period_s=period_s) for run in ship.runs))


def test_too_far_apart_is_a_fifth_of_the_time_for_her_length_in_half_of_the_manoeuvres() -> None:
    runs = sailed("none").runs[:4]
    assert len(runs) == 4
    lengths = [run.ship.length_m / run.approach_m_s for run in runs]

    def read(*parts: float) -> tuple:
        return tuple(
            replace(run, heading_period_s=part * one) for run, one, part in zip(runs, lengths, parts, strict=True)
        )

    assert unresolved(read(0.19, 0.19, 0.19, 0.9)) is None
    found = unresolved(read(0.19, 0.19, 0.21, 0.9))
    assert found is not None and found.channel == "heading"
    assert found.period_s == pytest.approx(0.9 * lengths[3]) and found.length_s == pytest.approx(lengths[3])
    assert unresolved([replace(run, approach_m_s=0.0) for run in read(0.9, 0.9, 0.9, 0.9)]) is None


def test_a_run_knows_how_often_rudder_and_heading_were_read() -> None:
    for run in sailed("none").runs:
        assert (run.rudder_period_s, run.heading_period_s) == pytest.approx((0.5, 0.2), abs=0.01)


def test_without_a_claim_the_verdict_is_that_nothing_is_testable() -> None:
    settings = DiagnosisSettings(most_steps=0)
    ship = sailed("none")
    close, far = (one.diagnosis(("gyro_bias",), settings=settings) for one in (ship, read_every(ship, 30.0)))
    assert verdict(close) == "adequate" and as_json(close)["unresolved"] is None
    assert verdict(far) == "insufficient_data" and not as_json(far)["too_few_manoeuvres"]
    stated = as_json(far)["unresolved"]
    assert (stated["channel"], stated["period_s"]) == ("rudder", 30.0) and 15.0 < stated["length_s"] < 30.0
    (said,) = (one for one in sentences(far) if NOT_TESTABLE in one)
    assert said.startswith("What she lacks ") and "the rudder is read every 30 s" in said
    assert said.endswith("Log rudder and heading at 1 Hz or faster.") and said.endswith(stated["needed"])
    assert not any("three zigzags" in one for one in sentences(far))


@pytest.fixture(scope="module")
def dragged() -> Diagnosis:
    return read_every(sailed("cross_flow_drag"), 30.0).diagnosis(("cross_flow_drag", "gyro_bias"))


def test_what_predictions_chose_is_claimed_all_the_same(dragged: Diagnosis) -> None:
    assert [one["effects"] for one in as_json(dragged)["sets"]] == [["cross_flow_drag"]]
    assert all(step.stability is not None for step in dragged.steps[1:])
    assert verdict(dragged) == "partly_explained"
    said = sentences(dragged)
    assert any(one.startswith("What else she lacks ") and NOT_TESTABLE in one for one in said)
    assert not any("smooth force" in one or "disagree" in one for one in said)


def test_what_only_the_likelihood_sees_is_suspected() -> None:
    ship = sailed("gnss_latency")
    close, far = (one.diagnosis(("gnss_latency",)) for one in (ship, read_every(ship, 30.0)))
    by_likelihood = [step.added for step in close.steps[1:] if step.stability is None]
    assert [step.added for step in far.imitating] == by_likelihood and not far.something_left
    why = {one["effect"]: one["why"] for one in as_json(far)["suspected"]}
    assert all(why[effect.name].startswith(MAY_IMITATE) for effect in by_likelihood if effect is not None)
    assert by_likelihood and verdict(close) == "explained" and verdict(far) == "insufficient_data"


def test_what_is_certain_and_immaterial_is_suspected() -> None:
    ship = sailed("heading_misalignment")
    close, far = (one.diagnosis(("heading_misalignment",)) for one in (ship, read_every(ship, 30.0)))
    assert [one["effects"] for one in as_json(close)["immaterial"]] == [["heading_misalignment"]]
    assert as_json(far)["immaterial"] == []
    (candidate,) = as_json(far)["candidates"]
    assert (candidate["verdict"], candidate["why"]) == ("suspected", MAY_IMITATE)


def test_one_manoeuvre_with_slow_readings_has_both_reasons() -> None:
    ship = sailed("none")
    one = read_every(replace(ship, runs=ship.runs[:1]), 30.0).diagnosis(("gyro_bias",))
    assert verdict(one) == "insufficient_data" and as_json(one)["too_few_manoeuvres"]
    assert NOT_TESTABLE in sentences(one)[0] and "three zigzags" in sentences(one)[-1]


def test_instants_are_not_sought_of_such_a_ship() -> None:
    ship = read_every(sailed("none"), 30.0)
    with ThreadPoolExecutor(1) as workers:
        made = fitted_runs(ship.runs, ship.spec, (), workers)
        assert at_found_instants(made, lambda found: pytest.fail("runs are laid out anew"), (), workers) is made
