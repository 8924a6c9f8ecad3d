"""How intervals are held against measured overshoots."""

from math import radians

import numpy as np
import pytest

from kempf.pipeline.manoeuvre.own_zigzags import own_zigzags
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.pipeline.manoeuvre.sailed import Reach
from kempf.pipeline.manoeuvre.turning_circle import TurningCircle
from kempf.pipeline.simulate.hulls import HULLS
from tests.manoeuvre.ships import identified, ship_of


def _overshoots(spread: float, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    predicted = random.uniform(5.0, 20.0, 400)
    measured = predicted + spread * random.standard_normal(400)
    return np.column_stack([measured, predicted, predicted - 1.96, predicted + 1.96])


def test_intervals_that_hold_what_they_should_stay() -> None:
    made = own_zigzags(_overshoots(1.0), 200)
    assert made.factor < 1.1
    assert made.inside == pytest.approx(380, abs=15)


def test_a_model_that_misses_by_threefold_errors_is_widened_threefold() -> None:
    made = own_zigzags(_overshoots(3.0), 200)
    assert made.factor == pytest.approx(3.0, rel=0.15)
    assert made.rms_deg == pytest.approx(3.0, rel=0.1)
    assert "intervals widened" in made.sentence


def test_one_gust_widens_nothing_and_few_overshoots_say_nothing() -> None:
    calm = _overshoots(0.5)
    calm[0, 0] += 50.0
    assert own_zigzags(calm, 200).factor == 1.0
    few = own_zigzags(_overshoots(9.0)[:3], 2)
    assert few.factor == 1.0
    assert "too few" in few.sentence
    assert "too few" in own_zigzags(np.zeros((0, 4)), 0).sentence


def test_a_wider_prediction_keeps_its_value_and_its_probabilities_follow() -> None:
    logs = Reach(0.1, 0.3, radians(20.0), 7.0, 8.0)
    advance = TurningCircle(radians(35.0)).sailed(ship_of(HULLS["mariner"]))
    assert advance is not None
    # a length at which the criterion is met by a small margin
    length = 1.02 * advance.figures["advance_m"] / 4.5
    made = predict([identified(ship_of(HULLS["mariner"]))], TurningCircle(radians(35.0)), logs, length, 64)
    wide = made.widened(5.0)
    one, other = made.figures["advance_m"], wide.figures["advance_m"]
    assert one.value == other.value
    assert other.low - other.value == pytest.approx(5.0 * (one.low - one.value))
    assert 0.5 < wide.imo[0].probability < made.imo[0].probability
    assert made.widened(1.0) is made
