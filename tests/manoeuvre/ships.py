"""Ships of the simulator, and one with cross-flow drag, as manoeuvres take them."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np

from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.rudder_rate import RudderRate
from kempf.pipeline.manoeuvre.ship import Ship, Waters
from kempf.pipeline.manoeuvre.surge.surge_fit import SurgeFit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.simulate.hulls import HULLS, SimulatedHull
from kempf.schemas import effects


def ship_of(hull: SimulatedHull, **with_effects: tuple[float, ...]) -> Ship:
    """The ship that the simulator has, with effects by name beside her."""
    model = EffectModel(tuple(effects.get(name) for name in with_effects))
    waters = Waters(model, hull.length_m, hull.draught_m, hull.trial_speed_m_s, hull.length_m)
    values = np.array([x for group in with_effects.values() for x in group])
    surge = np.array([hull.surge_time_lengths, 0.0, hull.speed_loss, 0.0, 0.0])
    return Ship(waters, np.array(astuple(hull.parameters)), values, surge, hull.rudder_rate_rad_s)


def unstable(drag: float = 2.0) -> Ship:
    """A tanker that turns by herself, kept within bounds by cross-flow drag."""
    ship = ship_of(HULLS["tanker"], cross_flow_drag=(drag,)) if drag else ship_of(HULLS["tanker"])
    hull = ship.hull.copy()
    hull[3] *= 0.7
    return replace(ship, hull=hull)


def identified(ship: Ship, relative: float = 0.02, name: str = "ps-0000000000000001") -> Identified:
    """A model with relative standard errors."""
    estimates = np.concatenate([ship.hull, ship.effects])
    tau, *loss = ship.surge
    surge = SurgeFit(
        np.array([tau]),
        np.ones(1),
        np.array([loss]),
        np.diag([0.0, (0.05 * loss[1]) ** 2, 0.0, 0.0])[None],
        settled=(1.0, 0.0),
        error_m_s=0.01,
        remarks=(),
    )
    rate = RudderRate(ship.rudder_rate_rad_s, 0.02 * ship.rudder_rate_rad_s, 4, "")
    covariance = np.diag((relative * estimates) ** 2)
    return Identified(name, ship.waters, ship.hull, ship.effects, covariance, surge, rate)
