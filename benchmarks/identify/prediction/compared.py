"""What is predicted of one ship beside what she does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kempf.flows.jobs.predict.checked_prediction import CheckedPredictions
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.prediction import PredictedFigure
from kempf.pipeline.segment.circles.turning_figures import turning_figures
from kempf.schemas.errors import DataRejected
from kempf.warehouse.storage.store import Warehouse

#: What is predicted of every ship: rudder of the circles, heading and rudder of the zigzags, deg.
RUDDERS_DEG, ANGLES_DEG = (20.0, 35.0), ((10.0, 10.0), (20.0, 20.0))
#: Figures of a circle.
CIRCLE = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_yaw_rate_deg_s", "speed_loss_percent")
#: Overshoots of a zigzag.
OVERSHOOTS = ("overshoots_deg.0", "overshoots_deg.1")
#: Which of all the aim is about.
AIMED = ("advance_m", "transfer_m", "tactical_diameter_m", *OVERSHOOTS)

#: What a ship truly does: figures by manoeuvre.
Truth = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Compared:
    """One figure of one ship."""

    manoeuvre: str
    figure: str
    truth: float
    value: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


@dataclass(frozen=True)
class ComparedShip:
    """All figures of one ship."""

    #: Without an effect: ``plain``, ``stamped`` where every reading of the log has its own instant. With one: ``known``
    #: where it was given, ``diagnosed`` where it had to be found.
    kind: str
    name: str
    #: Her effect, empty where she has none.
    effect: str
    figures: tuple[Compared, ...]
    #: Why a manoeuvre, or all of them, has no prediction; empty where each has one.
    refused: tuple[str, ...] = ()
    #: Whether the diagnosis named her effect; True where none was made.
    found: bool = True
    #: How many models are in the intervals of the first manoeuvre.
    models: int = 0


def circle(rudder_deg: float) -> str:
    """Return the name of a circle on the page."""
    return f"circle, {rudder_deg:g} deg"


#: Turns of a circle: her speed falls on for several before the turn is steady.
TURNS = 12


def zigzag(heading_deg: float, rudder_deg: float) -> str:
    """Return the name of a zigzag on the page."""
    return f"zigzag {heading_deg:g}/{rudder_deg:g}"


def circle_figures(
    time_s: Float, north_m: Float, east_m: Float, heading_rad: Float, v_m_s: Float, forward_m_s: Float
) -> dict[str, float]:
    """Return the figures of a circle that a simulator sailed from its execute on; every array has shape (n,)."""
    speed, drift = np.hypot(forward_m_s, v_m_s), np.arctan2(-v_m_s, forward_m_s)
    found = turning_figures(time_s, north_m, east_m, heading_rad, speed, drift, 0.0)
    return {name: getattr(found, name) for name in CIRCLE}


def predicted_beside(
    warehouse: Warehouse, vessel: str, speed_m_s: float, truth: Truth
) -> tuple[tuple[Compared, ...], tuple[str, ...], int]:
    """Predict every manoeuvre with the vessel's current set as `kempf predict` does it.

    Parameters
    ----------
    speed_m_s : float
        Of the approach.

    Returns
    -------
    (tuple of Compared, tuple of str, int)
        The figures, why a manoeuvre was refused, and the models in the first prediction.
    """
    requests = {circle(x): PredictRequest("turning-circle", rudder_deg=x, speed_m_s=speed_m_s) for x in RUDDERS_DEG}
    requests |= {zigzag(*x): PredictRequest("zigzag", angles_deg=x, speed_m_s=speed_m_s) for x in ANGLES_DEG}
    found: list[Compared] = []
    refused: list[str] = []
    models = 0
    predictions = CheckedPredictions(warehouse, vessel, next(iter(requests.values())))
    for manoeuvre, request in requests.items():
        try:
            made = predictions.predict(request).prediction
        except DataRejected as error:
            refused.append(f"{manoeuvre}: {error.message}")
            continue
        models = models or len(made.models)
        found += _beside(manoeuvre, truth[manoeuvre], made.figures)
    return tuple(found), tuple(refused), models


def _beside(manoeuvre: str, truth: Mapping[str, float], figures: Mapping[str, PredictedFigure]) -> Iterator[Compared]:
    for name, true in truth.items():
        one = figures[name]
        if one.value is not None and one.low is not None and one.high is not None:
            yield Compared(manoeuvre, name, true, one.value, one.low, one.high)
