"""A programme sailed by the simulator and measured by a ship's instruments; and the true figures of a circle."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.simulate.disturbances import CALM, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.manoeuvre import RudderHold, Step
from kempf.pipeline.simulate.trial import Trial, TrialSettings, simulate_trial
from kempf.schemas.channels import CHANNELS

START_NS = 1_750_000_000_000_000_000


def sailed(
    programme: tuple[Step, ...], hull: str = "mariner", environment: Environment = CALM, *, seed: int = 0
) -> Trial:
    return simulate_trial(
        TrialSettings(HULLS[hull], programme, environment, seed=seed, start_utc_ns=START_NS, heading_deg=70.0)
    )


def direct_spiral(angles_deg: tuple[float, ...], hold_s: float) -> tuple[RudderHold, ...]:
    """The steps of a direct spiral: angles from side to side, starboard positive, and back over the same ones."""
    return tuple(RudderHold(angle, hold_s) for angle in (*angles_deg, *angles_deg[-2::-1]))


def instruments(trial: Trial, without: tuple[str, ...] = ()) -> Instruments:
    """The series of a trial, less some channels."""
    series = {}
    columns = {channel.column: name for name, channel in CHANNELS.items()}
    for record in trial.instruments:
        for column, value in record.values.items():
            circle = CHANNELS[columns[column]].wrap == "circle"
            series[columns[column]] = Series(record.measured_utc_ns, np.unwrap(value) if circle else value)
    return Instruments({k: v for k, v in series.items() if k not in without}, {}, ())


def true_circle(trial: Trial, execute_s: float) -> dict[str, float]:
    """Advance, transfer and tactical diameter through the water, read off the simulator's fine grid."""
    path = trial.truth.trajectory
    time = path.time_s
    through_water: list[Float] = []
    for place, stream in (("north", "current_north"), ("east", "current_east")):
        carried = np.concatenate([[0.0], np.cumsum(path.column(stream)[:-1]) * path.step_s])
        through_water.append(path.column(place) - carried)
    north, east = through_water
    begin = int(np.searchsorted(time, execute_s))
    course = path.column("psi")[begin]
    turned = np.abs(path.column("psi") - course)
    quarter, half = (begin + int(np.argmax(turned[begin:] >= angle)) for angle in (np.pi / 2, np.pi))
    side = np.sign(path.column("psi")[half] - course)

    def along(k: int) -> float:
        return float((north[k] - north[begin]) * np.cos(course) + (east[k] - east[begin]) * np.sin(course))

    def across(k: int) -> float:
        return float(side * ((east[k] - east[begin]) * np.cos(course) - (north[k] - north[begin]) * np.sin(course)))

    return {"advance_m": along(quarter), "transfer_m": across(quarter), "tactical_diameter_m": across(half)}
