"""Do the intervals of `kempf predict` hold? Simulated ships: zigzags in wind and stream, then all in calm water.

Every ship has a hull of the catalogue with each parameter changed by chance, and her own speed loss and surge time.
Her zigzags are identified as `kempf identify` does it; what is predicted is compared with what the simulator sails,
which shares no code with the prediction.
"""

from __future__ import annotations

import tempfile
from argparse import ArgumentParser
from dataclasses import astuple, dataclass, replace
from math import degrees
from pathlib import Path

import numpy as np

from benchmarks.result_page import table, write
from kempf.flows.jobs.checked_prediction import predict_checked
from kempf.flows.jobs.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest_logs import ingest
from kempf.flows.jobs.pool_vessel import pool_vessel
from kempf.flows.jobs.predict_vessel import PredictRequest
from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.prediction import Figure
from kempf.pipeline.segment.turning_figures import turning_figures
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import HULLS, HullParameters, SimulatedHull
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, Step, TurningCircle, ZigzagTest
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, TrialSettings, simulate_trial
from kempf.schemas.errors import KempfError
from kempf.warehouse.store import Warehouse

_HULLS = ("mariner", "container", "tanker", "ferry")
_SAILED = (
    SteadyCourse(90.0),
    ZigzagTest(20.0, 20.0, "starboard", duration_s=900.0),
    SteadyCourse(240.0, heading_deg=60.0),
    ZigzagTest(10.0, 10.0, "port", duration_s=700.0),
)
_CIRCLE = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_yaw_rate_deg_s", "speed_loss_percent")


@dataclass(frozen=True)
class Compared:
    """One figure of one ship."""

    manoeuvre: str
    figure: str
    truth: float
    value: float
    low: float
    high: float


def a_ship(number: int) -> SimulatedHull:
    """Return a ship by her number: stable on a straight course."""
    random = np.random.default_rng([20061, number])
    hull = HULLS[_HULLS[number % len(_HULLS)]]
    while True:
        changed = np.array(astuple(hull.parameters)) * (1.0 + 0.1 * random.standard_normal(6))
        p = HullParameters(*changed.tolist())
        if p.a11 * p.a22 - p.a12 * p.a21 > 0.05 * p.a11 * p.a22:
            break
    return replace(
        hull,
        name=f"ship-{number}",
        parameters=p,
        speed_loss=float(random.uniform(0.2, 1.0)),
        surge_time_lengths=float(random.uniform(4.0, 10.0)),
    )


def identify(hull: SimulatedHull, number: int, folder: Path) -> Warehouse:
    """Sail her zigzags in wind and stream and identify her from their log."""
    settings = TrialSettings(hull, _SAILED, PAPER_ENVIRONMENT, seed=number, heading_deg=20.0 * number)
    log = folder / "trial.csv"
    log.write_bytes(to_csv(simulate_trial(settings)))
    warehouse = Warehouse(str(folder / "warehouse"))
    ingest(warehouse, [log], hull.name, logger_profile(settings))
    outcomes = identify_vessel(warehouse, hull.name)
    pool_vessel(warehouse, hull.name, Request(), outcomes)
    return warehouse


def true_circle(hull: SimulatedHull, rudder_deg: float) -> dict[str, float]:
    """Let the simulator sail a turning circle in calm water."""
    time, state = _sailed(hull, TurningCircle(rudder_deg, 540.0))
    v, _, psi, north, east, forward = state.T
    found = turning_figures(time, north, east, psi, np.hypot(forward, v), np.arctan2(-v, forward), 0.0)
    return {name: getattr(found, name) for name in _CIRCLE}


def true_overshoots(hull: SimulatedHull, heading_deg: float, rudder_deg: float) -> list[float]:
    """Let the simulator sail a zigzag in calm water."""
    trial = simulate_trial(TrialSettings(hull, (SteadyCourse(30.0), ZigzagTest(heading_deg, rudder_deg, legs=4))))
    return [degrees(x) for x in trial.truth.zigzags[0].overshoots_rad]


def _sailed(hull: SimulatedHull, step: Step) -> tuple[Float, Float]:
    trial = simulate_trial(TrialSettings(hull, (SteadyCourse(30.0), step)))
    record, path = trial.truth.manoeuvres[1], trial.truth.trajectory
    rows = slice(round(record.start_s / path.step_s), round(record.end_s / path.step_s) + 1)
    return path.time_s[rows] - record.start_s, path.state[rows]


def compared(number: int) -> list[Compared]:
    """Predict one ship and compare her with the simulator's."""
    hull, found = a_ship(number), []
    with tempfile.TemporaryDirectory() as folder:
        warehouse = identify(hull, number, Path(folder))
        speed = hull.trial_speed_m_s
        for rudder in (20.0, 35.0):
            request = PredictRequest("turning-circle", rudder_deg=rudder, speed_m_s=speed)
            figures = predict_checked(warehouse, hull.name, request).prediction.figures
            for name, truth in true_circle(hull, rudder).items():
                found += _beside(f"circle, {rudder:g} deg", name, truth, figures[name])
        for angles in ((10.0, 10.0), (20.0, 20.0)):
            request = PredictRequest("zigzag", angles_deg=angles, speed_m_s=speed)
            figures = predict_checked(warehouse, hull.name, request).prediction.figures
            for k, truth in enumerate(true_overshoots(hull, *angles)[:2]):
                name = f"overshoots_deg.{k}"
                found += _beside(f"zigzag {angles[0]:g}/{angles[1]:g}", f"overshoot {k + 1}", truth, figures[name])
    return found


def _beside(manoeuvre: str, name: str, truth: float, one: Figure) -> list[Compared]:
    if one.value is None or one.low is None or one.high is None:
        return []
    return [Compared(manoeuvre, name, truth, one.value, one.low, one.high)]


def main() -> None:
    """Compare the ships and write ``results/prediction.md``."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--ships", type=int, default=200)
    ships = parser.parse_args().ships
    every: list[Compared] = []
    refused: list[str] = []
    for number in range(ships):
        try:
            every += compared(number)
        except KempfError as error:
            refused.append(f"ship-{number}: {error.message}")
    rows = []
    for manoeuvre, figure in dict.fromkeys((c.manoeuvre, c.figure) for c in every):
        hers = [c for c in every if (c.manoeuvre, c.figure) == (manoeuvre, figure)]
        inside = np.array([c.low <= c.truth <= c.high for c in hers])
        off = np.array([100.0 * (c.value / c.truth - 1.0) for c in hers])
        width = np.array([100.0 * (c.high - c.low) / abs(c.truth) for c in hers])
        rows.append(
            [
                manoeuvre,
                figure.replace("_", " "),
                str(len(hers)),
                f"{100.0 * inside.mean():.0f} %",
                f"{np.median(np.abs(off)):.2f} %",
                f"{np.median(width):.2f} %",
            ]
        )
    share = 100.0 * np.mean([c.low <= c.truth <= c.high for c in every])
    lines = [
        f"{ships} ships: a hull of the catalogue, every parameter changed by 10 % (one standard deviation), speed loss "
        "and surge time drawn. Each is identified from one 20/20 and one 10/10 zigzag in wind and stream, pooled, and "
        "predicted in calm water at her trial speed. The simulator's speed equation has the form of the estimator's: "
        "these figures say nothing of a speed that falls in another way.",
        "",
        f"**{share:.0f} % of all figures lie inside their 95 % interval.** Refused: {len(refused)} of {ships} ships.",
        "",
        *table(["manoeuvre", "figure", "ships", "inside 95 %", "median error", "median width of the interval"], rows),
        *(["", "Refused: " + "; ".join(refused)] if refused else []),
    ]
    title = "Predicted manoeuvres: do the intervals hold?"
    print(write("identify.prediction", title, lines, options=f"--ships {ships}"))


if __name__ == "__main__":
    main()
