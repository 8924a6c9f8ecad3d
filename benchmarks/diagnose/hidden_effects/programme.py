"""What a ship of the hidden cases does on her two days, and what wind, stream and bottom do to her: drawn by seed.

Nothing here knows the effect: shaft speed and depth change between the runs of every case.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from benchmarks.diagnose.hidden_effects import plant
from kempf.pipeline.simulate.disturbances import Disturbance
from kempf.pipeline.simulate.hulls import HULLS, HullParameters, SimulatedHull
from kempf.pipeline.simulate.random_streams import stream

Float = NDArray[np.float64]

#: psi0 = delta0 in degrees and first side of the runs, by day.
RUNS = (
    ((20.0, 1.0), (10.0, -1.0), (15.0, 1.0), (20.0, -1.0)),
    ((10.0, 1.0), (20.0, -1.0), (15.0, -1.0), (20.0, 1.0)),
)
DAYS = len(RUNS)

#: Steady course before a run, and the longest a run may take, in ship lengths at the trial speed.
_STEADY_LENGTHS, _LONGEST_LENGTHS = 20.0, 100.0

#: A ship whose own time is longer sails fewer runs of fewer legs a day: a leg of hers takes minutes.
_SLOW_S, _RUNS_OF_SLOW = 30.0, 3

#: A ship whose own time is shorter sails twice as many legs: they are seconds long.
QUICK_SHIP_S = 5.0

#: mean and std of the wind force as shares of the rudder's at 20 degrees; mean and std of the stream, m/s; wind, m/s
_WEATHER = {
    "calm": (0.03, 0.015, 0.05, 0.01, 3.0),
    "moderate": (0.12, 0.05, 0.25, 0.03, 7.0),
    "rough": (0.25, 0.10, 0.60, 0.08, 12.0),
}
DISTURBANCES = tuple(_WEATHER)


def ship(name: str, seed: int) -> SimulatedHull:
    """Return a sister of a hull of the catalogue: every parameter up to 5 % off, another loss of speed in turns.

    Parameters
    ----------
    name : str
        Key of `kempf.pipeline.simulate.hulls.HULLS`.
    """
    hull, random = HULLS[name], stream(seed, "ship")
    p = hull.parameters
    nominal = np.array([p.a11, p.a12, p.a21, p.a22, p.b1, p.b2])
    # a sister that is hardly stable any more would answer to everything with the same slow swing
    for _ in range(100):
        own = HullParameters(*(nominal * (1.0 + random.uniform(-0.05, 0.05, 6))).tolist())
        if own.a11 * own.a22 - own.a12 * own.a21 >= 0.8 * (p.a11 * p.a22 - p.a12 * p.a21):
            break
    return replace(hull, parameters=own, speed_loss=float(random.uniform(0.4, 1.2)))


def grid_s(hull: SimulatedHull) -> float:
    """Return the step of the plant, s: well below what the ship, her rudder and her instruments resolve."""
    return 0.05 if hull.length_m / hull.trial_speed_m_s > 10.0 else 0.02


def orders(hull: SimulatedHull, seed: int, day: int) -> Float:
    """Return the programme of a day as `benchmarks.diagnose.hidden_effects.plant.voyage` takes it, shape (n, 9).

    Three or four times a steady course on a new heading, then a zigzag of five to seven legs, twice as many
    of a boat.

    Parameters
    ----------
    day : int
        0 or 1.
    """
    random = stream(seed, f"programme {day}")
    time_s = hull.length_m / hull.trial_speed_m_s
    heading = random.uniform(0.0, 2.0 * pi)
    turning = 1.0 if random.random() < 0.5 else -1.0
    rows: list[list[float]] = []
    for run, (degrees, side) in enumerate(RUNS[day][: _RUNS_OF_SLOW if time_s > _SLOW_S else None]):
        shaft = hull.shaft_speed_per_s * (1.0 if run == 0 else float(random.choice([1.0, 0.9, 0.8])))
        depth = hull.draught_m * float(random.choice([2.0, 3.0, 5.0, 10.0]))
        legs = float(random.integers(5, 7 if time_s > _SLOW_S else 8)) * (2.0 if time_s < QUICK_SHIP_S else 1.0)
        rows += zigzag(hull, heading, (radians(degrees), radians(degrees)), side, legs, shaft, depth)
        heading += turning * radians(random.uniform(35.0, 70.0))
    return np.array(rows)


def zigzag(
    hull: SimulatedHull,
    heading_rad: float,
    angles_rad: tuple[float, float],
    side: float,
    legs: float,
    shaft_per_s: float,
    depth_m: float,
) -> list[list[float]]:
    """Return a steady course and a zigzag as two rows of a programme.

    Parameters
    ----------
    angles_rad : (float, float)
        psi0 and delta0.
    """
    time_s = hull.length_m / hull.trial_speed_m_s
    around = (shaft_per_s, depth_m)
    return [
        [0.0, _STEADY_LENGTHS * time_s, heading_rad, 0.0, 0.0, 0.0, 0.0, *around],
        [1.0, _LONGEST_LENGTHS * time_s, heading_rad, *angles_rad, side, legs, *around],
    ]


@dataclass(frozen=True)
class Weather:
    """What acts on a ship for a day."""

    #: force, north, east, wind: F of eq. (16), m/s^2; the stream, m/s; the true wind, m/s.
    force: Disturbance
    north: Disturbance
    east: Disturbance
    wind: Disturbance
    wind_from_rad: float
    wave_from_rad: float

    def forcing(self, n: int, step_s: float, seed: int) -> Float:
        """Return the columns of `benchmarks.diagnose.hidden_effects.plant.FORCING`, shape (n, 4)."""
        parts = (self.force, self.north, self.east, self.wind)
        return np.column_stack(
            [p.path(n, step_s, stream(seed, name)) for p, name in zip(parts, plant.FORCING, strict=True)]
        )


def weather(hull: SimulatedHull, level: str, seed: int, day: int) -> Weather:
    """Draw the weather of a day.

    Parameters
    ----------
    hull : SimulatedHull
        Wind force goes with her rudder's force, the stream with her speed where she is slow.
    level : str
        One of `DISTURBANCES`.
    """
    mean, std, flow, flow_std, wind = _WEATHER[level]
    random = stream(seed, f"weather {day}")
    force = abs(hull.parameters.b1) * hull.trial_speed_m_s**2 * radians(20.0)
    slow = min(1.0, hull.trial_speed_m_s / 5.0)
    side = 1.0 if random.random() < 0.5 else -1.0
    to, blows, rolls = random.uniform(0.0, 2.0 * pi, 3).tolist()
    return Weather(
        Disturbance(side * mean * force, std * force, 1.0 / 300.0),
        Disturbance(flow * slow * cos(to), flow_std * slow, 1.0 / 1800.0),
        Disturbance(flow * slow * sin(to), flow_std * slow, 1.0 / 1800.0),
        Disturbance(wind, 0.06 * wind, 1.0 / 20.0),
        blows,
        rolls,
    )
