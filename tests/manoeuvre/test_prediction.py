"""Intervals, criteria and refusals of predicted manoeuvres."""

from math import radians

import numpy as np
import pytest

from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.prediction import predict
from kempf.pipeline.manoeuvre.sailed import Reach
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.segment.particulars import Particulars
from kempf.pipeline.simulate.hulls import HULLS
from kempf.schemas.errors import DataRejected
from tests.manoeuvre.ships import identified, ship_of, unstable

LOGS = Reach(0.1, 0.3, radians(20.0), 7.0, 8.0)
CIRCLE = PredictedCircle(radians(25.0))


def made(model: Identified, manoeuvre=CIRCLE, length: float | None = 160.93):  # type: ignore[no-untyped-def]
    return predict([model], manoeuvre, LOGS, Particulars(length), 64)


def test_the_same_parameters_give_the_same_bits_whatever_the_set_is_called() -> None:
    ship = ship_of(HULLS["mariner"])
    first, again = made(identified(ship)), made(identified(ship))
    assert first.figures == again.figures
    other = made(identified(ship, name="ps-0000000000000002"))
    assert other.figures == first.figures


def test_an_interval_holds_95_percent_of_ships_drawn_otherwise() -> None:
    model = identified(ship_of(HULLS["ferry"]), relative=0.03)
    figure = predict([model], CIRCLE, LOGS, Particulars(140.0), 256).figures["tactical_diameter_m"]
    random = np.random.default_rng(5)
    estimates, inside = model.hull, []
    for _ in range(300):
        hull = estimates * (1.0 + 0.03 * random.standard_normal(6))
        surge = model.surge.best * [1.0, 1.0, 1.0 + 0.05 * random.standard_normal(), 1.0, 1.0]
        one = type(model.ship)(model.waters, hull, model.effects, surge, model.rudder_rate.rad_s)
        sailed = CIRCLE.sailed(one)
        assert sailed is not None
        inside.append(figure.low <= sailed.figures["tactical_diameter_m"] <= figure.high)
    assert 0.91 < np.mean(inside) < 0.985


def test_models_that_fit_as_well_widen_the_interval_to_hold_them_all() -> None:
    ship = ship_of(HULLS["mariner"])
    narrow = identified(ship, relative=1e-4)
    drag = ship_of(HULLS["mariner"], cross_flow_drag=(1.0,))
    rival = identified(drag, relative=1e-4, name="ps-0000000000000003")
    alone, both = made(narrow), predict([narrow, rival], CIRCLE, LOGS, Particulars(160.93), 64)
    one, two = alone.figures["tactical_diameter_m"], both.figures["tactical_diameter_m"]
    assert one.value == two.value
    assert one.high is not None
    assert two.high is not None
    assert two.high > one.high * 1.02
    rivals = both.models[1].figures["tactical_diameter_m"].value
    assert rivals is not None
    assert two.low is not None
    assert two.low < rivals <= two.high * 1.0001


def test_the_interval_of_a_model_is_not_narrowed_by_surer_ones_beside_it() -> None:
    ship = ship_of(HULLS["mariner"])
    unsure = identified(ship, relative=0.03)
    surer = [identified(ship, relative=1e-3, name=f"ps-000000000000000{number}") for number in (3, 4)]
    alone, beside = made(unsure), predict([unsure, *surer], CIRCLE, LOGS, Particulars(160.93), 64)
    assert beside.figures == alone.figures


def test_criteria_have_a_limit_and_a_probability_and_none_without_a_length() -> None:
    model = identified(ship_of(HULLS["mariner"]))
    circle = {
        one.name: one for one in predict([model], PredictedCircle(radians(35.0)), LOGS, Particulars(160.93), 64).imo
    }
    assert circle["advance"].limit == pytest.approx(4.5 * 160.93)
    assert circle["tactical diameter"].probability == 1.0
    zigzag = {one.name: one for one in made(model, PredictedZigzag(radians(10.0), radians(10.0))).imo}
    assert zigzag["initial turning"].limit == pytest.approx(2.5 * 160.93)
    assert zigzag["10/10 first overshoot"].limit == pytest.approx(5.0 + 0.5 * 160.93 / 7.7175)
    assert "35 deg" in made(model).imo[0].why
    blind = made(model, PredictedZigzag(radians(10.0), radians(10.0)), None).imo
    assert all(one.probability is None and "length" in one.why for one in blind)
    assert made(model, PredictedZigzag(radians(5.0), radians(15.0))).imo == ()
    some = predict([model], PredictedCircle(radians(35.0)), LOGS, Particulars(389.0 / 4.5), 64).imo[0]
    assert some.probability is not None
    assert 0.0 < some.probability < 1.0
    assert "100 m" in some.why
    # of a model the limits of the overshoots are not those of its ship
    small = {one.name: one for one in made(model, PredictedZigzag(radians(10.0), radians(10.0)), 7.0).imo}
    assert small["10/10 first overshoot"].probability is None
    assert "7 m long" in small["10/10 first overshoot"].why
    assert small["initial turning"].probability is not None
    slow = predict([model], PredictedCircle(radians(35.0)), LOGS, Particulars(160.93, 9.0), 64).imo[0]
    assert slow.probability == circle["advance"].probability
    assert "below 90 % of the trial speed 9 m/s" in slow.why


def test_a_ship_that_runs_away_is_refused_with_what_to_sail() -> None:
    with pytest.raises(DataRejected, match="predicts no turning-circle") as caught:
        made(identified(unstable(drag=0.0)))
    assert caught.value.code == "predicts_no_ship"
    assert "Sail a turning circle or a spiral" in caught.value.next_step


def test_draws_that_are_no_ships_are_counted() -> None:
    # drag that may be nearly nothing leaves some ships without what keeps them
    model = identified(unstable(drag=0.6), relative=0.0)
    covariance = model.covariance.copy()
    covariance[6, 6] = 0.3**2
    loose = Identified(**{**vars(model), "covariance": covariance})
    found = made(loose, length=None)
    assert 0 < found.no_ships < 0.2 * 64
    # by the criteria they fulfil nothing, and what is extrapolated says so beside the verdict
    long = {one.name: one for one in made(loose, length=10_000.0).imo}["advance"]
    assert long.probability == (64 - found.no_ships) / 64
    assert "extrapolated in " in long.why
    within = predict([identified(ship_of(HULLS["mariner"]))], CIRCLE, Reach(9, 9, 9, 0.1, 99), Particulars(160.93), 64)
    assert within.extrapolated == () and "extrapolated" not in within.imo[0].why
    assert found.share_unstable == 1.0


def test_criteria_of_a_model_are_those_of_its_ship() -> None:
    model, ten = identified(ship_of(HULLS["mariner"])), PredictedZigzag(radians(10.0), radians(10.0))
    ship = {one.name: one for one in made(model, ten).imo}
    scaled = {one.name: one for one in predict([model], ten, LOGS, Particulars(160.93 / 4.0, None, 4.0), 64).imo}
    # half the seconds for a length: those of a ship of a quarter of the length and half the speed are as many
    assert scaled["10/10 first overshoot"].limit == pytest.approx(5.0 + 0.5 * 160.93 / (7.7175 * 2.0))
    assert scaled["initial turning"].limit == pytest.approx(ship["initial turning"].limit / 4.0)
    assert all("judged at full scale, 1:4: 160.9 m long, 15.4 m/s" in one.why for one in scaled.values())
