"""What `kempf predict` sails with the true numbers of a ship is what the plant of the hidden cases sails."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import pytest

from benchmarks.diagnose.hidden_effects import programme, sail
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE, theta
from benchmarks.identify.prediction.calm_water import truth_of
from benchmarks.identify.prediction.compared import ANGLES_DEG, RUDDERS_DEG, circle, zigzag
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from tests.manoeuvre.ships import ship_of


@pytest.mark.parametrize(
    "name", ["wind_force", "cross_flow_drag", "rudder_lag", "backlash", "propeller_walk", "memory"]
)
def test_the_figures_in_calm_water_are_those_of_the_plant(name: str) -> None:
    hull, effect = programme.ship("ferry", 3), CATALOGUE[name]
    weathers = tuple(programme.weather(hull, "moderate", 3, day) for day in range(programme.DAYS))
    c, _ = sail.voyages(hull, weathers, effect, 1, 3)
    ship = ship_of(hull, **{name: tuple(effect.parameters(c).values())})
    ship = replace(ship, waters=replace(ship.waters, day=1.0))
    truth = truth_of(hull, theta(effect, c, hull))
    wanted = {circle(rudder): PredictedCircle(radians(rudder)) for rudder in RUDDERS_DEG}
    wanted |= {zigzag(*angles): PredictedZigzag(*(radians(x) for x in angles)) for angles in ANGLES_DEG}
    for manoeuvre, asked in wanted.items():
        made = asked.sailed(ship)
        assert made is not None
        for figure, true in truth[manoeuvre].items():
            assert made.figures[figure] == pytest.approx(true, rel=1e-3), (manoeuvre, figure)
