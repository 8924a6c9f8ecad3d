"""A ship that is as the plain model has her: a hull of the catalogue with each parameter changed by chance.

She sails a 20/20 and a 10/10 zigzag in wind and stream in the simulator of `kempf simulate`, which sails the truth in
calm water, too. Her log is a delimited one, whose rows say what was last received of every instrument, or an MCAP file,
in which every reading has its own instant.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import astuple, replace
from math import degrees
from pathlib import Path

import numpy as np

from benchmarks.identify.prediction.compared import (
    ANGLES_DEG,
    OVERSHOOTS,
    RUDDERS_DEG,
    TURNS,
    ComparedShip,
    Truth,
    circle,
    circle_figures,
    predicted_beside,
    zigzag,
)
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.identify.pool_vessel import pool_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.pipeline.channels.series import Float
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import HULLS, HullParameters, SimulatedHull
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS, Instrument
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, Step, TurningCircle, ZigzagTest
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, Trial, TrialSettings, simulate_trial
from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.store import Warehouse

_HULLS = ("mariner", "container", "tanker", "ferry")
_SEED = 20061
#: A log's file name, and how it is written.
Written = tuple[str, Callable[[Trial], bytes]]
#: The log in which every reading has its own instant.
STAMPED: Written = "trial.mcap", to_mcap
#: The longest that a zigzag takes, in the time in which she sails her own length.
_LONGEST_LENGTHS = {20.0: 45.0, 10.0: 35.0}
#: No ship drifts or turns more, as v / u and as r L / u: hulls reach 0.8 and 1.3.
MOST_DRIFT, MOST_TURN = 1.5, 3.0


def drawn(number: int) -> tuple[SimulatedHull, int]:
    """Return a ship by her number, and how many were drawn before her that are none.

    A hull that is unstable on a straight course is none, nor one that slides through a circle: eq. (16) has no damping
    that grows with the motion, by which a real hull of these numbers would turn.
    """
    random = np.random.default_rng([_SEED, number])
    hull = HULLS[_HULLS[number % len(_HULLS)]]
    again = -1
    while True:
        again += 1
        changed = np.array(astuple(hull.parameters)) * (1.0 + 0.1 * random.standard_normal(6))
        p = HullParameters(*changed.tolist())
        losses = {"speed_loss": float(random.uniform(0.2, 1.0)), "surge_time_lengths": float(random.uniform(4.0, 10.0))}
        if p.a11 * p.a22 - p.a12 * p.a21 > 0.05 * p.a11 * p.a22:
            own = replace(hull, name=f"ship-{number}", parameters=p, **losses)
            if not _slides(own):
                return own, again


def _slides(hull: SimulatedHull) -> bool:
    try:
        _, state = _sailed(hull, TurningCircle(max(RUDDERS_DEG), 540.0))
    except UsageError:
        return True
    v, r, _, _, _, forward = state.T
    return slides(v, r, forward, hull.length_m)


def slides(v: Float, r: Float, forward: Float, length_m: float) -> bool:
    """Return whether what she does in a circle is no ship's.

    Parameters
    ----------
    v, r, forward : ndarray, shape (n,)
        Lateral speed, m/s, yaw rate, rad/s, forward speed, m/s.
    """
    drift, turn = np.abs(v) / forward, np.abs(r) * length_m / forward
    return not (forward.min() > 0.0 and float(drift.max()) < MOST_DRIFT and float(turn.max()) < MOST_TURN)


def compared(number: int, *, stamped: bool) -> ComparedShip:
    """Predict one ship and compare her with the simulator's.

    Parameters
    ----------
    stamped : bool
        Whether every reading of her log has its own instant.
    """
    hull, _ = drawn(number)
    with tempfile.TemporaryDirectory() as folder:
        warehouse = taken_in(hull, number, Path(folder), STAMPED if stamped else in_rows(10.0))
        pool_vessel(warehouse, hull.name, Request(), identify_vessel(warehouse, hull.name))
        figures, refused, models = predicted_beside(warehouse, hull.name, hull.trial_speed_m_s, _truth(hull))
    return ComparedShip("stamped" if stamped else "plain", hull.name, "", figures, refused, models=models)


def in_rows(rows_hz: float) -> Written:
    """Return a log of so many rows a second."""
    return "trial.csv", lambda trial: to_csv(trial, rows_hz)


def taken_in(hull: SimulatedHull, number: int, folder: Path, written: Written = STAMPED) -> Warehouse:
    """Sail her zigzags in wind and stream and take their log in.

    Parameters
    ----------
    folder : Path
        Of the log and of the warehouse.
    written : Written, optional
        Her log.
    """
    instruments = unset_clocks(DEFAULT_INSTRUMENTS, np.random.default_rng([_SEED, number, 1]))
    settings = TrialSettings(
        hull, two_zigzags(hull), PAPER_ENVIRONMENT, instruments, seed=number, heading_deg=20.0 * number
    )
    name, bytes_of = written
    log = folder / name
    log.write_bytes(bytes_of(simulate_trial(settings)))
    warehouse = Warehouse(str(folder / "warehouse"))
    ingest(warehouse, [log], hull.name, logger_profile(settings))
    return warehouse


def two_zigzags(hull: SimulatedHull) -> tuple[Step, ...]:
    """Return a 20/20 and a 10/10 zigzag, each as long as its legs may take."""
    own_s = hull.length_m / hull.trial_speed_m_s
    return (
        SteadyCourse(90.0),
        ZigzagTest(20.0, 20.0, "starboard", duration_s=_LONGEST_LENGTHS[20.0] * own_s),
        SteadyCourse(240.0, heading_deg=60.0),
        ZigzagTest(10.0, 10.0, "port", duration_s=_LONGEST_LENGTHS[10.0] * own_s),
    )


def unset_clocks(instruments: Sequence[Instrument], random: np.random.Generator) -> tuple[Instrument, ...]:
    """Return instruments whose clocks nobody sets by the rows or the stamps of a log."""
    return tuple(replace(one, phase_s=max(one.jitter_s, float(random.uniform()) / one.rate_hz)) for one in instruments)


def _truth(hull: SimulatedHull) -> Truth:
    """Let the simulator sail the manoeuvres in calm water."""
    found = {circle(rudder): _circle(hull, rudder) for rudder in RUDDERS_DEG}
    return found | {zigzag(*angles): _overshoots(hull, *angles) for angles in ANGLES_DEG}


def _circle(hull: SimulatedHull, rudder_deg: float) -> dict[str, float]:
    time, state = _sailed(hull, TurningCircle(rudder_deg, 360.0 * TURNS))
    v, _, psi, north, east, forward = state.T
    return circle_figures(time, north, east, psi, v, forward)


def _overshoots(hull: SimulatedHull, heading_deg: float, rudder_deg: float) -> dict[str, float]:
    trial = simulate_trial(TrialSettings(hull, (SteadyCourse(30.0), ZigzagTest(heading_deg, rudder_deg, legs=4))))
    return dict(zip(OVERSHOOTS, [degrees(x) for x in trial.truth.zigzags[0].overshoots_rad], strict=False))


def _sailed(hull: SimulatedHull, step: Step) -> tuple[Float, Float]:
    trial = simulate_trial(TrialSettings(hull, (SteadyCourse(30.0), step)))
    record, path = trial.truth.manoeuvres[1], trial.truth.trajectory
    rows = slice(round(record.start_s / path.step_s), round(record.end_s / path.step_s) + 1)
    return path.time_s[rows] - record.start_s, path.state[rows]
