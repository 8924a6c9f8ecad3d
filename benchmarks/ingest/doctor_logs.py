"""Honest logs to spoil: simulated ones of every hull, sea, noise and format, and the trial logs of seven ships."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path

import numpy as np

from benchmarks import measured_ships
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.channels.series import Series
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS, Instrument
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import (
    CourseChange,
    HandSteering,
    SteadyCourse,
    Step,
    TurningCircle,
    ZigzagTest,
)
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.trial import TrialSettings, simulate_trial
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

#: Of the eight trial ships one capsizes in the simulation, at tens of metres a second and thousands of degrees of roll:
#: her logs are not sound ones.
CAPSIZED = "ekaterina"
_FORMATS = {"csv": to_csv, "mcap": to_mcap, "nmea": to_nmea}


def simulated(seed: int) -> tuple[str, Log]:
    """One sound log: hull, programme, sea, noise, antenna, format and whether the length is known, all by the seed."""
    random = np.random.Generator(np.random.PCG64(seed))
    hull = HULLS[sorted(HULLS)[seed % len(HULLS)]]
    stream = random.uniform(0.0, min(1.0, 0.2 * hull.trial_speed_m_s))
    towards = random.uniform(0.0, 2 * pi)
    wind = random.uniform(0.0, 1.0) * 5e-3 * min(1.0, (hull.trial_speed_m_s / 7.7) ** 2 * 160.0 / hull.length_m)
    environment = Environment(
        wind_force=Disturbance(wind, 0.3 * wind),
        current_north=Disturbance(stream * cos(towards), 0.1 * stream),
        current_east=Disturbance(stream * sin(towards), 0.1 * stream),
        wind_speed=Disturbance(random.uniform(2.0, 12.0), 0.5, 1.0 / 20.0),
        wind_from_rad=random.uniform(0.0, 2 * pi),
    )
    settings = TrialSettings(
        hull,
        _programme(random, hull.length_m / hull.trial_speed_m_s),
        environment,
        (*DEFAULT_INSTRUMENTS, Instrument("rudder_order", 2.0, 0.19)),
        seed=seed,
        noise_scale=float(random.choice([0.5, 1.0, 2.0])),
        heading_deg=float(random.uniform(0.0, 360.0)),
        latitude_deg=float(random.uniform(-60.0, 60.0)),
        longitude_deg=float(random.uniform(-80.0, 80.0)),
        antenna_forward_m=float(random.uniform(-0.4, 0.4)) * hull.length_m,
    )
    kind = str(random.choice(sorted(_FORMATS)))
    trial = simulate_trial(settings)
    profile = logger_profile(settings) if kind != "nmea" else VesselProfile(length_m=hull.length_m)
    frame = read_log(f"trial.{kind}", _FORMATS[kind](trial), profile).frame
    # no logger of the simulator writes the order: it is put beside as it was measured
    order = trial.record("rudder_order")
    ordered = Series(order.measured_utc_ns, order.values["rudder_order_rad"])
    length = hull.length_m if random.uniform() < 0.7 else None
    log = Log.of(from_readings(frame), length).with_series({"rudder_order": ordered})
    return f"{hull.name}, {kind}, seed {seed}", log


def _programme(random: np.random.Generator, time_s: float) -> tuple[Step, ...]:
    """Two to four steps in an order by chance, a zigzag always among them; lengths in the ship's own time."""
    long = float(np.clip(time_s, 3.0, 40.0))
    psi = float(random.choice([10.0, 20.0]))
    steps: list[Step] = [
        ZigzagTest(psi, psi, "starboard" if random.uniform() < 0.5 else "port", duration_s=45.0 * long),
        *(
            [CourseChange(float(random.uniform(30.0, 150.0)) * float(random.choice([-1.0, 1.0])), 15.0 * long)]
            if random.uniform() < 0.6
            else []
        ),
        *([TurningCircle(25.0, 400.0, 40.0 * long)] if random.uniform() < 0.4 else []),
        *([HandSteering(25.0 * long, 6.0, 1.5 * long, 8.0 * long)] if random.uniform() < 0.4 else []),
    ]
    order = random.permutation(len(steps))
    mixed: list[Step] = [SteadyCourse(10.0 * long)]
    for k in order:
        mixed += [steps[int(k)], SteadyCourse(8.0 * long, heading_deg=float(random.uniform(0.0, 360.0)))]
    return tuple(mixed)


def fleet(data: Path) -> Iterator[tuple[str, Log]]:
    """The trial logs of seven ships; every other one without the ship's length."""
    for ship in measured_ships.fleet(data):
        if ship.name == CAPSIZED:
            continue
        profile = read_profiles(ship.profiles)
        for k, path in enumerate(ship.logs):
            frame = read_log(path.name, path.read_bytes(), profile).frame
            log = Log.of(from_readings(frame), profile.length_m)
            yield f"{ship.name}, {path.name}", replace(log, length_m=None) if k else log
