"""How predictions are held against measured overshoots, brought to them, and let scatter by what is missed."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from kempf.pipeline.manoeuvre.conditioned import OwnZigzag, conditioned
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.own_zigzags import MOST, REFERENCE, held_against, missed, scatter
from kempf.pipeline.manoeuvre.ship import Ship
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.simulate.hulls import HULLS
from kempf.schemas.confidence import NORMAL_95
from tests.manoeuvre.ships import identified, ship_of


def _overshoots(spread: float, half: float = NORMAL_95, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    predicted = random.uniform(5.0, 20.0, 400)
    measured = predicted + spread * random.standard_normal(400)
    return np.column_stack([measured, predicted, predicted - half, predicted + half])


def test_intervals_that_hold_what_they_should_scatter_nothing() -> None:
    good = _overshoots(1.0)
    assert not missed(good)
    assert held_against(good, 200).inside == pytest.approx(380, abs=15)
    assert scatter(_overshoots(0.9), good) == 0.0


def test_the_scatter_is_what_makes_the_intervals_hold() -> None:
    # errors of 1 deg, misses of 3: scatter has to give sqrt(8) deg, and gives 1.5 deg a reference
    found = scatter(_overshoots(3.0), _overshoots(0.0, half=1.5 * NORMAL_95))
    assert found == pytest.approx(REFERENCE * np.sqrt(8.0) / 1.5, rel=0.15)
    assert scatter(_overshoots(300.0), _overshoots(0.0)) == MOST
    said = replace(held_against(_overshoots(3.0), 200), scatter=found).sentence
    assert "let every parameter scatter by 5" in said


def test_one_gust_scatters_nothing_and_few_overshoots_say_nothing() -> None:
    calm = _overshoots(0.5)
    calm[0, 0] += 50.0
    assert not missed(calm)
    few = _overshoots(9.0)[:3]
    assert not missed(few)
    assert "too few" in held_against(few, 2).sentence
    assert "too few" in held_against(np.zeros((0, 4)), 0).sentence


def _zigzags(truth: Ship, model: Identified) -> list[OwnZigzag]:
    found = []
    for rudder in (10.0, 15.0, 20.0, 25.0):
        zigzag = PredictedZigzag(radians(10.0), radians(rudder), overshoots=2)
        made = zigzag.sailed(truth)
        assert made is not None
        measured = {name: value for name, value in made.figures.items() if name.startswith("overshoots")}
        found.append(OwnZigzag(model, zigzag, measured))
    return found


def test_a_model_off_by_many_errors_is_brought_to_the_overshoots_and_predicts_another_zigzag() -> None:
    truth = ship_of(HULLS["mariner"])
    wrong = replace(truth, hull=truth.hull * np.array([1.0, 1.0, 1.0, 1.08, 1.0, 0.95]))
    model = identified(wrong, relative=0.005)
    near = conditioned(model, _zigzags(truth, model))
    assert near.conditioned
    other = PredictedZigzag(radians(20.0), radians(20.0))

    def overshoot(ship: Ship) -> float:
        made = other.sailed(ship)
        assert made is not None
        return made.figures["overshoots_deg.0"]

    assert abs(overshoot(near.ship) - overshoot(truth)) < 0.1 * abs(overshoot(wrong) - overshoot(truth))
    assert np.all(np.linalg.eigvalsh(near.covariance) > -1e-15)


def test_few_overshoots_bring_nothing_nearer() -> None:
    truth = ship_of(HULLS["mariner"])
    model = identified(truth)
    assert conditioned(model, _zigzags(truth, model)[:2]) is model


def test_scattered_ships_differ_by_a_share_of_every_parameter() -> None:
    model = identified(ship_of(HULLS["mariner"], cross_flow_drag=(1.0,)), relative=0.0)
    drawn = np.array([[*ship.hull, *ship.effects] for ship in model.scattered(0.05).ships(256)])
    np.testing.assert_allclose(drawn.std(axis=0), 0.05 * np.abs([*model.hull, *model.effects]), rtol=0.2)
    sure = [ship.surge for ship in model.scattered_alone().ships(8)]
    assert np.ptp(sure, axis=0).max() == 0.0
