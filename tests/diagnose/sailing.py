"""Runs of one ship with a hidden effect, from a plant that shares no code with the estimator, no file in between."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.diagnose.hidden_effects import programme, readings, sail
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE, HiddenEffect
from benchmarks.diagnose.hidden_effects.outsiders import OUTSIDERS
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis, diagnose
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.grid_run import GridRun, ShipConstants, make_run
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.trial import Trial, TrialSettings
from kempf.schemas.channels import CHANNELS
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS

CHANNEL_OF = {channel.column: channel for channel in CHANNELS.values()}
#: some that a rudder, a hull and a sensor can have; the whole catalogue takes too long for a test
SOME = ("rudder_lag", "dead_time", "cross_flow_drag", "sway_quadratic", "yaw_quadratic", "gyro_bias")
WORKERS = ThreadPoolExecutor(2)
_LEGS = 4
#: step of the grid and time before the first execute, s: a boat does everything in a twentieth of the time
_TIMES_S = {"mariner": (2.0, 20.0), "tanker": (1.0, 20.0), "usv": (0.1, 5.0)}


@dataclass(frozen=True, eq=False)
class Sailed:
    """Four zigzags of one ship, ready to be diagnosed; ``c`` is the size of her effect."""

    runs: tuple[GridRun, ...]
    spec: ModelSpec
    c: float

    def diagnosis(self, names: Sequence[str] = SOME, **settings: Any) -> Diagnosis:
        known = catalogue()
        effects = {name: known[name] for name in names}
        return diagnose(self.runs, self.spec, effects, WORKERS, **settings)


@lru_cache(maxsize=8)
def sailed(
    effect: str = "none",
    *,
    strength: int = 2,
    seed: int = 3,
    noise: float = 1.0,
    name: str = "mariner",
    sold: bool = False,
) -> Sailed:
    """Sail a day of a ship in a moderate sea, with fresh noise or instruments as sold."""
    hull = programme.ship(name, seed)
    weather = programme.weather(hull, "moderate", seed, 0)
    hidden: HiddenEffect | None = (CATALOGUE | OUTSIDERS).get(effect)
    c = sail.strength_of(hull, (weather,), hidden, strength, seed) if hidden else 0.0
    runs, spec = _laid_out(hull, weather, hidden, c, seed, 0, noise, name, sold=sold)
    return Sailed(runs, spec, c)


@lru_cache(maxsize=8)
def repeated(effect: str = "none", *, strength: int = 2, seed: int = 3, days: int = 2) -> Sailed:
    """Sail the same four zigzags, 20/20 and 10/10, day after day, on one heading in another sea."""
    name = "mariner"
    hull = programme.ship(name, seed)
    weather = programme.weather(hull, "moderate", seed, 0)
    hidden: HiddenEffect | None = (CATALOGUE | OUTSIDERS).get(effect)
    with patch.object(programme, "orders", _same_orders):
        c = sail.strength_of(hull, (weather,), hidden, strength, seed) if hidden else 0.0
        made = [_laid_out(hull, weather, hidden, c, seed, day, 1.0, name) for day in range(days)]
    return Sailed(tuple(run for runs, _ in made for run in runs), made[0][1], c)


def _same_orders(hull: SimulatedHull, seed: int, day: int) -> Float:
    time_s, rows = hull.length_m / hull.trial_speed_m_s, []
    for degrees, side in ((20.0, 1.0), (10.0, -1.0), (20.0, 1.0), (10.0, -1.0)):
        angle, shaft, depth = np.radians(degrees), hull.shaft_speed_per_s, 5.0 * hull.draught_m
        rows.append([0.0, 20.0 * time_s, 1.0, 0.0, 0.0, 0.0, 0.0, shaft, depth])
        rows.append([1.0, 100.0 * time_s, 1.0, angle, angle, side, 6.0, shaft, depth])
    return np.array(rows)


def _laid_out(
    hull: SimulatedHull,
    weather: programme.Weather,
    hidden: HiddenEffect | None,
    c: float,
    seed: int,
    day: int,
    noise: float,
    name: str,
    *,
    sold: bool = False,
) -> tuple[tuple[GridRun, ...], ModelSpec]:
    """Sail a day and lay its zigzags out."""
    step_s, lead_s = _TIMES_S[name]
    voyage = sail.voyage(hull, weather, hidden, c, seed, day)
    settings = TrialSettings(
        hull, (), instruments=readings.instruments(hull), seed=seed + 1000 * day, noise_scale=noise
    )
    sensor = (hidden.name, c) if hidden and hidden.sensor else None
    trial = readings.read(hull, voyage, weather.wind_from_rad, settings, sensor, sold=sold)
    instruments = instruments_of(trial)
    spec = ModelSpec(rate_bias=False, wind_arm_per_m=hull.wind_arm_per_m)
    ship = ShipConstants(hull.length_m, hull.draught_m, hull.wind_arm_per_m)
    records = [
        make_record(instruments, *(settings.start_utc_ns + round(t * SECOND_NS) for t in (e[0] - lead_s, e[_LEGS])))
        for e in voyage.executes_s
    ]
    runs = tuple(
        make_run(f"run {k + len(records) * day}", r, instruments, spec, ship, step_s) for k, r in enumerate(records)
    )
    return runs, spec


def instruments_of(trial: Trial) -> Instruments:
    series = {}
    for record in trial.instruments:
        for column, value in record.values.items():
            channel = CHANNEL_OF[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(record.measured_utc_ns, held)
    return Instruments(series, dict.fromkeys(series, "simulated"), ())
